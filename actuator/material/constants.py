"""The constants that compiled kernels take: those of the model and those of the hyperelastic law, in one flat tuple.

Kernels are compiled for the type of the tuple, and by it they find the functions of the law. All entries stay plain
numbers, side by side: numba's parallel loops take no tuples within tuples. Free of compiled code.
"""

from __future__ import annotations

import hashlib
import re
import sys
import uuid
from collections import namedtuple
from functools import cache
from math import nan
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from actuator.parameters import Law, Load, Material, Objective


class Constants(NamedTuple):
    """The constants of the model; units as in :mod:`actuator.parameters`. Those of the law follow in its own tuple."""

    bulk: float
    shear: float
    ramp_penalty: float
    stiffness_contrast: float
    void_permeability: float
    solid_permeability: float
    drainage: float
    hessian_penalty: float
    pressure: float
    strain_energy_weight: float
    energy_limit: float
    energy_shift: float


def constants_of(material: Material, load: Load, objective: Objective) -> Constants:
    """Collect the constants, which have the names of the parameters, in the tuple of the material's law."""
    parameters = vars(material) | vars(load) | vars(objective)
    return _filled(Constants(**{name: parameters[name] for name in Constants._fields}), material.law)


def constants_of_law(law: Law) -> Constants:
    """The tuple for functions that read no constant of the model, all of which are NaN in it."""
    return _filled(Constants._make([nan] * len(Constants._fields)), law)


def _filled(model: Constants, law: Law) -> Constants:
    return kernel_constants(type(law))._make(float(value) for value in (*model, *law))


def law_file(kind: type) -> ModuleType:
    """The file of a law: the module in which the class of its coefficients stands.

    Args:
        kind: that class, or one made from it by :func:`kernel_constants`.
    """
    return sys.modules[getattr(kind, "law", kind).__module__]


@cache
def kernel_constants(law: type[Any]) -> type[Constants]:
    """The type of the constants with the coefficients of a law.

    numba's cache on the disk knows a type by its name in its module, and one index has the types of all laws that a
    kernel has been compiled for. So the types stand in this module, whoever wrote the law, and are named after their
    fields and the text of the law's file: kernels that were compiled from another text are not taken for those of this
    one.

    Args:
        law: class of the law's coefficients.

    Raises:
        ValueError: if a coefficient has the name of a constant of the model.
    """
    text = getattr(law_file(law), "__file__", None)
    # A law that was typed into a session has no file and must not be found again by another session.
    content = Path(text).read_bytes() if text else uuid.uuid4().bytes
    fields = (*Constants._fields, *law._fields)
    digest = hashlib.sha256(repr((law.__module__, law.__qualname__, fields)).encode() + content).hexdigest()
    return _kept(f"{law.__name__}_{digest[:12]}", fields, law)


def _kept(name: str, fields: tuple[str, ...], law: type | None) -> type[Constants]:
    """A type that is found under its name in this module."""
    make: Any = namedtuple  # mypy wants the fields of a tuple spelt out; here they are those of two others
    kind: Any = make(name, fields, module=__name__)
    kind.law = law
    globals()[name] = kind
    found: type[Constants] = kind
    return found


if not TYPE_CHECKING:

    def __getattr__(name: str) -> type:
        """A type without a law, for one that numba's index names but this process does not have.

        Its law belongs to a program that is not running, or its file has been edited since.
        """
        if re.fullmatch(r"\w+_[0-9a-f]{12}", name):
            return _kept(name, Constants._fields, None)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

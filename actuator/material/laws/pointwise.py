"""The functions of whatever law a tuple of coefficients belongs to, in Python and in compiled code alike.

In compiled code the choice is made by type when a function is compiled and costs nothing when it runs.
"""

from __future__ import annotations

from types import ModuleType

from numba.extending import overload

from actuator.material.laws import mooney_rivlin, neo_hooke, ogden, yeoh
from actuator.material.laws.coefficients import MooneyRivlin, NeoHooke, Ogden, Yeoh

_LAWS: dict[type, ModuleType] = {NeoHooke: neo_hooke, MooneyRivlin: mooney_rivlin, Yeoh: yeoh, Ogden: ogden}


def law_of(kind: type) -> ModuleType:
    """The module of a law's tuple, or of one that names its law in the attribute ``law``."""
    return _LAWS[getattr(kind, "law", kind)]


def energy(law, b):
    """w(b̄) of :mod:`actuator.material.laws`."""
    return law_of(type(law)).energy(law, b)


def stress(law, b, S):
    """Write S = 2 b̄ ∂w/∂b̄ of :mod:`actuator.material.laws`, (3, 3)."""
    law_of(type(law)).stress(law, b, S)


def tangent(law, b, X, dS):
    """Write the derivatives of S along X (m, 3, 3)."""
    law_of(type(law)).tangent(law, b, X, dS)


@overload(energy)
def _energy(law, b):
    chosen = law_of(law.instance_class).energy
    return lambda law, b: chosen(law, b)


@overload(stress)
def _stress(law, b, S):
    chosen = law_of(law.instance_class).stress
    return lambda law, b, S: chosen(law, b, S)


@overload(tangent)
def _tangent(law, b, X, dS):
    chosen = law_of(law.instance_class).tangent
    return lambda law, b, X, dS: chosen(law, b, X, dS)

"""poro for Python: topology optimisation of pneumatic soft actuators, from a case to a part to print.

>>> import poro
>>> case = poro.read_case("quick.yaml")
>>> design = poro.optimize(case)
>>> part = poro.export(case, poro.mirror(case, poro.refine(case, design)))

Nothing heavy is loaded before it is used. :mod:`poro.interface` says what every function takes and returns,
:mod:`poro.figures` what can be drawn, and docs/use/python.md shows all of it.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from poro import strangers

if TYPE_CHECKING:
    from actuator.failure import Failure
    from pipeline.case.model import Case
    from pipeline.exit_codes import Fault
    from pipeline.results.design import OptimisedDesign
    from poro import figures
    from poro.interface import (
        check,
        compare,
        export,
        finish,
        fit,
        inflate,
        load,
        make_case,
        mirror,
        optimize,
        read_case,
        refine,
        rig,
        simulate,
        slice,
        with_changes,
    )
    from stages.events import DesignUpdate, FinishStep, LoadStep, Message

    __version__: str

__all__ = [
    "Case",
    "DesignUpdate",
    "Failure",
    "Fault",
    "FinishStep",
    "LoadStep",
    "Message",
    "OptimisedDesign",
    "__version__",
    "check",
    "compare",
    "export",
    "figures",
    "finish",
    "fit",
    "inflate",
    "load",
    "make_case",
    "mirror",
    "optimize",
    "read_case",
    "refine",
    "rig",
    "simulate",
    "slice",
    "with_changes",
]

#: Modules of the names that do not stand in :mod:`poro.interface`.
_ELSEWHERE = {
    "Case": "pipeline.case.model",
    "DesignUpdate": "stages.events",
    "Failure": "actuator.failure",
    "Fault": "pipeline.exit_codes",
    "FinishStep": "stages.events",
    "LoadStep": "stages.events",
    "Message": "stages.events",
    "OptimisedDesign": "pipeline.results.design",
}

strangers.refuse()


def __getattr__(name: str) -> Any:
    """A name of the interface, whose module is loaded when it is first used."""
    if name not in __all__:
        raise AttributeError(f"module 'poro' has no attribute '{name}'")
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("poro")
    if name == "figures":
        return importlib.import_module("poro.figures")
    return getattr(importlib.import_module(_ELSEWHERE.get(name, "poro.interface")), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

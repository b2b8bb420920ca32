"""What a running stage reports to its observer. Observers show, log or store; stages stay silent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Message:
    """One sentence for the log."""

    text: str


@dataclass(frozen=True)
class Compiled:
    """How far the compilation is, which the first run after an installation waits for.

    Attributes:
        done, total: steps.
    """

    done: int
    total: int


@dataclass(frozen=True)
class DesignUpdate:
    """An accepted design update.

    Attributes:
        record: one row of the history: ``update``, ``evaluations``, ``C``, ``C0``, ``C_chi``, ``C_A``, ``C_i``,
            ``C_p``, ``C_psi``, ``T1``, ``T3`` (mm), ``theta2`` (rad), ``dt`` (pseudo-time step), ``stationarity``,
            ``seconds`` and further solver counts.
        updates_limit: most updates this run will make, for an estimate of the time left.
        checkpoint: everything needed to continue from here, as named arrays (and 0-d arrays).
        fields: the design and its state at the vertices: ``chi`` (n_vertices,), dimensionless, ``pressure``
            (n_vertices,), N/mm², and ``displacement`` (n_vertices, 3), mm.
    """

    record: Mapping[str, float]
    updates_limit: int
    checkpoint: Callable[[], dict[str, Any]]
    fields: Callable[[], dict[str, Any]]


@dataclass(frozen=True)
class LoadStep:
    """A point of a pressure-displacement curve.

    Attributes:
        field: what is inflated, the density field or the part as printed.
        record: one row of the curve, :data:`stages.response.COLUMNS` or :data:`stages.inflation.UNITS`.
        max_load: load factor at which the way up ends.
    """

    field: str
    record: Mapping[str, float]
    max_load: float


@dataclass(frozen=True)
class FinishStep:
    """A part on the way to the finished one.

    Attributes:
        record: one row of the history, :data:`stages.finish.HISTORY`.
        most: steps of this run.
    """

    record: Mapping[str, float]
    most: int


Event = Message | Compiled | DesignUpdate | LoadStep | FinishStep
Observer = Callable[[Event], None]


def silent(event: Event) -> None:
    """An observer that ignores everything."""

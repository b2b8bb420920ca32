"""What a stage is given when a case is run, and what its module has for that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from actuator.solver_name import SolverName
from stages.events import Observer, silent

if TYPE_CHECKING:
    from actuator.arrays import Floats, Ints
    from stages.datasets import Packed, Source
    from stages.initial import Given
    from stages.regions import Bodies


@dataclass(frozen=True)
class Compute:
    """What may change the time but not the result; kept out of the content key."""

    threads: int = 2
    linear_solver: SolverName = "auto"


@dataclass(frozen=True)
class Task:
    """A case at one of its stages.

    Attributes:
        case: its attributes are ``name`` and the sections of the case file.
        source: the artifact of the stage before; None for a stage that works on none.
        solid: vertices (n, 3), mm, and triangles (m, 3) of the part, for a stage that works on one that was exported.
        optimised: summary of the optimisation that a part came from, where it is at hand.
        compute: threads and linear solver.
        observer: is told what happens.
        resume: the checkpoint to continue from, if there is one.
        initial: what the file holds that the case names to begin with, if it names one.
        bodies: what the files hold that regions of the case name, by the number of the region.
    """

    case: Any
    source: Source | None = None
    solid: tuple[Floats, Ints] | None = None
    optimised: Mapping[str, Any] | None = None
    compute: Compute | None = None
    observer: Observer = silent
    resume: Mapping[str, Any] | None = None
    initial: Given | None = None
    bodies: Bodies = field(default_factory=dict)

    @property
    def upstream(self) -> Source:
        """The artifact of the stage before, for a stage that works on one."""
        assert self.source is not None
        return self.source

    @property
    def part(self) -> tuple[Floats, Ints]:
        """The exported part, for a stage that works on one."""
        assert self.solid is not None
        return self.solid


@dataclass(frozen=True)
class Need:
    """Least memory of a stage.

    Attributes:
        cells: of its mesh.
        memory: bytes.
        remedy: what to change where a machine has less.
    """

    cells: int
    memory: float
    remedy: str


class StageModule(Protocol):
    """What the module of a stage has for this, beside its ``run``, whose arguments are what suits it.

    It may also have ``Settings``, a :class:`~stages.section.Section` of the case file that is called as the stage is,
    and these functions:

    * ``lines(summary)``: what a user reads of a summary, pairs of name and value;
    * ``verdict(summary)``: of these, what stands first: whether the result is any good;
    * ``needs(case)``: the least memory for a case, as :class:`Need`;
    * ``shortfall(summary, path)``: what the result at a path lacks, with the remedy, or an empty text; with such a
      result the command ends as interrupted, or as not converged if the summary says ``finished``;
    * ``instability(summary, path)``: why the state in the whole result at a path is not one that a part would stay in,
      with the remedy, or an empty text; the stage's own command and ``run`` then end as unstable.

    Attributes:
        VERSION: of its method; a change of it makes older results stale.
    """

    VERSION: int

    def start(self, task: Task) -> Any:
        """Call ``run`` with what the case says and the stage before left; returns its result."""

    def pack(self, result: Any) -> Packed:
        """What is stored of a result."""

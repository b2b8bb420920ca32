"""Stage ``finish``: the surface of the part itself, moved until the part as printed keeps its strain limit.

The optimiser keeps the limit in the density field, where the surface is half-dense. Here the body between the plates is
meshed, inflated to p_in, and its surface moved by exact shape derivatives (:mod:`actuator.shaping`); what comes out is
χ on the same finer mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from actuator.arrays import Floats
from actuator.failure import EmptySolid, NotInflatable, NotManifold, SolveFailure
from stages import refine
from stages.datasets import Dataset, Packed, design
from stages.events import FinishStep, Message, Observer, silent
from stages.inflate import inflation_of, refuse_unlike
from stages.regions import stored_bounds
from stages.section import Section
from stages.settings import ProblemSettings
from stages.task import Compute, Task

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.regions.bounds import Bounds
    from actuator.shaping.flow import Flow
    from stages.rig import RigUnits

VERSION = 2

#: Units of the columns of the history, in the order of a table: C_0, travel at p_in, Ψ / Ψ_lim below which all but the
#: share of the volume stays that may be above, the largest one away from the clamps, the share above with the clamps,
#: least wall and gap, and volume of what is modelled.
HISTORY = {
    "step": "1",
    "C0": "1",
    "travel": "mm",
    "energy_ratio": "1",
    "largest_ratio": "1",
    "share_above": "1",
    "wall": "mm",
    "gap": "mm",
    "volume": "mm^3",
    "seconds": "s",
}


class Settings(Section):
    """What is done to the surface of the part before it is exported."""

    method: Literal["strain"] | None = Field(
        None, description="moves the surface until the inflated part keeps objective.strain_limit; nothing if none"
    )
    steps: int = Field(80, ge=0, description="most motions of the surface [-]")
    size: float = Field(2.0, gt=0, description="largest edge of the tetrahedra, in lengths of the domain [mm]")
    share: float = Field(5e-4, gt=0, lt=1, description="share of the volume that may be above the limit [-]")
    clamp: float = Field(
        0.5, ge=0, description="distance from the plates within which the strain has no bound and does not count [mm]"
    )
    wall: float | None = Field(
        None, gt=0, description="least wall, in lengths of the domain; as thin as at first if left out [mm]"
    )
    gap: float = Field(1.0, ge=0, description="least gap, in lengths of the domain [mm]")

    @model_validator(mode="before")
    @classmethod
    def _by_its_method(cls, given: Any) -> Any:
        """Read ``finish: strain`` as the method alone, and ``none`` as no method."""
        named = {"method": given} if isinstance(given, str) else given
        return {**named, "method": None} if isinstance(named, dict) and named.get("method") == "none" else named


@dataclass(frozen=True)
class Result:
    """A finished design.

    Attributes:
        domain: the finer domain.
        chi: χ at its vertices, (n_vertices,), dimensionless.
        history: one record per part, the first being the one that was there; column name -> (n_records,).
        chosen: which of the parts this is.
        kept: whether it keeps its strain limit and its walls.
        finished: false if the user interrupted.
        bounds: what keeps regions of the case in the part, at the vertices; None without regions.
    """

    domain: Domain
    chi: Floats
    history: dict[str, Floats]
    chosen: int
    kept: bool = True
    finished: bool = True
    bounds: Bounds | None = None


def run(
    domain: Domain,
    chi: Floats,
    problem: ProblemSettings,
    settings: Settings,
    threshold: float = 0.0,
    compute: Compute | None = None,
    observer: Observer = silent,
    bounds: Bounds | None = None,
) -> Result:
    """Move the surface of a design until the part keeps its strain limit; without a method χ is kept, the same object.

    Args:
        domain: the finer mesh.
        chi: χ̄ at its vertices, (n_vertices,), dimensionless.
        problem: material, load and strain limit.
        settings: what the part must keep, and how long to try.
        threshold: level of the surface.
        compute: threads and linear solver.
        observer: is told of every part.
        bounds: of the case's regions, which the part keeps.

    Raises:
        actuator.failure.InvalidSettings: if the case has several chambers or a force.
        actuator.failure.NotInflatable: if the design is no part with a closed chamber between the plates.
        actuator.failure.SolveFailure: if it has no state at p_in.
    """
    if settings.method is None:
        return Result(domain, chi, {}, 0, bounds=bounds)
    problem = problem.leading
    refuse_unlike(problem)
    from actuator.threads import use_threads

    compute = compute or Compute()
    use_threads(compute.threads)
    chi = chi if bounds is None else bounds.kept(chi, threshold)
    flow = _flow(domain, chi, problem, settings, threshold, compute, bounds)
    records: list[dict[str, float]] = []
    best, chosen, finished = chi, 0, True
    try:
        for number, step in enumerate(flow.steps()):
            record = dict(zip(HISTORY, (float(number), *step.figures, step.seconds), strict=True))
            records.append(record)
            observer(FinishStep(record, settings.steps))
            least_wall = settings.wall or records[0]["wall"]
            if number == 0 or _better(record, records[chosen], least_wall):
                best, chosen = step.chi, number
            if number == settings.steps:
                break
    except (EmptySolid, NotManifold, NotInflatable, SolveFailure) as failure:
        if not records:
            raise
        observer(Message(f"No way on from here: {failure}"))
    except KeyboardInterrupt:
        if not records:
            raise
        finished = False
        observer(Message("Interrupted; the best part so far is kept."))
    history = {name: np.array([record[name] for record in records]) for name in HISTORY}
    kept = _excess(records[chosen], settings.wall or records[0]["wall"]) <= 1.0
    return Result(domain, best, history, chosen, kept, finished, bounds)


def _excess(record: Mapping[str, float], least_wall: float) -> float:
    """By which factor a part is beyond its strain limit or its walls; at most 1 if it keeps both."""
    return max(record["energy_ratio"], least_wall / record["wall"])


def _better(record: Mapping[str, float], best: Mapping[str, float], least_wall: float) -> bool:
    """Whether a part is better: it keeps strain limit and walls and travels farther, or is nearer to keeping them."""
    excess, of_best = _excess(record, least_wall), _excess(best, least_wall)
    if excess <= 1.0 and of_best <= 1.0:
        return record["C0"] < best["C0"]
    return excess < of_best


def _flow(
    domain: Domain,
    chi: Floats,
    problem: ProblemSettings,
    settings: Settings,
    threshold: float,
    compute: Compute,
    bounds: Bounds | None,
) -> Flow:
    # scikit-fem, SciPy, Mmg: only where it runs
    from actuator.regions.bounds import Bounds
    from actuator.shaping.flow import Controls, Flow, Limits

    material, load, objective = problem.parameters()
    own = Bounds(None, domain.passive_bound(domain.points, objective.interface_width, objective.length_unit))
    return Flow(
        domain,
        chi,
        own if bounds is None else bounds.at(threshold).also(own),
        threshold,
        lambda mesh: inflation_of(mesh, material, load, problem, compute),
        problem.goal(load),
        load,
        problem.material.youngs_modulus,
        Limits(problem.objective.strain_limit, settings.share, settings.clamp, settings.wall, settings.gap),
        replace(Controls(), size=settings.size),
        compute.threads,
    )


def start(task: Task) -> Result:
    """Finish the refined design of a case."""
    case = task.case
    return run(
        *design(task.upstream),
        case.optimize,
        case.finish,
        case.mirror.threshold,
        task.compute,
        task.observer,
        stored_bounds(task.upstream, case.regions),
    )


def pack(result: Result) -> Packed:
    """The design, and how it came about."""
    packed = refine.pack(refine.Result(result.domain, result.chi, result.bounds))
    history = {
        f"history/{name}": Dataset(column, HISTORY[name], f"{name} of every part")
        for name, column in result.history.items()
    }
    summary: dict[str, Any] = {"method": None}
    if result.history:
        rows = [{name: float(column[k]) for name, column in result.history.items()} for k in (0, result.chosen)]
        summary = {
            "method": "strain",
            "before": rows[0],
            "after": rows[1],
            "chosen": result.chosen,
            "steps": len(result.history["step"]) - 1,
            "seconds": float(result.history["seconds"].sum()),
            "kept": result.kept,
            "finished": result.finished,
        }
    return replace(packed, summary=summary, datasets={**packed.datasets, **history})


def verdict(found: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
    """Whether the finished part keeps its strain limit, and the travel that is left; nothing where not asked for."""
    if found["method"] is None:
        return []
    before, after = found["before"], found["after"]
    kept = "keeps strain limit and walls" if found["kept"] else "does not keep strain limit and walls yet"
    travels = " → ".join(f"{rig.millimetres(row['travel']):.3f}" for row in (before, after))
    return [
        ("finish", f"the inflated part {kept}; travel {travels} mm"),
        ("", f"above the limit {100 * before['share_above']:.2g} % → {100 * after['share_above']:.2g} % of the volume"),
    ]


def lines(found: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
    """Walls, gaps and work."""
    if found["method"] is None:
        return []
    before, after = found["before"], found["after"]
    widths = "; ".join(
        f"least {name} {rig.millimetres(before[name]):.2f} → {rig.millimetres(after[name]):.2f} mm"
        for name in ("wall", "gap")
    )
    return [("", widths), ("", f"{found['steps']} steps in {found['seconds']:.0f} s")]


def shortfall(found: Mapping[str, Any], path: str) -> str:
    """That the limit is not kept, or that the user interrupted."""
    if found["method"] is None or (found["kept"] and found["finished"]):
        return ""
    if not found["finished"]:
        return f"{path}: the finish was interrupted; run it again."
    return (
        f"{path}: after {found['steps']} steps the part does not keep strain limit and walls: raise finish.steps, or "
        "begin with a design of a lower objective.strain_limit."
    )

"""From the state that an optimisation ended in, or has reached, to the result that is kept of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stages.design import OtherState, Result, unit_of_column
from stages.load import arm_end
from stages.settings import ProblemSettings
from stages.similarity import Units, similar

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.domains.interface import Domain
    from actuator.equations.kinematics import Kinematics
    from actuator.load_case import LoadCase
    from actuator.optimiser.loop import Outcome, Record

#: What is said of a design whose optimisation has not ended.
UNFINISHED = "The optimisation has not ended: this is the state after design update {}."


class Reached(NamedTuple):
    """A design and its states in the units of the computation.

    Attributes:
        cases: load cases, in N and mm.
        kinematics: under each of them.
        chi: (n_vertices,).
        x, p: of each load case.
    """

    cases: Sequence[LoadCase]
    kinematics: Sequence[Kinematics]
    chi: Floats
    x: Sequence[Floats]
    p: Sequence[Floats]

    def elongations(self) -> list[float]:
        """Travel of the arm's end under each load case, positive downwards."""
        return [-float(own.elongation(x)) for own, x in zip(self.kinematics, self.x, strict=True)]


def told(
    domain: Domain,
    state: Reached,
    history: Sequence[Record],
    terms: tuple[str, ...],
    checks: dict[str, float],
    outcome: Outcome | None,
    checkpoint: dict[str, Floats],
    units: Units,
) -> Result:
    """The result in mm and N/mm²; of a run that has not ended if there is no outcome."""
    from actuator.equations.arm import COORDINATES, PAPER_COORDINATES  # as in run
    from actuator.optimiser.loop import COUNTS, PARTS

    records = [recorded(record, units) for record in history]
    columns, last = {key: np.array([record[key] for record in records]) for key in records[0]}, records[-1]
    times = {f"seconds_{part}": part for part in PARTS}
    moved = tuple(name for name in COORDINATES if name in last)
    known = ("C", *terms, *moved, "stationarity", "update", "evaluations", "dt", "inner", "seconds")
    kinematics, x, p = state.kinematics[0], state.x[0], units.stress * state.p[0]
    of_cases = _by_case(last, state, domain, units)
    converged, reason = (outcome.converged, outcome.reason) if outcome else (False, UNFINISHED.format(len(records) - 1))
    summary = {
        "C": last["C"],
        "terms": {name: last[name] for name in terms},
        **{name: last[name] for name in moved},
        "spring_elongation": units.length * state.elongations()[0],
        "p_min": float(p.min()),
        "p_max": float(p.max()),
        **checks,
        **{name: value for name, value in last.items() if name not in (*known, *COUNTS, *times) and "." not in name},
        **({"load_cases": of_cases} if of_cases else {}),
        "stationarity": last["stationarity"],
        "updates": len(records) - 1,
        "evaluations": outcome.progress.evaluations if outcome else int(last["evaluations"]),
        "work": {key: int(last[key]) for key in (*COUNTS, "inner")},
        "seconds": last["seconds"],
        "seconds_per_part": {part: last[name] for name, part in times.items()},
        "converged": converged,
        "reason": reason,
    }
    of_arm = units.length, units.length, 1.0
    return Result(
        domain=domain,
        chi=state.chi,
        displacement=units.length * kinematics.displacement(x),
        pressure=p,
        arm=kinematics.motion(x)[PAPER_COORDINATES] * of_arm,
        history=columns,
        summary=summary,
        checkpoint=checkpoint,
        converged=converged,
        reason=reason,
        others={
            case.name: OtherState(
                units.length * own.displacement(x), units.stress * p, own.motion(x)[PAPER_COORDINATES] * of_arm
            )
            for case, own, x, p in list(zip(state.cases, state.kinematics, state.x, state.p, strict=True))[1:]
        },
    )


def _by_case(last: Record, state: Reached, domain: Domain, units: Units) -> dict[str, dict[str, float]]:
    """What a summary says of each of several load cases, by their names."""
    from actuator.solve.reduced import wall_leak

    found = {}
    for case, p, travel in zip(state.cases, state.p, state.elongations(), strict=True):
        if case.name:
            ending = f".{case.name}"
            own = {name.removesuffix(ending): value for name, value in last.items() if name.endswith(ending)}
            more = {"spring_elongation": units.length * travel, "wall_leak": wall_leak(domain, p, case.load.pressure)}
            found[case.name] = {"weight": case.weight, **own, **more}
    return found


def recorded(record: Record, units: Units) -> Record:
    """A record of the history with its lengths in mm."""
    lengths = {name: value for name, value in record.items() if unit_of_column(name) == "mm"}
    return record | {name: units.length * value for name, value in lengths.items()}


def reached(problem: ProblemSettings, checkpoint: Mapping[str, Any]) -> Result:
    """The design of a checkpoint, of a run that has not ended: nothing is solved.

    Its summary lacks what is only computed at the end: the leak by second-order elements and the share of the solid in
    the passive core.

    Args:
        problem: the case.
        checkpoint: as an event of the run gave it.

    Raises:
        actuator.failure.InvalidField: if it is none of this case.
    """
    from actuator.equations.kinematics import Kinematics  # as in run
    from actuator.failure import InvalidField
    from actuator.solve.reduced import wall_leak
    from actuator.solve.stacking import split
    from actuator.terms import PAPER

    core, units = similar(problem)
    cases, domain = core.load_cases(), core.domain.build()
    kinematics = [Kinematics(domain, case.load) for case in cases]
    chi, x, p = (checkpoint.get(name, np.empty(0)) for name in ("chi", "x", "p"))
    columns = {key.removeprefix("history."): value for key, value in checkpoint.items() if key.startswith("history.")}
    n, m = len(domain.points), len(cases)
    if chi.shape != (n,) or p.shape != (m * n,) or x.shape != (m * kinematics[0].size,) or not columns:
        raise InvalidField("its state does not fit its mesh; start over with --fresh.")
    state = Reached(cases, kinematics, chi, split(x, m), split(p, m))
    leaks = [wall_leak(domain, p, case.load.pressure) for case, p in zip(cases, state.p, strict=True)]
    checks, terms = {"wall_leak": max(leaks)}, (*PAPER, *problem.objective.terms)
    try:
        rows = [dict(zip(columns, map(float, row), strict=True)) for row in zip(*columns.values(), strict=True)]
        result = told(problem.domain.build(), state, rows, terms, checks, None, dict(checkpoint), units)
    except (LookupError, TypeError, ValueError):
        raise InvalidField("its history is not whole; start over with --fresh.") from None
    result.summary.update(arm_end(problem, result.summary["spring_elongation"]))
    return result

"""Rows of the report's tables, from the summaries that the artifacts hold."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from pipeline.case.model import Case
from pipeline.results.design import OptimisedDesign
from pipeline.results.paper import Reference, on_the_papers_mesh, reading
from pipeline.results.wording import count, duration, formatted
from stages.load import held, travel, whole_force
from stages.rig import RigUnits

Summary = Mapping[str, Any]


@dataclass(frozen=True)
class Number:
    """A number as it is shown, and as the artifact holds it."""

    value: float
    text: str


@dataclass(frozen=True)
class Performance:
    """One quantity of the initial design, of the final one, and of the paper's.

    Attributes:
        name: of the quantity, with its unit.
        initial, final: numbers.
        paper: the paper's number, or None.
        share: final over the paper's, or None.
        part: the final length on the part, or None where that is no other.
    """

    name: str
    initial: Number | None
    final: Number
    paper: Number | None = None
    share: float | None = None
    part: Number | None = None


@dataclass(frozen=True)
class Constraint:
    """How well a penalised constraint is met: the value, its limit, and by how much the value lies over it."""

    name: str
    value: Number
    limit: str
    met: bool
    verdict: str


@dataclass(frozen=True)
class Entry:
    """A named value."""

    name: str
    value: str


def performance(design: OptimisedDesign, reference: Reference | None, rig: RigUnits) -> list[Performance]:
    """The design's performance beside the paper's, and under the load cases after the first."""
    summary, history = design.summary, design.history
    _, load, _ = design.case.optimize.parameters()
    start = {name: float(history[name][0]) for name in ("C", "C0", "T1", "T3", "theta2")}
    start["elongation"] = load.arm_length * math.sin(start["theta2"]) - start["T3"]
    end = {
        "C": summary["C"],
        "C0": summary["terms"]["C0"],
        "T1": summary["T1"],
        "T3": summary["T3"],
        "theta2": summary["theta2"],
        "elongation": summary["spring_elongation"],
    }
    rows = [
        ("main objective C0", "C0", 6, 1.0),
        ("shift of the arm's root T3 [mm]", "T3", 3, 1.0),
        ("rotation of the arm θ2 [°]", "theta2", 3, 180.0 / math.pi),
        (f"{travel(design.case)} [mm]", "elongation", 3, 1.0),
        ("shift of the arm's root T1 [mm]", "T1", 3, 1.0),
        ("total objective C", "C", 6, 1.0),
    ]
    for case, values in list(summary.get("load_cases", {}).items())[1:]:
        own = {name: f"{name}.{case}" for name in ("C0", "T3", "theta2")}
        start |= {key: float(history[key][0]) for key in own.values()}
        end |= {key: values[name] for name, key in own.items()}
        rows += [(f"{case}: {label}", own[key], digits, factor) for label, key, digits, factor in rows if key in own]

    def number(value: float, digits: int, factor: float) -> Number:
        return Number(factor * value, f"{factor * value:.{digits}f}".replace("-", "−"))

    found = []
    for name, key, digits, factor in rows:
        printed = getattr(reference, key, None)
        found.append(
            Performance(
                name,
                number(start[key], digits, factor),
                number(end[key], digits, factor),
                None if printed is None else number(printed, digits, factor),
                None if printed is None else end[key] / printed,
                number(rig.millimetres(end[key]), digits, 1.0) if "[mm]" in name and rig.scale != 1.0 else None,
            )
        )
    return found


def constraints(summary: Summary) -> list[Constraint]:
    """How well the penalised constraints are met; the check by second-order elements may be missing."""
    shown = (
        ("largest p / p_in on the outer wall", "wall_leak", 0.0, 1e-2),
        ("the same with second-order pressure", "wall_leak_second_order", 0.0, 1e-2),
        ("pressure off its own at the inlet of a chamber, over p_in", "chamber_leak", 0.0, 1e-2),
        ("largest energy density over its limit, max Ψ / Ψ_lim", "energy_ratio", 1.0, 0.0),
        ("steepest interface over its limit, max ‖∇χ‖ L_i / 8", "steepest", 1.0, 0.0),
        ("share of the solid in the passive core", "passive_share", 0.0, 1e-6),
    )
    found = []
    for name, key, limit, slack in shown:
        if key not in summary:
            continue
        value = summary[key]
        met = value <= limit + slack
        if limit:
            verdict = "met" if met else f"{100.0 * (value / limit - 1.0):.1f} % over"
        else:
            verdict = "met" if value <= 0.0 else f"below {slack:g}" if met else f"above {slack:g}"
        text = f"{value:.3f}" if limit else f"{value:.1e}".replace("e-0", "e-") if value else "0"
        found.append(Constraint(name, Number(value, text), f"{limit:g}", met, verdict))
    return found


def opening(design: OptimisedDesign, reference: Reference | None, rig: RigUnits) -> str:
    """What the report is of, in a paragraph."""
    summary, case = design.summary, design.case
    _, load, limits = case.optimize.parameters()
    cells = design.domain.mesh.nelements
    whose = "a design of its own"
    if reference:
        whose = f"the paper's actuator for an allowable strain of {100 * reference.strain_limit:g} %"
        whose += ", on the paper's mesh" if on_the_papers_mesh(case.domain) else ", on another mesh than the paper's"
    turned, moved = math.degrees(summary["theta2"]), summary["spring_elongation"]
    beside = f", {100 * moved / reference.elongation:.0f} % of what the paper reports" if reference else ""
    own = "" if rig.same else ", in size and modulus of the case,"
    first = f" (load case {case.load.cases[0].name}, the first of {len(case.load.cases)})" if case.load.cases else ""
    if held(case):
        moves = f"pulls with {abs(whole_force(case, moved)):.3g} N at its end, which the spring holds"
    else:
        whose_end = "the spring's end" if load.spring_stiffness else "its end"
        moves = f"moves {whose_end} by {moved:.2f} mm"
    sentences = [
        f"{design.name} is {whose}: {cells} cells, Ψ_lim = {limits.energy_limit:.4g} N/mm².",
        *([f"What the paper leaves open is read so: {reading(case.optimize)}."] if reference else []),
        f"Under {1e3 * load.pressure:.3g} kPa{own}{first} it turns the arm by {turned:.2f}° and {moves}{beside}.",
        *([] if rig.same else [f"{_of_part(rig)} {rig.millimetres(abs(moved)):.2f} mm."]),
        f"{count(summary['updates'], 'design update')} and {count(summary['evaluations'], 'evaluation')} were made. "
        f"{summary['reason']}",
    ]
    if not summary["converged"]:
        sentences.append(
            f"The design is not converged: stationarity {summary['stationarity']:.2g}, to be "
            f"{case.optimizer.stationarity:g}."
        )
    return " ".join(sentences)


def _of_part(rig: RigUnits) -> str:
    """The beginning of a sentence that ends with the travel of the part."""
    part = f"of a modulus of {rig.youngs_modulus:g} N/mm² and {rig.scale:.6g} times its size"
    return f"The part, {part}, needs {rig.pressure:.3g} kPa for the same angle, and moves the spring's end by"


def work(summary: Summary) -> list[Entry]:
    """What the optimisation cost."""
    names = {
        "factorisations": "factorisations",
        "newton": "Newton steps",
        "krylov": "Krylov iterations",
        "inner": "steps of the inner problem",
    }
    counts = {"design updates": summary["updates"], "evaluations": summary["evaluations"]}
    counts |= {text: summary["work"][key] for key, text in names.items()}
    times = {"all parts": summary["seconds"]} | summary["seconds_per_part"]
    return [
        *(Entry(name, f"{count:,}") for name, count in counts.items()),
        *(Entry(f"time, {part}", duration(seconds)) for part, seconds in times.items()),
    ]


def part(summary: Summary, shape: Summary) -> list[Entry]:
    """What the exported part measures.

    Args:
        summary: of ``export``.
        shape: of ``mirror``; empty if that is not at hand.
    """
    low, high = summary["bounding_box"]
    sizes = " × ".join(f"{b - a:.2f}" for a, b in zip(low, high, strict=True))
    entries = [
        Entry("file", summary["file"]),
        Entry("size", f"{sizes} mm"),
        Entry("volume", f"{summary['volume']:.1f} mm³"),
        Entry("floating islands removed", str(len(summary["islands"]))),
        Entry("triangles left out", f"{summary['decimated']}, {summary['moved']:.2g} mm off at most"),
    ]
    if shape:
        distance = f"{shape['hausdorff_mm']:.2g} mm at most, {shape['rms_distance_mm']:.2g} mm root mean square"
        entries.append(Entry("distance of the surface to the filtered field's zero set", distance))
    return entries


def settings(case: Case) -> Iterator[tuple[str, list[tuple[str, str, str]]]]:
    """Sections of a resolved case: keys with value and description."""
    for section in type(case).model_fields:
        values = getattr(case, section)
        if isinstance(values, BaseModel):
            yield (
                section,
                [
                    (key, formatted(getattr(values, key)), field.description or "")
                    for key, field in type(values).model_fields.items()
                ],
            )


def leaves(found: Any, name: str = "") -> Iterator[Entry]:
    """All values of a nested summary by dotted names; long lists by their length."""
    if isinstance(found, Mapping):
        for key, value in found.items():
            yield from leaves(value, f"{name}.{key}" if name else str(key))
    elif isinstance(found, list | tuple) and (len(found) > 6 or any(isinstance(each, Mapping) for each in found)):
        yield Entry(name, f"{len(found)} entries")
    elif isinstance(found, list | tuple):
        yield Entry(name, ", ".join(formatted(each) for each in found))
    else:
        yield Entry(name, formatted(found))

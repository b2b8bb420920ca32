"""The sheet for the test rig: what to build around a part, and what it should do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import stages.rig
from pipeline.exit_codes import Fault
from pipeline.runs.adopted import is_solid
from pipeline.runs.job import Job
from pipeline.runs.plan import status
from pipeline.store import atomic, contents
from stages.domains import DomainSettings


def write(job: Job, path: Path) -> dict[str, Any]:
    """Write the sheet of a job whose case says what it is printed of; returns what it says.

    Raises:
        OSError: if the folder or the disk does not take it.
    """
    case = job.case
    assert case.rig.youngs_modulus is not None
    printed = _as_printed(job)
    elongation, scale = printed if printed else (_elongation(job), case.export.scale)
    modulus = case.rig.youngs_modulus
    sheet = stages.rig.run(case.optimize, scale, modulus, case.rig, elongation, as_printed=bool(printed))
    atomic.write_bytes(path, as_markdown(case.name, sheet, case.rig, case.domain).encode())
    found = asdict(sheet)
    found |= found.pop("lengths")
    return {key: None if value == math.inf else value for key, value in found.items()}


def as_markdown(name: str, sheet: stages.rig.Result, spring: stages.rig.Settings, domain: DomainSettings) -> str:
    """The sheet as a table."""
    # A field's description begins with its symbol: "R, domain radius [mm]".
    symbols = {key: str(type(domain).model_fields[key].description).partition(",")[0] for key in sheet.lengths}
    plate = f"{spring.spring_thickness:g} mm thick, {spring.spring_width:g} mm wide, {spring.spring_modulus:g} N/mm²"
    length = f"{sheet.spring_length:.1f} mm"
    spring_there = f"{sheet.spring_stiffness:.4g} N/mm" if sheet.spring_stiffness else "none"
    travel = "not known" if sheet.spring_travel is None else f"{sheet.spring_travel:.2f} mm, {_of(sheet.as_printed)}"
    rows = [
        ("size of the part over size of the domain", f"{sheet.scale:g}"),
        ("initial Young's modulus of the print", f"{sheet.youngs_modulus:g} N/mm²"),
        *((f"{key} {symbols[key]}", f"{value:g} mm") for key, value in sheet.lengths.items()),
        ("arm L_arm, from the glued face", f"{sheet.arm_length:g} mm"),
        ("pressure p_in", f"{sheet.pressure:.3g} kPa"),
        ("spring at the arm's end, whole actuator", spring_there),
        *([(f"free length of a cantilever of {plate}", length)] if sheet.spring_stiffness else []),
        ("predicted travel of the arm's end at p_in", travel),
    ]
    lines = [f"# {name}: rig", "", "| | |", "|---|---|", *(f"| {what} | {value} |" for what, value in rows)]
    return "\n".join(lines) + "\n"


def lines(rig: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What a user reads of the sheet at the end of a run."""
    lines = [("rig", f"p_in {rig['pressure']:.3g} kPa, arm {rig['arm_length']:g} mm")]
    if rig["spring_length"] is None:
        lines.append(("", "no spring"))
    else:
        lines.append(("", f"spring {rig['spring_stiffness']:.4g} N/mm, a cantilever of {rig['spring_length']:.1f} mm"))
    if rig["spring_travel"] is not None:
        travel = f"{rig['spring_travel']:.2f} mm, {_of(rig['as_printed'])}"
        lines.append(("", f"predicted travel of the arm's end {travel}"))
    return lines


def _of(as_printed: bool) -> str:
    return "as printed" if as_printed else "of the optimised density field"


def _as_printed(job: Job) -> tuple[float | None, float] | None:
    """Elongation of the spring, mm, and size of the part over that of the domain, as the part was inflated.

    No elongation where that was at another pressure than the case's; None for a case's own part then, and where it was
    not inflated or is not up to date.
    """
    try:
        step = next((step for step in status(job) if step.stage == "inflate" and not step.runs), None)
        if step is None or step.header is None:
            return None
        found = contents.summary(step.path, step.stage)
    except Fault:  # what is wrong with an artifact is for the stages to say
        return None
    at = found["at_target"]
    foreign = is_solid(job.argument)
    if at is None or step.header.case_resolved["inflate"]["pressure"] is not None:
        return (None, found["scale"]) if foreign else None
    # Of a case's own part the size is what the case says, to all digits.
    return at["elongation"], found["scale"] if foreign else job.case.export.scale


def _elongation(job: Job) -> float | None:
    """Elongation of the spring in the optimised case, mm; None where its artifact is not at hand."""
    if is_solid(job.argument):
        return None
    try:
        found = contents.summary(job.artifact("optimize"), "optimize")
    except Fault:
        return None
    return float(found["spring_elongation"])

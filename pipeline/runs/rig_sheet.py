"""The sheet for the test rig: what to build around a part, and what it should do."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import stages.rig
from pipeline.exit_codes import Fault
from pipeline.runs.adopted import is_solid
from pipeline.runs.job import Job, make_job
from pipeline.runs.plan import status
from pipeline.store import atomic, contents
from stages.chain import PART, SCALE, STAGES, renaming
from stages.rig import RigUnits

#: The line of a sheet that says what it was told, for the other commands.
_TOLD = re.compile(r"^<!-- poro: (\{.*\}) -->$", re.MULTILINE)


def stated(job: Job) -> float | None:
    """Ē of the print, N/mm²: what the command line says, else the last sheet of the part, else the case; None if none.

    A sheet counts for as long as the case says what it said then.
    """
    own = job.own.rig.youngs_modulus
    if "rig.youngs_modulus" in job.changes:
        return job.case.rig.youngs_modulus
    told = read(_path(job))
    return told["youngs_modulus"] if told and told["case"] == own else own


def part_units(job: Job, inflated: Mapping[str, Any] | None = None) -> RigUnits:
    """The units of a job's part, which its sheet, its summary, its figures and its report tell of.

    Args:
        job: the case, and what the command line says.
        inflated: summary of ``inflate``, if there is one: it knows the size of a solid that poro did not export.
    """
    modulus = stated(job) or job.case.material.youngs_modulus
    scale = inflated["scale"] if inflated and is_solid(job.argument) else job.case.export.scale
    return RigUnits(job.case.optimize, scale, modulus)


def as_told(job: Job) -> Job:
    """The job with the part and the print that the newest sheet of the case is of, where the command says nothing."""
    own = _path(job)
    sheets = [path for path in own.parent.glob(f"*{own.suffix}") if job.files.owns(path.name) and read(path)]
    newest = max(sheets, key=lambda path: path.stat().st_mtime_ns, default=own)
    if newest != own and not renaming().keys() & job.changes.keys() and not is_solid(job.argument):
        changes = {**job.changes, SCALE.dotted: read(newest)["scale"]}
        job = make_job(job.argument, job.own, job.case_text, job.files.folder, job.given, changes)
    rig = job.case.rig.model_copy(update={"youngs_modulus": stated(job)})
    return replace(job, case=job.case.model_copy(update={"rig": rig}))


def read(path: Path) -> dict[str, Any]:
    """What a sheet was told: ``scale``, ``youngs_modulus`` and ``case``, Ē of the case; nothing if there is none."""
    try:
        found = _TOLD.search(path.read_text(encoding="utf-8"))
        told: dict[str, Any] = json.loads(found[1]) if found else {}
    except (OSError, ValueError):
        return {}
    return told


def write(job: Job, path: Path) -> dict[str, Any] | None:
    """Write the sheet of a job of which is known what it is printed of; returns what it says.

    Raises:
        OSError: if the folder or the disk does not take it.
    """
    case, modulus = job.case, stated(job)
    if modulus is None:
        return None
    printed = _as_printed(job)
    elongation, scale = printed if printed else (_elongation(job), case.export.scale)
    sheet = stages.rig.run(case.optimize, scale, modulus, case.rig, elongation, as_printed=bool(printed))
    told = {"scale": scale, "youngs_modulus": modulus, "case": job.own.rig.youngs_modulus}
    rig = RigUnits(case.optimize, scale, modulus)
    text = f"{as_markdown(case.name, sheet, case.rig, rig)}\n<!-- poro: {json.dumps(told)} -->\n"
    atomic.write_bytes(path, text.encode())
    found = asdict(sheet)
    found |= found.pop("lengths")
    return {key: None if value == math.inf else value for key, value in found.items()}


def _path(job: Job) -> Path:
    """The sheet of the job's part."""
    beside = next(beside for beside in STAGES[PART].beside if beside.writer == "rig")
    return job.files.beside(PART, beside)


def as_markdown(name: str, sheet: stages.rig.Result, spring: stages.rig.Settings, rig: RigUnits) -> str:
    """The sheet as a table; ``rig`` are its units."""
    domain = rig.problem.domain
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
        *((f"deflection of the spring by {weight} g", f"{bent:.2f} mm") for weight, bent in sheet.calibration.items()),
        ("predicted travel of the arm's end at p_in", travel),
    ]
    if not rig.same:
        moved = "" if sheet.spring_travel is None else f", {sheet.spring_travel / sheet.scale:.2f} mm"
        own = rig.problem.parameters()[1].pressure
        rows.append(("pressure and travel in size and modulus of the case", f"{1e3 * own:.3g} kPa{moved}"))
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

"""``poro report``: everything there is about a case in one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import hashlib
import json
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from actuator.failure import Failure
from pipeline.exit_codes import ExitCode, Fault
from pipeline.figures import designs
from pipeline.figures.designs import DesignFigure
from pipeline.figures.inflation import inflation as inflation_figure
from pipeline.figures.offscreen import CannotDraw
from pipeline.figures.saving import encoded
from pipeline.parts.checking import examine
from pipeline.report import printed as report_printed
from pipeline.report import response as report_response
from pipeline.report import rows as report_rows
from pipeline.report.view3d import DisplayedPart, displayed, displayed_inflated
from pipeline.results import paper
from pipeline.results.design import OptimisedDesign, read_design
from pipeline.results.inflation import Inflated, Inflation, read_inflation, read_states
from pipeline.results.simulation import Simulation, read_simulation, rig_units
from pipeline.results.wording import duration
from pipeline.runs.checkpoint import farthest
from pipeline.runs.job import Job
from pipeline.runs.plan import status
from pipeline.store import artifact, contents
from pipeline.store.artifact import Header
from pipeline.store.atomic import write_text
from pipeline.store.files import detail_of, folder_of
from stages.chain import GOAL, STAGES, path_to
from stages.rig import RigUnits

WEB = resources.files("pipeline.report") / "web"
MEDIA = {"png": "image/png", "svg": "image/svg+xml"}


@dataclass(frozen=True)
class DrawnFigure:
    """A figure as the address that holds it, or the reason why there is none."""

    name: str
    figure: DesignFigure
    address: str = ""
    problem: str = ""


@dataclass(frozen=True)
class StageRow:
    """A stage and its artifact, if there is one.

    Attributes:
        stage: its name.
        path: of the artifact.
        state: ``up to date``, ``given``, ``stale`` or ``missing``.
        reasons: why it is stale; empty if it is not.
        header, summary: of the artifact; None and empty if it is missing.
    """

    stage: str
    path: Path
    state: str
    reasons: str
    header: Header | None
    summary: dict[str, Any]


@dataclass
class Missing:
    """What the report lacks, and the command that gives it."""

    what: str
    command: str


@dataclass
class Findings:
    """What ``poro check`` found, where that is from, and along which direction the part is built."""

    origin: str
    direction: str
    summary: str
    rows: list[tuple[str, str, str]]


@dataclass
class Gathered:
    """All the files of a case beside its optimised design, as far as they are there."""

    design: OptimisedDesign
    header: Header
    stages: list[StageRow]
    rig: RigUnits
    part: Path | None = None
    findings: Findings | None = None
    simulation: Simulation | None = None
    inflation: Inflation | None = None
    inflated: Inflated | None = None
    inflation_figure: str = ""
    measured: list[report_rows.Entry] = field(default_factory=list)
    comparison: list[report_rows.Entry] = field(default_factory=list)
    comparison_figure: str = ""
    missing: list[Missing] = field(default_factory=list)

    @property
    def stale(self) -> list[StageRow]:
        """The stages whose artifacts do not fit the case, or what they were made from, any more."""
        return [row for row in self.stages if row.reasons]

    def summary(self, stage: str) -> dict[str, Any]:
        """A stage's summary; empty if it was not run."""
        return next((row.summary for row in self.stages if row.stage == stage), {})


def write_report(job: Job, folder: Path, *, check: bool = True) -> tuple[Path, str, list[str]]:
    """Write NAME.report.html.

    Args:
        job: the case; what lies beside its optimised design is reported too.
        folder: where the report goes.
        check: whether to make the checks of ``poro check`` where no stored ones fit the part.

    Returns:
        The report, what is to be said of a design that is unfinished, and a sentence for each figure that could not be
        drawn.

    Raises:
        Fault: if there is neither a readable artifact of ``optimize`` nor a checkpoint, or another file is unreadable
            (ARTIFACT).
        OSError: if the folder or the disk does not take the report.
    """
    found = _gather(job, check)
    model: DisplayedPart | None = None
    problems = []
    try:
        model = displayed_inflated(found.inflated) if found.inflated else displayed(found.design)
    except Failure as failure:
        problems.append(f"3D view: {failure}")
    figures = list(_figures(found.design))
    problems += [f"{drawn.figure.title}: {drawn.problem}" for drawn in figures if drawn.problem]
    path = folder / f"{found.design.name}.report.html"
    write_text(path, _page(found, figures, model, problems))
    return path, found.design.label, problems


# ------------------------------------------------------------------------------------------------ what there is


def _gather(job: Job, check: bool) -> Gathered:
    path = farthest(job)
    design = read_design(path)
    # The part that is told of, and what it is printed of.
    case = design.case.model_copy(update={"rig": job.case.rig, "export": job.case.export})
    found = Gathered(replace(design, case=case), artifact.read_header(path), list(_stages(job)), rig_units(case))
    if design.unfinished:  # whatever lies beside it was made of another design
        found.stages = [replace(row, summary={}) for row in found.stages]
        source = f"{job.case.name}.yaml" if job.argument == path else job.argument
        found.missing.append(Missing("the end of the optimisation", _command("optimize", source)))
        return found
    _find_part(job, found, check)
    if found.design.simulation:
        found.simulation = read_simulation(found.design.simulation)
    else:
        found.missing.append(Missing("pressure–displacement curve", _command("simulate", path)))
    _find_inflation(job, found)
    _find_comparison(path, found)
    return found


def _stages(job: Job) -> Iterator[StageRow]:
    """The stages and their artifacts, in order."""
    last = job.given is not None and job.given.stage == GOAL
    steps = {step.stage: step for step in status(replace(job, given=None) if last else job)}
    for stage in STAGES:
        path, step = job.artifact(stage), steps.get(stage)
        if not path.is_file() and stage not in path_to(GOAL):
            continue
        if not path.is_file():
            yield StageRow(stage, path, "missing", "", None, {})
            continue
        reasons = "; ".join(step.reasons) if step else ""
        state = "stale" if reasons else "given" if step is None or step.given else "up to date"
        yield StageRow(stage, path, state, reasons, artifact.read_header(path), contents.summary(path, stage))


def _find_part(job: Job, found: Gathered, check: bool) -> None:
    optimised, record = job.artifact("optimize"), job.artifact("export")
    summary = found.summary("export")
    if not summary:
        found.missing.append(Missing("the part to print, and its checks", _command("export", optimised)))
        return
    part = folder_of(record) / Path(summary["file"]).name
    if not part.is_file():
        found.missing.append(Missing(f"{part.name}, which is gone", _command("export", optimised, "--force")))
        return
    found.part = part
    stored = detail_of(part, f"{part.name}.check.json")
    if stored.is_file():
        findings = _read_json(stored)
        if findings.get("sha256") == hashlib.sha256(part.read_bytes()).hexdigest():
            found.findings = _findings(stored, findings)
            return
    if check:
        report = examine(part, {})
        rows = [(finding.name.value, str(finding.verdict), finding.text) for finding in report.result.findings]
        origin = "made for this report with the default settings"
        found.findings = Findings(origin, report.settings.direction, report.result.summary, rows)
    else:
        found.missing.append(Missing("the checks for printing", _command("check", part)))


def _findings(stored: Path, found: dict[str, Any]) -> Findings:
    """Stored findings of ``poro check``."""
    try:
        rows = [(str(each["name"]), str(each["verdict"]), str(each["text"])) for each in found["findings"]]
        direction, summary = str(found["settings"]["direction"]), str(found["summary"])
    except (LookupError, TypeError) as error:
        raise _foreign(stored) from error
    return Findings(f"from {stored.name}", direction, summary, rows)


def _foreign(path: Path) -> Fault:
    return Fault(ExitCode.ARTIFACT, f"{path}: holds no report of poro; delete it and make it again.")


def _find_inflation(job: Job, found: Gathered) -> None:
    """What the part does under pressure, whatever it is that the artifact is of: whether it is stale is said above."""
    row = next((row for row in found.stages if row.stage == "inflate" and row.header), None)
    if row:
        found.inflation, found.inflated = read_inflation(row.path), read_states(row.path)
        figure = inflation_figure(found.inflation, found.simulation, found.rig, found.inflation.name)
        found.inflation_figure = _address("svg", encoded(figure, "svg", "inflation"))
    elif found.summary("export").get("holds_air"):
        found.missing.append(Missing("what the part does under pressure", _command("inflate", found.part or job.part)))


def _find_comparison(optimised: Path, found: Gathered) -> None:
    """What ``poro compare`` left among its details: NAME.compare.json and its figure."""
    stored = detail_of(optimised, f"{found.design.name}.compare.json")
    if stored.is_file():
        values = _read_json(stored)
        try:
            found.measured = report_response.measured(values)
        except (KeyError, TypeError):
            sentence = f"{stored}: this is not what `poro compare` of this version writes; run it again."
            raise Fault(ExitCode.ARTIFACT, sentence) from None
        found.comparison = list(report_rows.leaves(values))
    else:
        found.missing.append(Missing("comparison with a measurement", _command("compare", optimised, "MEASURED.csv")))
    for format in ("svg", "png"):
        figure = stored.with_suffix(f".{format}")
        if figure.is_file():
            found.comparison_figure = _address(format, figure.read_bytes())
            break


def _command(*words: object) -> str:
    return shlex.join(["poro", *map(str, words)])


def _read_json(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise Fault(ExitCode.ARTIFACT, f"{path}: cannot be read ({error}); delete it and make it again.") from None
    if not isinstance(found, dict):
        raise _foreign(path)
    return found


# ------------------------------------------------------------------------------------------------ the page


def _figures(design: OptimisedDesign) -> Iterator[DrawnFigure]:
    for name, figure in designs.figures_of(design).items():
        try:
            yield DrawnFigure(name, figure, _address(*designs.drawn(design, name, figure.report_format)))
        except (Failure, CannotDraw) as failure:
            yield DrawnFigure(name, figure, problem=str(failure))


def _address(format: str, data: bytes) -> str:
    """An image as the address that holds it."""
    return f"data:{MEDIA[format]};base64,{base64.b64encode(data).decode()}"


def _page(found: Gathered, figures: list[DrawnFigure], model: DisplayedPart | None, problems: list[str]) -> str:
    design, rig = found.design, found.rig
    reference = paper.reference_of(design.case)
    scripts = ["three.js", "report.js"] if model else []
    exported, printed = found.summary("export"), found.inflation.summary if found.inflation else None
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_web("report.html")).render(
        found=found,
        rig=rig,
        design=design,
        case=design.case,
        header=found.header,
        opening=report_rows.opening(design, reference, rig),
        performance=report_rows.performance(design, reference, rig),
        reference=reference,
        same_mesh=paper.on_the_papers_mesh(design.case.domain),
        citation=paper.CITATION,
        constraints=report_rows.constraints(design.summary),
        work=report_rows.work(design.summary),
        memory=max((row.summary.get("peak_memory") or 0 for row in found.stages), default=0),
        part=report_rows.part(exported, found.summary("mirror")) if exported else [],
        checks=exported.get("checks", {}),
        settings=list(report_rows.settings(design.case)),
        verdict=report_printed.verdict(exported, printed, rig),
        printed=report_printed.entries(printed, rig) if printed else [],
        worst=report_printed.worst(printed) if printed else [],
        simulated=report_response.simulated(found.simulation.summary, rig) if found.simulation else [],
        simulation_values=list(report_rows.leaves(found.simulation.summary)) if found.simulation else [],
        duration=duration,
        figures=figures,
        problems=problems,
        model=model,
        still=_address("png", model.still()) if model else "",
        version=artifact.program_version(),
        date=datetime.now(UTC).isoformat(timespec="minutes"),
        style=Markup(_web("report.css")),
        scripts=[Markup(_web(name)) for name in scripts],
        policy=_policy(_web("report.css"), [_web(name) for name in scripts]),
    )


def _policy(style: str, scripts: list[str]) -> str:
    """Nothing from elsewhere, and of what the page holds only the program's own style and scripts."""
    hashes = " ".join(map(_hash, scripts)) or "'none'"
    return (
        f"default-src 'none'; img-src data:; style-src {_hash(style)}; script-src {hashes}; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _web(name: str) -> str:
    return (WEB / name).read_text(encoding="utf-8")

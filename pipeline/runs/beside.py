"""What is written beside an artifact for people and other programs; the table of stages says beside which.

A writer of another program is one more entry of :data:`WRITERS`, by the name that a row of the table gives it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator.registry import Registry
from pipeline.runs import rig_sheet
from pipeline.runs.adopted import is_solid
from pipeline.runs.job import Job
from pipeline.runs.plan import Step
from pipeline.runs.progress import Reporter
from pipeline.store import atomic, contents, tables
from stages.chain import STAGES

if TYPE_CHECKING:
    from pipeline.results.inflation import Inflation

Said = dict[str, Any]


@dataclass(frozen=True)
class Writer:
    """How a file beside an artifact is written.

    Attributes:
        write: given the job, the step and the path; returns what is said of it at the end, or None if the file is not
            wanted.
        lines: of that, what a user reads: names and values.
        figure: what is drawn, if it is a figure: one that fails is no reason to fail.
    """

    write: Callable[[Job, Step, Path], Said | None]
    lines: Callable[[Said], list[tuple[str, str]]] = field(default=lambda said: [])
    figure: str = ""


def write_all(job: Job, step: Step, reporter: Reporter) -> tuple[list[Path], dict[str, Said]]:
    """Write all files beside the artifact of a step.

    Returns:
        The files that are there now, and what the writers say, by their names, where they say anything.

    Raises:
        Fault: if an artifact is not readable (ARTIFACT).
        OSError: if the folder or the disk does not take a file.
    """
    files: list[Path] = []
    said: dict[str, Said] = {}
    for beside in STAGES[step.stage].beside:
        path, writer = job.files.beside(step.stage, beside), WRITERS[beside.writer]
        try:
            found = writer.write(job, step, path)
        except Exception as error:
            if not writer.figure:
                raise
            reporter.say(f"no {writer.figure}: {error}")
            reporter.log.warning("drawing failed", exc_info=True)
            continue
        if found is not None:
            files.append(path)
        if found:
            said[beside.writer] = found
    return files, said


def lines(said: Mapping[str, Said]) -> list[tuple[str, str]]:
    """What a user reads of what the writers say: names and values."""
    return [line for name, found in said.items() for line in WRITERS[name].lines(found)]


def _part_figure(job: Job, step: Step, path: Path) -> Said:
    if step.runs or not path.exists():
        from pipeline.figures import part as figures  # loads drawing libraries; if they fail, the part is still there

        figures.draw_part(job.files.exported, path)
    return {}


def _rig(job: Job, step: Step, path: Path) -> Said | None:
    return rig_sheet.write(job, path)


def _curves(job: Job, step: Step, path: Path) -> Said:
    from pipeline.results.simulation import as_csv, read_simulation

    atomic.write_bytes(path, as_csv(read_simulation(step.path), rig_sheet.part_units(job)).encode())
    return {}


def _curves_figure(job: Job, step: Step, path: Path) -> Said:
    # Loads a drawing library; if it fails, the curves are still there.
    from pipeline.figures.response import response
    from pipeline.figures.saving import save
    from pipeline.results.simulation import read_simulation

    save(response(read_simulation(step.path), rig_sheet.part_units(job), job.case.name), path)
    return {}


def _inflated(job: Job, step: Step) -> Inflation:
    """The inflation in an artifact, in the units of the job's part."""
    from pipeline.results.inflation import read_inflation

    found = read_inflation(step.path)
    return replace(found, rig=rig_sheet.part_units(job, found.summary))


def _inflation(job: Job, step: Step, path: Path) -> Said:
    from pipeline.results.inflation import as_csv

    atomic.write_bytes(path, as_csv(_inflated(job, step)).encode())
    return {}


def _inflation_figure(job: Job, step: Step, path: Path) -> Said:
    # As _curves_figure.
    from pipeline.figures.inflation import inflation
    from pipeline.figures.saving import save
    from pipeline.results.simulation import is_current, read_simulation

    simulated, adopted = job.artifact("simulate"), is_solid(job.argument)
    beside = read_simulation(simulated) if not adopted and is_current(simulated) else None
    found = _inflated(job, step)
    save(inflation(found, beside, found.rig, found.name), path)
    return {}


def _inflated_figure(job: Job, step: Step, path: Path) -> Said | None:
    if step.runs or not path.exists():
        from pipeline.figures.inflated import inflated
        from pipeline.figures.saving import save
        from pipeline.results.inflation import part_name, read_states

        states = read_states(step.path)
        if states is None:  # interrupted before the first
            return None
        scale = contents.summary(step.path, "inflate")["scale"]
        save(inflated(states.scaled(scale), part_name(step.path)), path)
    return {}


def _finish(job: Job, step: Step, path: Path) -> Said | None:
    from stages.finish import HISTORY

    if contents.summary(step.path, "finish")["method"] is None:
        return None
    history = contents.Stored(step.path, "finish").read_group("history")
    rows = zip(*(history[name].tolist() for name in HISTORY), strict=True)
    heading = [f"{name} [{unit}]" for name, unit in HISTORY.items()]
    atomic.write_bytes(path, tables.as_csv(heading, ([f"{value:.10g}" for value in row] for row in rows)).encode())
    return {}


def _finish_figure(job: Job, step: Step, path: Path) -> Said | None:
    # As _curves_figure.
    from pipeline.figures.finish import finish
    from pipeline.figures.saving import save

    found = contents.summary(step.path, "finish")
    if found["method"] is None:
        return None
    history = contents.Stored(step.path, "finish").read_group("history")
    save(finish(history, found["chosen"], rig_sheet.part_units(job), job.case.name), path)
    return {}


WRITERS: Registry[Writer] = Registry("writer of a file beside an artifact")
WRITERS.register("part-figure", Writer(_part_figure, figure="figure of the part"))
WRITERS.register("rig", Writer(_rig, rig_sheet.lines))
WRITERS.register("curves", Writer(_curves))
WRITERS.register("curves-figure", Writer(_curves_figure, figure="figure of the curves"))
WRITERS.register("finish", Writer(_finish))
WRITERS.register("finish-figure", Writer(_finish_figure, figure="figure of the finish"))
WRITERS.register("inflation", Writer(_inflation))
WRITERS.register("inflation-figure", Writer(_inflation_figure, figure="figure of the inflation"))
WRITERS.register("inflated-figure", Writer(_inflated_figure, figure="figure of the inflated part"))

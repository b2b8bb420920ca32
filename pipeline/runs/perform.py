"""What the commands of the program that run stages do, without the parsing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.case.remarks import remarks
from pipeline.exit_codes import ExitCode, Fault, unexpected
from pipeline.results import summary
from pipeline.results.json_output import result_json
from pipeline.results.summary import Summaries
from pipeline.runs import beside, memory
from pipeline.runs.adopted import identity, refuse_other
from pipeline.runs.checkpoint import farthest
from pipeline.runs.claim import claimed
from pipeline.runs.earlier import another_problem, set_aside
from pipeline.runs.execution import Execution, Unfit
from pipeline.runs.job import Job, open_job, open_shown
from pipeline.runs.plan import Step, instability, plan, status
from pipeline.runs.progress import Reporter, reporting
from pipeline.runs.rig_sheet import as_told, part_units
from pipeline.store.artifact import program_version
from pipeline.store.files import make_folder
from pipeline.terminal import told
from stages.chain import GOAL, STAGES, path_to

__all__ = ["make_folder", "open_job", "open_shown", "perform", "plan", "plot", "refuse_other", "status"]


def perform(job: Job, steps: list[Step], *, command: str, fresh: bool, as_json: bool) -> tuple[str, Fault | None]:
    """Run the steps, and write what belongs beside their artifacts.

    Returns:
        The summary, as text or as JSON, and what is wrong with what it says: a part that cannot be inflated
        (BAD_SOLID), a last result that the user interrupted (INTERRUPTED) or that could not be computed to its end
        (NOT_CONVERGED), or a state that is not stable (UNSTABLE).

    Raises:
        Fault: with the code and sentence for what went wrong.
        OSError: if the folder or the disk does not take a file.
        MemoryError: if the mesh is too large.
        KeyboardInterrupt: if the user interrupts a stage other than the optimisation.
    """
    warnings = remarks(job.case)
    memory.refuse_too_large(job, [step.stage for step in steps if step.runs])
    make_folder(job.files.details)
    with claimed(job.files), _reporting(job, steps, warnings) as reporter:
        execution = Execution(job, reporter, fresh)
        written: dict[str, list[Path]] = {}
        said: dict[str, dict[str, beside.Said]] = {}
        done: list[Step] = []
        fault: Fault | None = None
        try:
            for step in steps:
                execution.run(step)
                done.append(step)
                if not step.given:
                    written[step.stage], said[step.stage] = beside.write_all(job, step, reporter)
        except Unfit as unfit:
            # What was made before stays, and is told.
            reporter.log.error(str(unfit))
            if not execution.summaries:
                raise
            fault = unfit
        except (Fault, OSError, MemoryError, KeyboardInterrupt) as error:
            reporter.log.error(str(error) or type(error).__name__)
            raise
        except Exception as error:
            reporter.log.exception("unexpected error")
            raise unexpected(error, job.files.log) from error
    name, summaries = job.case.name, execution.summaries
    rig = part_units(job, summaries.get("inflate"))
    fault = fault or _shortfall(done[-1], summaries[done[-1].stage]) or _instability(command, done, summaries)
    # Of a single stage's command nobody wants to read again of those before, unless they have just run.
    wanted = [step.stage for step in done if as_json or command == "run" or step.runs or step is done[-1]]
    results = [_result(job, step) for step in done if step.stage in wanted and not step.given]
    files = list(dict.fromkeys([*results, *(file for stage in wanted for file in written.get(stage, ()))]))
    found = {key: value for stage in wanted for key, value in said.get(stage, {}).items()}
    if as_json:
        told_of = {"warnings": warnings} | summary.as_json(name, summaries, rig, found)
        return result_json(command, told_of, files), fault
    shown = {stage: summaries[stage] for stage in wanted if stage in summaries}
    text = summary.as_text(name, shown, rig, beside.lines(found), files, _design(job, summaries, wanted))
    return told(text, files), fault


def _design(job: Job, summaries: Mapping[str, Any], wanted: list[str]) -> str:
    """Where the design is told, if it is none of what is told; empty if there is none or it is."""
    first = path_to(GOAL)[0]
    return f"{job.artifact(first)}, told by `poro {first}`" if first in summaries and first not in wanted else ""


@contextmanager
def _reporting(job: Job, steps: list[Step], warnings: list[str]) -> Iterator[Reporter]:
    """Report on the steps, once what they must not replace is out of their way."""
    _refuse_changed(steps)
    differences = another_problem(job, steps)
    kept = set_aside(job, differences) if differences else ""
    with reporting(job.files.log) as reporter:
        reporter.log.info("poro %s: %s", program_version(), job.argument)
        if kept:
            reporter.say(kept)
        for sentence in warnings:
            reporter.say(f"warning: {sentence}")
        if (scale := job.case.export.scale) != 1.0 and any(STAGES[step.stage].after and step.runs for step in steps):
            reporter.say(f"On the way lengths are in the size of the case; the part is {scale:g} times as large.")
        yield reporter


def _shortfall(step: Step, found: Mapping[str, Any]) -> Fault | None:
    """What the result of a step lacks; None if it is whole."""
    shortfall = STAGES[step.stage].shortfall(found, str(step.path))
    code = ExitCode.NOT_CONVERGED if found.get("finished", True) else ExitCode.INTERRUPTED
    return Fault(code, shortfall) if shortfall else None


def _instability(command: str, done: list[Step], summaries: Summaries) -> Fault | None:
    """What is not stable in the results that a command is about; None if nothing is.

    A stage that only works on such a result, as `poro simulate` does, ends by its own.
    """
    sentence = instability([step for step in done if command in ("run", step.stage)], summaries)
    return Fault(ExitCode.UNSTABLE, sentence) if sentence else None


def plot(job: Job, folder: Path, format: str, only: list[str], *, as_json: bool) -> str:
    """Draw the optimised design of a job as it is, or the farthest state of an unfinished one.

    Returns:
        The names of the files, as text or as JSON.

    Raises:
        Fault: if there is no readable artifact of ``optimize`` (ARTIFACT), the folder cannot be made or a figure that
            was asked for is unknown (USAGE).
        OSError: if the disk does not take a figure.
    """
    from pipeline.figures.designs import plot_design  # loads drawing libraries
    from pipeline.results.design import read_design

    design, case = read_design(farthest(job)), as_told(job).case
    # Figures that show lengths of the part have those that its sheet has.
    design = replace(design, case=design.case.model_copy(update={"rig": case.rig, "export": case.export}))
    make_folder(folder)
    files, problems = plot_design(design, folder, format, only)
    if as_json:
        found = {"name": job.case.name, "unfinished": design.label, "problems": problems}
        return result_json("plot", found, files)
    return told("\n".join([*map(str, files), *filter(None, [design.label]), *problems]), files)


def _refuse_changed(steps: list[Step]) -> None:
    """Refuse a plan that rests on what another process replaced before this one had the case for itself."""
    for step in steps:
        if step.header and (not step.path.exists() or identity(step.path) != step.header.identity):
            sentence = f"{step.path}: was replaced by another process at this moment; run the same command again."
            raise Fault(ExitCode.BUSY, sentence)


def _result(job: Job, step: Step) -> Path:
    """The file that a step is about: the part where it makes one, else its artifact."""
    return job.files.exported if STAGES[step.stage].makes_part else step.path

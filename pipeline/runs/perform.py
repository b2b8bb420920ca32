"""What the commands of the program that run stages do, without the parsing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.exit_codes import ExitCode, Fault, unexpected
from pipeline.results import summary
from pipeline.results.json_output import result_json
from pipeline.runs import beside, memory
from pipeline.runs.adopted import identity, refuse_other
from pipeline.runs.checkpoint import farthest
from pipeline.runs.claim import claimed
from pipeline.runs.execution import Execution, Unfit
from pipeline.runs.job import Job, make_folder, open_job
from pipeline.runs.plan import Step, plan, status
from pipeline.runs.progress import reporting
from pipeline.store.artifact import program_version
from stages.chain import STAGES

__all__ = ["make_folder", "open_job", "perform", "plan", "plot", "refuse_other", "status"]


def perform(job: Job, steps: list[Step], *, command: str, fresh: bool, as_json: bool) -> tuple[str, Fault | None]:
    """Run the steps, and write what belongs beside their artifacts.

    Returns:
        The summary, as text or as JSON, and what is wrong with what it says: a part that cannot be inflated
        (BAD_SOLID), a last result that the user interrupted (INTERRUPTED) or that could not be computed to its end
        (NOT_CONVERGED).

    Raises:
        Fault: with the code and sentence for what went wrong.
        OSError: if the folder or the disk does not take a file.
        MemoryError: if the mesh is too large.
        KeyboardInterrupt: if the user interrupts a stage other than the optimisation.
    """
    memory.refuse_too_large(job, [step.stage for step in steps if step.runs])
    make_folder(job.files.folder)
    with claimed(job.files), reporting(job.files.log) as reporter:
        _refuse_changed(steps)
        reporter.log.info("poro %s: %s", program_version(), job.argument)
        execution = Execution(job, reporter, fresh)
        written: list[Path] = []
        said: dict[str, beside.Said] = {}
        done: list[Step] = []
        fault: Fault | None = None
        try:
            for step in steps:
                execution.run(step)
                done.append(step)
                if not step.given:
                    files, found = beside.write_all(job, step, reporter)
                    written += [file for file in files if file not in written]
                    said |= found
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
    files = [*(_result(job, step) for step in done if not step.given), *written]
    name, summaries = job.case.name, execution.summaries
    fault = fault or _shortfall(done[-1], summaries[done[-1].stage])
    if as_json:
        return result_json(command, summary.as_json(name, summaries, said), files), fault
    return summary.as_text(name, summaries, beside.lines(said), files), fault


def _shortfall(step: Step, found: Mapping[str, Any]) -> Fault | None:
    """What the result of a step lacks; None if it is whole."""
    shortfall = STAGES[step.stage].shortfall(found, str(step.path))
    code = ExitCode.NOT_CONVERGED if found.get("finished", True) else ExitCode.INTERRUPTED
    return Fault(code, shortfall) if shortfall else None


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

    design = read_design(farthest(job))
    make_folder(folder)
    files, problems = plot_design(design, folder, format, only)
    if as_json:
        found = {"name": job.case.name, "unfinished": design.label, "problems": problems}
        return result_json("plot", found, files)
    return "\n".join([*map(str, files), *filter(None, [design.label]), *problems])


def _refuse_changed(steps: list[Step]) -> None:
    """Refuse a plan that rests on what another process replaced before this one had the case for itself."""
    for step in steps:
        if step.header and (not step.path.exists() or identity(step.path) != step.header.identity):
            sentence = f"{step.path}: was replaced by another process at this moment; run the same command again."
            raise Fault(ExitCode.BUSY, sentence)


def _result(job: Job, step: Step) -> Path:
    """The file that a step is about: the part where it makes one, else its artifact."""
    return job.files.exported if STAGES[step.stage].makes_part else step.path

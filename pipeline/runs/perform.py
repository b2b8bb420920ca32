"""What the commands of the program do, without the parsing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipeline.exit_codes import ExitCode, Fault, unexpected
from pipeline.results import rig_sheet, summary
from pipeline.results.json_output import result_json
from pipeline.runs import memory, simulating
from pipeline.runs.claim import claimed
from pipeline.runs.execution import Execution
from pipeline.runs.plan import Step, plan, status
from pipeline.runs.progress import Reporter, reporting
from pipeline.store import artifact
from pipeline.store import job as jobs
from pipeline.store.artifact import program_version
from pipeline.store.job import Job

__all__ = ["make_folder", "open_job", "perform", "plan", "plot", "status", "steps_json", "steps_text"]


def open_job(argument: Path, output: Path | None = None, **changes: Any) -> Job:
    """The job that a command line describes; see :func:`pipeline.store.job.open_job`."""
    return jobs.open_job(argument, output, jobs.Changes(**changes))


def steps_text(steps: list[Step], *, reasons: bool) -> str:
    """A plan, one stage a line."""
    lines = []
    for step in steps:
        word = "given" if step.given else "run" if step.runs else "up to date"
        why = "; ".join(step.reasons) if reasons and step.runs else str(step.path)
        lines.append(f"{step.stage:<10}{word:<12}{why}")
    return "\n".join(lines)


def steps_json(steps: list[Step], command: str) -> str:
    """A plan as JSON; its files are those that are up to date."""
    found = [
        {"stage": step.stage, "runs": step.runs, "given": step.given, "reasons": step.reasons, "path": str(step.path)}
        for step in steps
    ]
    return result_json(command, {"steps": found}, [step.path for step in steps if not step.runs])


def perform(job: Job, steps: list[Step], *, command: str, fresh: bool, as_json: bool) -> str:
    """Run the steps and draw the part if it is one of them; returns the summary, as text or as JSON.

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
        try:
            execution.run(steps)
            if steps[-1].stage == "export" and (steps[-1].runs or not job.files.picture.exists()):
                _draw(job, reporter)
            if steps[-1].stage == "export" and job.case.rig.youngs_modulus is not None:
                execution.rig = rig_sheet.write(job)
            if steps[-1].stage == "simulate":
                simulating.write_curves(job, reporter)
        except (Fault, OSError, MemoryError, KeyboardInterrupt) as error:
            reporter.log.error(str(error) or type(error).__name__)
            raise
        except Exception as error:
            reporter.log.exception("unexpected error")
            raise unexpected(error, job.files.log) from error
    files = [str(path) for path in _files(job, steps) if path.exists()]
    if as_json:
        return result_json(command, summary.as_json(execution), files)
    return summary.as_text(execution, files)


def plot(job: Job, format: str, only: list[str], *, as_json: bool) -> str:
    """Draw the optimised design of a job as it is; returns the names of the files, as text or as JSON.

    Raises:
        Fault: if there is no readable artifact of ``optimize`` (ARTIFACT), the folder cannot be made or a figure that
            was asked for is unknown (USAGE).
        OSError: if the disk does not take a figure.
    """
    from pipeline.figures.designs import plot_design  # loads drawing libraries
    from pipeline.results.design import read_design

    design = read_design(job.artifact("optimize"))
    make_folder(job.files.folder)
    files, problems = plot_design(design, job.files.folder, format, only)
    if as_json:
        return result_json("plot", {"name": job.case.name, "problems": problems}, files)
    return "\n".join([*map(str, files), *problems])


def _refuse_changed(steps: list[Step]) -> None:
    """Refuse a plan that rests on what another process replaced before this one had the case for itself."""
    for step in steps:
        if step.header and (not step.path.exists() or artifact.read_header(step.path).identity != step.header.identity):
            sentence = f"{step.path}: was replaced by another process at this moment; run the same command again."
            raise Fault(ExitCode.BUSY, sentence)


def make_folder(folder: Path) -> None:
    """Make a folder for results, if it is not there.

    Raises:
        Fault: if it cannot be made (USAGE).
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        sentence = f"{folder}: cannot be made a folder for the results ({error.strerror}); choose another --output."
        raise Fault(ExitCode.USAGE, sentence) from None


def _draw(job: Job, reporter: Reporter) -> None:
    """Draw the part; a picture that fails is no reason to fail."""
    try:
        from pipeline.figures import part as figures  # loads drawing libraries; if they fail, the part is still there

        figures.draw_part(job.files.exported, job.files.picture)
    except Exception as error:
        reporter.say(f"no picture of the part: {error}")
        reporter.log.warning("drawing failed", exc_info=True)


def _files(job: Job, steps: list[Step]) -> list[Path]:
    found = [step.path for step in steps if not step.given and step.stage != "export"]
    if steps[-1].stage == "simulate":
        return [*found, job.files.curves, job.files.curves_picture]
    if steps[-1].stage != "export":
        return found
    sheet = [job.files.rig] if job.case.rig.youngs_modulus is not None else []
    return [*found, job.files.exported, job.files.picture, *sheet]

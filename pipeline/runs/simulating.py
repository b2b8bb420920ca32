"""``poro simulate``: what it plans, and the table and the figure it writes beside the artifact."""

from __future__ import annotations

from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.plan import simulation_plan as plan
from pipeline.runs.progress import Reporter
from pipeline.store import atomic, contents
from pipeline.store.job import Job

__all__ = ["plan", "refuse_unfinished", "write_curves"]


def write_curves(job: Job, reporter: Reporter) -> None:
    """Write the curves of a job as CSV and as a figure; a figure that fails is no reason to fail.

    Raises:
        Fault: if the artifact is not readable (ARTIFACT).
        OSError: if the folder or the disk does not take the table.
    """
    from pipeline.results.simulation import as_csv, read_simulation, rig_units

    simulation, rig = read_simulation(job.artifact("simulate")), rig_units(job.case)
    atomic.write_bytes(job.files.curves, as_csv(simulation, rig).encode())
    try:
        # Loads a drawing library; if it fails, the curves are still there.
        from pipeline.figures.response import response
        from pipeline.figures.saving import save

        save(response(simulation, rig), job.files.curves_picture)
    except Exception as error:
        reporter.say(f"no figure of the curves: {error}")
        reporter.log.warning("drawing failed", exc_info=True)


def refuse_unfinished(job: Job) -> None:
    """Do nothing if every path was followed up and down.

    Raises:
        Fault: if the user interrupted (INTERRUPTED), or a path could not be followed (NOT_CONVERGED).
    """
    path = job.artifact("simulate")
    found = contents.summary(path, "simulate")
    if not found["finished"]:
        raise Fault(
            ExitCode.INTERRUPTED,
            f"Interrupted; the curves so far are in {path}, run the same command to compute them to the end.",
        )
    ended = [f"{name}: {entry['ended']}" for name, entry in found["fields"].items() if not entry["complete"]]
    if ended:
        raise Fault(ExitCode.NOT_CONVERGED, f"The curves are in {path} as far as they go. {' '.join(ended)}")

"""Running the steps of a plan: call the stage, store its result."""

from __future__ import annotations

import hashlib
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

import stages.export
import stages.mirror
import stages.optimize
import stages.refine
import stages.simulate
from actuator import failure
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs import checkpoint, updates
from pipeline.runs.interruption import raise_if_asked
from pipeline.runs.plan import Step, stage_version
from pipeline.runs.progress import Reporter
from pipeline.store import artifact, atomic, contents, vtkhdf
from pipeline.store.artifact import Dataset, Header
from pipeline.store.job import Job
from pipeline.store.keys import plain

Summary = dict[str, Any]
Outcome = tuple[Summary, dict[str, Dataset], vtkhdf.GridPaths | None]

_FAILURES = {
    failure.EmptySolid: ExitCode.BAD_SOLID,
    failure.NotManifold: ExitCode.BAD_SOLID,
    failure.LooseBodies: ExitCode.BAD_SOLID,
    failure.UnreadableSolid: ExitCode.BAD_SOLID,
    failure.InvalidField: ExitCode.ARTIFACT,
    failure.InvalidSettings: ExitCode.USAGE,
    failure.OutOfMemory: ExitCode.UNEXPECTED,
}


@dataclass
class Execution:
    """Runs steps of one job, in order.

    Attributes:
        job: the case and its files.
        reporter: is told what happens.
        fresh: whether to ignore what an interrupted optimisation left.
        summaries: of every stage so far, run or found up to date.
        rig: what the sheet for the test rig says, if one was asked for.
    """

    job: Job
    reporter: Reporter
    fresh: bool = False
    summaries: dict[str, Summary] = field(default_factory=dict)
    rig: Summary | None = None
    _identity: str = ""

    def run(self, steps: list[Step]) -> None:
        """Run the steps that have a reason, and read the summaries of the others.

        Raises:
            Fault: if a stage fails; the code says how.
            KeyboardInterrupt: if the user interrupts.
            OSError: if the folder or the disk does not take a file.
        """
        for step in steps:
            if step.runs:
                self._execute(step)
            else:
                word = "given" if step.given else "up to date"
                self.reporter.say(f"{step.stage}: {word} ({step.path})")
                self.summaries[step.stage] = contents.summary(step.path, step.stage)
                self._complete(step)
                assert step.header is not None
                self._identity = step.header.identity

    def _execute(self, step: Step) -> None:
        self.reporter.say(f"{step.stage}: {'; '.join(step.reasons)}")
        start = time.perf_counter()
        stage: Callable[[Step], Outcome] = getattr(self, f"_{step.stage}")
        try:
            summary, datasets, grid = stage(step)
        except failure.Failure as error:
            raise Fault(_FAILURES.get(type(error), ExitCode.NOT_CONVERGED), f"{step.stage}: {error}") from error
        summary |= {"stage_seconds": time.perf_counter() - start, "peak_memory": _peak_memory()}
        header = Header(
            stage=step.stage,
            stage_version=stage_version(step.stage),
            content_key=step.content_key if summary.get("finished", True) else artifact.UNFINISHED,
            identity=uuid4().hex,
            upstream_keys=step.upstream_keys,
            upstream_identity=self._identity,
            case_text=self.job.case_text,
            case_resolved=plain(self.job.recorded(step.stage)),
        )
        artifact.write(step.path, header, datasets | contents.summarised(summary), grid)
        for name in vtkhdf.grids(step.path):
            vtkhdf.write_sidecar(step.path, name)
        if step.stage == "optimize":
            self.job.files.checkpoint.unlink(missing_ok=True)
            updates.clear(self.job)
        self._identity = header.identity
        self.summaries[step.stage] = contents.summary(step.path, step.stage)

    def _complete(self, step: Step) -> None:
        """Do what a run that was killed after it stored an artifact had left to do."""
        if step.given:
            return
        for name in vtkhdf.grids(step.path):
            if not vtkhdf.sidecar(step.path, name).exists():
                vtkhdf.write_sidecar(step.path, name)
        if step.stage == "optimize":
            checkpoint.remove_reached(self.job)

    def _optimize(self, step: Step) -> Outcome:
        case = self.job.case
        start = None
        if not self.fresh:
            start = checkpoint.find(self.job, finished="forced" not in step.reasons)
        keeper, history = checkpoint.Keeper(self.job, start), updates.UpdateKeeper(self.job, start)

        def observe(event: Any) -> None:
            # Stored before it is shown: what the user has seen is not lost.
            history.observe(event)
            keeper.observe(event)
            self.reporter.observe(event)
            raise_if_asked()

        try:
            result = stages.optimize.run(
                case.optimize, compute=case.compute.build(), observer=observe, resume=start.state if start else None
            )
        except KeyboardInterrupt:
            raise Fault(ExitCode.INTERRUPTED, f"Interrupted {_where_to_resume(keeper.last)}.") from None
        self.reporter.say(f"  {result.reason}")
        datasets, grid = contents.of_optimize(result, history.collect(result))
        last = checkpoint.Checkpoint(result.summary["updates"], result.checkpoint)
        return dict(result.summary), datasets | checkpoint.datasets(last), grid

    def _refine(self, step: Step) -> Outcome:
        domain, chi = contents.design(self.job.artifact("optimize"), "optimize")
        result = stages.refine.run(domain, chi, self.job.case.refine, self.reporter.observe)
        return {"cells": result.domain.mesh.nelements}, *contents.of_refine(result)

    def _mirror(self, step: Step) -> Outcome:
        domain, chi = contents.design(self.job.artifact("refine"), "refine")
        result = stages.mirror.run(domain, chi, self.job.case.mirror, self.reporter.observe)
        summary = {
            "triangles": len(result.triangles),
            "hausdorff_mm": result.distance.maximum,
            "rms_distance_mm": result.distance.rms,
        }
        return summary, *contents.of_mirror(result)

    def _export(self, step: Step) -> Outcome:
        settings, part = self.job.case.export, self.job.files.exported
        surface = contents.surface(self.job.artifact("mirror"))
        result = stages.export.run(*surface, settings, self.reporter.observe, self.job.case.name)
        if not result.passed:
            failed = ", ".join(name for name, passed in result.report["checks"].items() if not passed)
            raise Fault(
                ExitCode.BAD_SOLID,
                f"{part}: not written, as the solid fails its checks ({failed}); refine further (refine.factor, "
                "refine.filter_radius) or optimise longer.",
            )
        atomic.write_bytes(part, result.data)
        # Whoever is killed from here on leaves no picture of an older part beside a new one.
        self.job.files.picture.unlink(missing_ok=True)
        found = part.read_bytes()
        inspection = stages.export.inspect(found, settings.format)
        if not (inspection.watertight and inspection.volume > 0.0):
            raise Fault(ExitCode.BAD_SOLID, f"{part}: what was written is not watertight when read back; export again.")
        summary = {
            "file": part.name,
            "sha256": hashlib.sha256(found).hexdigest(),
            "volume": inspection.volume,
            "watertight": inspection.watertight,
            "bounding_box": inspection.bounding_box,
            "manifold": result.report["manifold"],
            "islands": result.report["islands"],
            "decimated": result.report["decimated"],
            "moved": result.report["moved"],
            "checks": result.report["checks"],
        }
        return summary, {}, None

    def _simulate(self, step: Step) -> Outcome:
        case = self.job.case
        result = stages.simulate.run(
            _simulated_design(self.job.artifact("optimize")),
            case.optimize,
            case.simulate,
            refinement=case.refine,
            threshold=case.mirror.threshold,
            compute=case.compute.build(),
            observer=self.reporter.observe,
        )
        return dict(result.summary), *contents.of_simulate(result)


def _simulated_design(path: Path) -> stages.simulate.Design:
    """What the simulation starts from and compares with."""
    names = ("nodes/displacement", "vertices/pressure", "arm")
    return stages.simulate.Design(*contents.design(path, "optimize"), *artifact.read(path, "optimize", *names))


def _peak_memory() -> int | None:
    """Largest memory this process has held so far, bytes; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak) if sys.platform == "darwin" else 1024 * int(peak)


def _where_to_resume(last: checkpoint.Checkpoint | None) -> str:
    if last is None:
        return "before the first design update was stored; run the same command to start again"
    return f"after design update {last.updates}, which is stored; run the same command to continue from there"

"""Running the steps of a plan: call the stage, store its result."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from actuator import failure
from actuator.arrays import Floats, Ints
from pipeline.exit_codes import ExitCode, Fault, code_of
from pipeline.results.wording import byte_size, duration
from pipeline.runs import checkpoint, first_design, resuming
from pipeline.runs.adopted import is_solid
from pipeline.runs.job import Job
from pipeline.runs.keys import plain
from pipeline.runs.plan import Step
from pipeline.runs.progress import Reporter
from pipeline.store import artifact, atomic, contents, vtkhdf
from pipeline.store.artifact import Header
from pipeline.store.solid_file import read_solid
from stages.chain import STAGES, followers, path_to
from stages.datasets import Packed, Product
from stages.task import Task

if TYPE_CHECKING:
    from stages.initial import Given

Summary = dict[str, Any]


class Unfit(Fault):
    """The part is there, but cannot be inflated."""


@dataclass
class Execution:
    """Runs the steps of one job, one after the other.

    Attributes:
        job: the case and its files.
        reporter: is told what happens.
        fresh: whether to ignore what an interrupted optimisation left.
        summaries: of every stage so far, run or found up to date.
    """

    job: Job
    reporter: Reporter
    fresh: bool = False
    summaries: dict[str, Summary] = field(default_factory=dict)
    _identity: str = ""

    def run(self, step: Step) -> None:
        """Run a step if it has a reason, or else read its summary.

        Raises:
            Unfit: if the part cannot be inflated.
            Fault: if the stage fails otherwise; the code says how.
            KeyboardInterrupt: if the user interrupts.
            OSError: if the folder or the disk does not take a file.
        """
        if step.runs:
            self._execute(step)
            return
        word = "given" if step.given else "up to date"
        self.reporter.say(f"{step.stage}: {word} ({step.path})")
        if not is_solid(step.path):
            self.summaries[step.stage] = contents.summary(step.path, step.stage)
        self._complete(step)
        assert step.header is not None
        self._identity = step.header.identity

    def _execute(self, step: Step) -> None:
        self.reporter.say(f"{step.stage}: {'; '.join(step.reasons)}")
        start = time.perf_counter()
        try:
            packed = self._packed(step)
            made = self._write_part(step.stage, packed.product) if packed.product else {}
        except failure.NotInflatable as error:
            raise Unfit(ExitCode.BAD_SOLID, f"{self.job.part}: {error}") from error
        except failure.InvalidRegion as error:
            text = "" if self.job.given else self.job.case_text
            place = first_design.place_of(self.job.argument, text, ("regions", error.number))
            raise Fault(code_of(error), f"{place} {error.sentence}.") from error
        except failure.Failure as error:
            raise Fault(code_of(error), f"{step.stage}: {error}") from error
        row = STAGES[step.stage]
        summary = {**made, **packed.summary, "stage_seconds": time.perf_counter() - start}
        header = Header(
            stage=step.stage,
            stage_version=row.load().VERSION,
            content_key=step.content_key if summary.get("finished", True) else artifact.UNFINISHED,
            identity=uuid4().hex,
            upstream_keys=step.upstream_keys,
            upstream_identity=self._identity,
            case_text=self.job.case_text,
            case_resolved=plain(self.job.recorded(step.stage)),
            replaced=self.job.replaced(step.stage),
        )
        if not packed.product:
            self._clear_beside(step.stage)
        summarised = contents.summarised(summary | {"peak_memory": _peak_memory()})
        artifact.write(step.path, header, {**packed.datasets, **summarised}, packed.grid)
        vtkhdf.write_sidecar(step.path)
        if step.stage == checkpoint.OPTIMIZE:
            resuming.clear(self.job)
        self._identity = header.identity
        self.summaries[step.stage] = contents.summary(step.path, step.stage)
        size, seconds = step.path.stat().st_size, summary["stage_seconds"]
        self.reporter.log.info(
            "%s: %s written, %s, after %s", step.stage, step.path, byte_size(size), duration(seconds)
        )

    def _packed(self, step: Step) -> Packed:
        """Run a stage."""
        job, row = self.job, STAGES[step.stage]
        source = contents.Stored(job.artifact(row.after), row.after) if row.after else None
        task = Task(
            job.case,
            source,
            solid=self._part() if row.takes_part else None,
            optimised=self._optimised(row.after) if row.takes_part else None,
            compute=job.case.compute.build(),
            observer=self.reporter.observe,
            initial=self._initial() if step.stage == checkpoint.OPTIMIZE else None,
            bodies=first_design.read_bodies(job.case) if step.stage == checkpoint.OPTIMIZE else {},
        )
        self.reporter.log.info("%s: %s", step.stage, task.compute)
        if step.stage == checkpoint.OPTIMIZE:
            return resuming.run(job, task, fresh=self.fresh, forced="forced" in step.reasons)
        module = row.load()
        return module.pack(module.start(task))

    def _initial(self) -> Given | None:
        """What the file holds that the case begins with, if it names one."""
        named = self.job.case.initial
        if named.file is None:
            return None
        found, digest = first_design.read(Path(named.file))
        if digest != named.sha256:
            raise first_design.replaced_meanwhile(named.file)
        return found

    def _part(self) -> tuple[Floats, Ints]:
        """The part that was made or given."""
        solid = read_solid(self.job.part, self.job.unit)
        return solid.vertices, solid.triangles

    def _optimised(self, part: str) -> Summary | None:
        """Summary of the optimisation that the part came from; None unless all on the way to it is at hand."""
        *before, last = path_to(part)
        try:
            header = artifact.read_header(self.job.artifact(last))
            for stage in reversed(before):
                above = artifact.read_header(self.job.artifact(stage))
                if above.identity != header.upstream_identity:
                    return None
                header = above
            return contents.summary(self.job.artifact(checkpoint.OPTIMIZE), checkpoint.OPTIMIZE)
        except Fault:
            return None

    def _write_part(self, stage: str, product: Product) -> Summary:
        """Write the file that a stage makes and read it back; returns what belongs into the summary."""
        part = self.job.files.exported
        if product.flaw:
            raise Fault(ExitCode.BAD_SOLID, f"{part}: not written, as {product.flaw}.")
        atomic.write_bytes(part, product.data)
        for each in (stage, *followers(stage)):
            self._clear_beside(each)
        found, flaw = product.inspected(part.read_bytes())
        if flaw:
            raise Fault(ExitCode.BAD_SOLID, f"{part}: what was written {flaw}.")
        return {"file": part.name, **found}

    def _clear_beside(self, stage: str) -> None:
        """Whoever is killed from here on leaves no figure of an older result beside a new one."""
        for beside in STAGES[stage].beside:
            if beside.of_result:
                self.job.files.beside(stage, beside).unlink(missing_ok=True)

    def _complete(self, step: Step) -> None:
        """Do what a run that was killed after it stored an artifact had left to do."""
        if step.given:
            return
        if not vtkhdf.sidecar(step.path).exists():
            vtkhdf.write_sidecar(step.path)
        if step.stage == checkpoint.OPTIMIZE:
            checkpoint.remove_reached(self.job)


def _peak_memory() -> int | None:
    """Largest memory this process has held so far, bytes; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak) if sys.platform == "darwin" else 1024 * int(peak)

"""Running a study: one process per case, some at once, restartable."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

from pipeline.case.writer import case_text
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.wording import count, duration
from pipeline.runs.claim import holder
from pipeline.runs.job import Job, make_job
from pipeline.runs.plan import Step, instability, plan
from pipeline.runs.progress import Reporter
from pipeline.store import atomic, contents
from pipeline.store.files import make_folder
from pipeline.study.study import Study, Variant

#: Seconds that an interrupted case gets to store what it has, and between two looks at the cases.
GRACE, PAUSE = 60.0, 0.1
#: Seconds that are waited for others to leave a case: one of a sweep that was killed stops after a linear solve.
PATIENCE = 10.0
#: Variables by which the numerical libraries are told how many threads they may have.
THREAD_LIMITS = (
    "NUMBA_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@dataclass(frozen=True)
class CaseOutcome:
    """How a case ended.

    Attributes:
        exit_code: of its process.
        sentence: what it said if it failed, else empty.
        case: sha256 of its case file; the outcome of another one says nothing.
    """

    exit_code: int
    sentence: str
    case: str


@dataclass(frozen=True)
class Sweep:
    """A study and where it is worked on.

    Attributes:
        study: the cases.
        output: folder of the tables; the cases' own folders lie in ``NAME.sweep`` inside.
        threads: of every case.
    """

    study: Study
    output: Path
    threads: int = 1

    @property
    def folder(self) -> Path:
        """Folder of the cases' folders."""
        return self.output / f"{self.study.name}.sweep"

    def result(self, ending: str) -> Path:
        """A file of results, such as the table."""
        return self.output / f"{self.study.name}.sweep.{ending}"

    def case_file(self, variant: Variant) -> Path:
        """The case file of a variant, in the folder that holds all of its files."""
        return self.folder / variant.case.name / f"{variant.case.name}.yaml"

    def outcome_file(self, variant: Variant) -> Path:
        """Where it is kept how a variant ended."""
        return self.case_file(variant).with_suffix(".outcome.json")

    def prepare(self, variants: Iterable[Variant]) -> None:
        """Write the case files of variants that are not there as they should be.

        Raises:
            Fault: if a folder cannot be made (USAGE).
            OSError: if the disk does not take a file.
        """
        for variant in variants:
            path = self.case_file(variant)
            make_folder(path.parent)
            head = f"One case of the study {self.study.path.name}, made by `poro sweep`; change it there."
            text = atomic.encoded(case_text(variant.case, head))
            if not path.exists() or path.read_bytes() != text:
                atomic.write_bytes(path, text)

    def chosen(self, names: Iterable[str]) -> tuple[Variant, ...]:
        """The variants of these names; all if there are none.

        Raises:
            Fault: if there is no variant of a name (USAGE).
        """
        wanted = list(names)
        known = {variant.case.name: variant for variant in self.study.variants}
        for name in wanted:
            if name not in known:
                raise Fault(ExitCode.USAGE, f"--only {name}: the study has no such case; see --dry-run for the names.")
        return tuple(known[name] for name in wanted) if wanted else self.study.variants

    def job(self, variant: Variant) -> Job:
        """The job of a variant as open_job would find it, without reading the case file again."""
        path = self.case_file(variant)
        return make_job(path, variant.case, "", path.parent)

    def steps(self, variant: Variant) -> list[Step]:
        """What is to be done for a variant.

        Raises:
            Fault: if an artifact in the way is unreadable (ARTIFACT).
        """
        return plan(self.job(variant), last=self.study.until)

    def complete(self, variant: Variant) -> bool:
        """Whether nothing is missing or stale."""
        try:
            return not any(step.runs for step in self.steps(variant))
        except Fault:  # the case's own process will say so
            return False

    def outcome(self, variant: Variant) -> CaseOutcome | None:
        """How a variant ended last, or who is at it now; None if it has not been run to an end as it is now."""
        if self.complete(variant):
            unstable = instability(self.steps(variant), self.summaries(variant))
            return self.ended(variant, int(ExitCode.UNSTABLE if unstable else ExitCode.OK), unstable)
        if busy := holder(self.job(variant).files):
            return self.ended(variant, int(ExitCode.BUSY), f"{busy} is working on it")
        try:
            found = CaseOutcome(**json.loads(self.outcome_file(variant).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None
        same = found.case == self.ended(variant, 0, "").case
        return found if same and found.exit_code != ExitCode.OK else None

    def ended(self, variant: Variant, exit_code: int, sentence: str) -> CaseOutcome:
        """The outcome of a variant as its case file is now."""
        digest = hashlib.sha256(self.case_file(variant).read_bytes()).hexdigest()
        return CaseOutcome(exit_code, sentence, digest)

    def keep(self, variant: Variant, outcome: CaseOutcome) -> None:
        """Store how a variant ended, unless that is stored already.

        Raises:
            OSError: if the disk does not take it.
        """
        path, text = self.outcome_file(variant), json.dumps(asdict(outcome), indent=2, ensure_ascii=False) + "\n"
        # Snakemake goes by the date: what is older than its case file would be made again.
        written = path.exists() and path.stat().st_mtime >= self.case_file(variant).stat().st_mtime
        if not written or path.read_bytes() != atomic.encoded(text):
            atomic.write_text(path, text)

    def summaries(self, variant: Variant) -> dict[str, dict[str, Any]]:
        """Summaries of the stages of a variant that are up to date."""
        try:
            return {
                step.stage: contents.summary(step.path, step.stage) for step in self.steps(variant) if not step.runs
            }
        except Fault:
            return {}

    def run(self, variants: Iterable[Variant], jobs: int, reporter: Reporter) -> None:
        """Run variants, so many at once; one that fails does not stop the others.

        What another process works on is left until that has ended, and not run if it is the only thing left to do.

        Raises:
            KeyboardInterrupt: once all cases have stored what they have, if the user interrupts.
            OSError: if the disk does not take how a case ended.
        """
        waiting, running = list(variants), list[_Running]()
        total, done = len(waiting), 0
        start = active = time.monotonic()
        try:
            while waiting or running:
                while len(running) < jobs and (variant := self._free(waiting)):
                    waiting.remove(variant)
                    self.outcome_file(variant).unlink(missing_ok=True)
                    running.append(_Running(self, variant))
                now = time.monotonic()
                active = now if running else active
                if now - active > PATIENCE:
                    self._leave(waiting, reporter)
                    return
                time.sleep(PAUSE)
                for case in [case for case in running if case.process.poll() is not None]:
                    running.remove(case)
                    done += 1
                    self._note(case, f"[{done}/{total}]", reporter)
                    left = (time.monotonic() - start) / done * (total - done)
                    reporter.display.progress(done, total, f"about {duration(left)} left")
        except BaseException:
            self._stop(running, reporter)
            raise

    def _free(self, waiting: Iterable[Variant]) -> Variant | None:
        """The first variant that nobody works on."""
        return next((variant for variant in waiting if not holder(self.job(variant).files)), None)

    def _leave(self, waiting: Iterable[Variant], reporter: Reporter) -> None:
        """Say who works on variants."""
        for variant in waiting:
            if outcome := self.outcome(variant):
                reporter.say(f"{variant.case.name}: not run: {outcome.sentence or 'it has just been done elsewhere'}")

    def _note(self, case: _Running, place: str, reporter: Reporter) -> None:
        outcome = self.ended(case.variant, *case.end())
        self.keep(case.variant, outcome)
        ended = "done" if outcome.exit_code == ExitCode.OK else f"exit code {outcome.exit_code}: {outcome.sentence}"
        reporter.say(f"{place} {case.variant.case.name} ({duration(case.seconds)}): {ended}")

    @staticmethod
    def _stop(running: list[_Running], reporter: Reporter) -> None:
        """End the running cases so that they can continue; a second interrupt does not wait for them."""
        if not running:
            return
        for case in running:
            case.tell_to_stop()
        try:
            with contextlib.suppress(OSError):  # whoever has gone need not be told
                reporter.say(f"stopping {count(len(running), 'running case')}; what is stored is kept")
            limit = time.monotonic() + GRACE
            while any(case.process.poll() is None for case in running) and time.monotonic() < limit:
                time.sleep(PAUSE)
        finally:
            for case in running:
                case.process.kill()
                case.process.wait()


class _Running:
    """A case under way in a process of its own, which ends when this one does: :mod:`pipeline.cli.attended`."""

    def __init__(self, sweep: Sweep, variant: Variant) -> None:
        self.variant = variant
        self.started = time.monotonic()
        # Closed by end(), after the process has ended.
        self.said: IO[str] = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        case = sweep.case_file(variant)
        options = ["--until", sweep.study.until, "--output", str(sweep.folder), "--threads", str(sweep.threads)]
        self.process = subprocess.Popen(
            # -P: a folder 'pipeline' in the working folder is not this program.
            [sys.executable, "-P", "-m", "pipeline.cli.attended", "run", str(case), *options],
            env=os.environ | dict.fromkeys(THREAD_LIMITS, str(sweep.threads)),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self.said,
            # Ctrl-C reaches all processes of a terminal's group: only we tell the cases to end, and once.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # the same on Windows
        )

    @property
    def seconds(self) -> float:
        """Since the start."""
        return time.monotonic() - self.started

    def tell_to_stop(self) -> None:
        """Have the process store what it has and end."""
        assert self.process.stdin
        self.process.stdin.close()

    def end(self) -> tuple[int, str]:
        """Exit code and sentence of the process, which has ended."""
        self.tell_to_stop()
        code = self.process.returncode
        with self.said:
            self.said.seek(0)
            sentences = list(_sentences(self.said))
        if code < 0:
            ended = f"ended by the signal {signal.Signals(-code).name}, perhaps for want of memory; see its log."
            return int(ExitCode.UNEXPECTED), ended
        known = code if code in list(ExitCode) else int(ExitCode.UNEXPECTED)
        return known, " ".join(sentences) or f"ended with the code {code}; see its log." if code else ""


def _sentences(lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        if line.startswith("poro: "):
            yield line.removeprefix("poro: ").strip()

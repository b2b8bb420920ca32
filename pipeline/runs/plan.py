"""What a job has to do: which stages run, and why."""

from __future__ import annotations

import hashlib
import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact, contents
from pipeline.store.artifact import Header
from pipeline.store.job import Job
from pipeline.store.keys import changes, content_key, plain, stage_settings
from pipeline.store.stage_names import STAGES


@dataclass(frozen=True)
class Step:
    """One stage of a plan.

    Attributes:
        stage: its name.
        path: its artifact.
        content_key: the key its result will have.
        upstream_keys: keys of what it works on.
        reasons: why it runs; none if its artifact is up to date.
        given: whether the user named its artifact instead of a case.
        header: of the artifact that is there, if any.
    """

    stage: str
    path: Path
    content_key: str
    upstream_keys: tuple[str, ...]
    reasons: tuple[str, ...]
    given: bool
    header: Header | None

    @property
    def runs(self) -> bool:
        """Whether the stage runs."""
        return bool(self.reasons)


def stage_version(stage: str) -> int:
    """Version of a stage's method; a change of it makes older results stale."""
    version: int = importlib.import_module(f"stages.{stage}").VERSION
    return version


def plan(job: Job, *, first: str | None = None, last: str = STAGES[-1], forced: str | None = None) -> list[Step]:
    """The steps up to a stage.

    Args:
        job: the case and its files.
        first: stages before this one are not run; they must be up to date.
        last: the last stage wanted.
        forced: this stage and those after it run even if they are up to date.

    Raises:
        Fault: if an artifact in the way is unreadable, or a stage before ``first`` is not up to date (ARTIFACT), or
            the stages asked for are none (USAGE).
    """
    if first and STAGES.index(first) > STAGES.index(last):
        raise Fault(ExitCode.USAGE, f"--from {first} comes after --until {last}; exchange them.")
    wanted = STAGES[: STAGES.index(last) + 1]
    force = STAGES[STAGES.index(forced) :] if forced else ()
    steps: list[Step] = []
    if job.given:
        if job.given.stage not in wanted[:-1]:
            raise Fault(
                ExitCode.USAGE,
                f"{job.argument}: this is already the result of '{job.given.stage}'; give the case file instead.",
            )
        steps.append(_given(job, job.given))
        wanted = wanted[STAGES.index(job.given.stage) + 1 :]
    for stage in wanted:
        step = _step(job, stage, steps[-1] if steps else None, stage in force)
        if step.runs and first and STAGES.index(stage) < STAGES.index(first):
            reason = "; ".join(step.reasons)
            raise Fault(ExitCode.ARTIFACT, f"{step.path}: '{stage}' is not up to date ({reason}); use --from {stage}.")
        steps.append(step)
    return steps


def simulation_plan(job: Job, *, forced: bool = False) -> list[Step]:
    """The steps to the simulation, which branches off the chain after the optimisation.

    Raises:
        Fault: as :func:`plan`.
    """
    given = job.given is not None and job.given.stage == "optimize"
    steps = [_given(job, job.given)] if job.given and given else plan(job, last="optimize")
    return [*steps, _step(job, "simulate", steps[-1], forced)]


def status(job: Job) -> list[Step]:
    """All steps of the chain, and the simulation if there is one.

    Raises:
        Fault: as :func:`plan`.
    """
    steps = plan(job)
    if steps[0].stage == "optimize" and job.artifact("simulate").exists():
        steps.append(_step(job, "simulate", steps[0], False))
    return steps


def _given(job: Job, header: Header) -> Step:
    return Step(header.stage, job.argument, header.content_key, header.upstream_keys, (), True, header)


def _step(job: Job, stage: str, upstream: Step | None, force: bool) -> Step:
    settings = stage_settings(plain(job.case), stage)
    upstream_keys = (upstream.content_key,) if upstream else ()
    version = stage_version(stage)
    key = content_key(stage, version, settings, upstream_keys)
    path = job.artifact(stage)
    header = None
    if force:
        reasons = ["forced"]
    elif not path.exists():
        reasons = ["missing"]
    else:
        header = artifact.read_header(path)
        if header.stage != stage:
            raise Fault(
                ExitCode.ARTIFACT, f"{path}: this is the result of '{header.stage}', not of '{stage}'; move it away."
            )
        reasons = _stale(header, version, settings, upstream)
        if stage == "export" and not reasons:
            reasons = _part_changed(path, job.files.exported)
        if not reasons and header.content_key != key:
            interrupted = header.content_key == artifact.UNFINISHED
            reasons = ["interrupted before its end" if interrupted else "content key differs"]
    return Step(stage, path, key, upstream_keys, tuple(reasons), False, header)


def _stale(header: Header, version: int, settings: dict[str, Any], upstream: Step | None) -> list[str]:
    reasons = []
    if header.stage_version != version:
        reasons.append(f"stage version {header.stage_version} → {version}")
    old = stage_settings(header.case_resolved, header.stage)
    if differences := changes(header.stage, old, settings):
        reasons.append(f"settings changed: {', '.join(differences)}")
    if upstream and upstream.runs:
        reasons.append(f"upstream changed: {upstream.stage} runs again")
    elif upstream and upstream.header and header.upstream_identity != upstream.header.identity:
        reasons.append(f"upstream changed: {upstream.path.name} is another one")
    return reasons


def _part_changed(record: Path, part: Path) -> list[str]:
    if not part.is_file():
        return [f"missing: {part.name}"]
    written = contents.summary(record, "export")["sha256"]
    found = hashlib.sha256(part.read_bytes()).hexdigest()
    return [] if found == written else [f"{part.name} was changed after it was written"]

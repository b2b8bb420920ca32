"""What a job has to do: which stages run, and why."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.adopted import is_solid
from pipeline.runs.job import Job
from pipeline.runs.keys import changes, content_key, leaves, plain, stage_settings
from pipeline.store import artifact, contents
from pipeline.store.artifact import Header
from stages.chain import GOAL, STAGES, goal_from, path_to


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
        made_with: what the command line that made the artifact said instead of the case, ``section.key value``.
    """

    stage: str
    path: Path
    content_key: str
    upstream_keys: tuple[str, ...]
    reasons: tuple[str, ...]
    given: bool
    header: Header | None
    made_with: tuple[str, ...] = ()

    @property
    def runs(self) -> bool:
        """Whether the stage runs."""
        return bool(self.reasons)


def plan(job: Job, *, first: str | None = None, last: str | None = None, forced: str | None = None) -> list[Step]:
    """The steps up to a stage.

    Args:
        job: the case and its files.
        first: stages before this one are not run; they must be up to date.
        last: the last stage wanted; by default the part, or ``first`` where the part does not need that.
        forced: this stage and those after it run even if they are up to date.

    Raises:
        Fault: if an artifact in the way is unreadable, or a stage before ``first`` is not up to date (ARTIFACT), or
            the stages asked for are none (USAGE).
    """
    wanted = path_to(last or goal_from(first or GOAL))
    _refuse_elsewhere(first, wanted)
    force = wanted[wanted.index(forced) :] if forced in wanted else ()
    before = wanted[: wanted.index(first)] if first else ()
    steps: list[Step] = []
    if job.given:
        if job.given.stage not in wanted[:-1]:
            raise Fault(
                ExitCode.USAGE,
                f"{job.argument}: {_kind(job)}, on which '{wanted[-1]}' does not work; give the case file instead.",
            )
        steps.append(_given(job, job.given))
        wanted = wanted[wanted.index(job.given.stage) + 1 :]
    for stage in wanted:
        step = _step(job, stage, steps[-1] if steps else None, plain(job.case), forced=stage in force)
        if step.runs and stage in before:
            reason = "; ".join(step.reasons)
            raise Fault(ExitCode.ARTIFACT, f"{step.path}: '{stage}' is not up to date ({reason}); use --from {stage}.")
        steps.append(step)
    return steps


def _kind(job: Job) -> str:
    return (
        "this is a solid"
        if is_solid(job.argument)
        else f"this is already the result of '{job.given and job.given.stage}'"
    )


def status(job: Job) -> list[Step]:
    """Which artifacts fit the case: the steps to the part, and those of other stages whose artifacts are there.

    An artifact that was made with an option of the command line fits the case for as long as the case says of that key
    what it said then. The commands that run stages go by the case and their own options alone: see :func:`plan`.

    Raises:
        Fault: if an artifact is unreadable (ARTIFACT), or the user gave that of the last stage (USAGE).
    """
    goal = path_to(GOAL)
    if job.given and job.given.stage not in goal[:-1]:
        plan(job)  # says why not
    steps: dict[str, Step] = {job.given.stage: _given(job, job.given)} if job.given else {}
    for stage, row in STAGES.items():
        there = not row.after or row.after in steps
        if not there or stage in steps or (stage not in goal and not job.artifact(stage).exists()):
            continue
        if job.given and stage in path_to(job.given.stage):
            continue
        steps[stage] = _step(job, stage, steps.get(row.after), None)
    return list(steps.values())


def instability(steps: Iterable[Step], summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """What is said of the first result that holds a state which is not stable; empty if nothing is known of one.

    Args:
        steps: that are done.
        summaries: by stage.
    """
    told = (
        STAGES[step.stage].instability(summaries[step.stage], str(step.path))
        for step in steps
        if step.stage in summaries
    )
    return next(filter(None, told), "")


def _refuse_elsewhere(first: str | None, wanted: tuple[str, ...]) -> None:
    """Refuse a first stage that is not among the wanted ones."""
    if first is None or first in wanted:
        return
    last = wanted[-1]
    if last in path_to(first):
        raise Fault(ExitCode.USAGE, f"--from {first} comes after --until {last}; exchange them.")
    choices = ", ".join(wanted)
    raise Fault(ExitCode.USAGE, f"--from {first}: '{last}' does not need it; choose one of {choices}.")


def _given(job: Job, header: Header) -> Step:
    return Step(header.stage, job.argument, header.content_key, header.upstream_keys, (), True, header)


def _step(
    job: Job, stage: str, upstream: Step | None, resolved: dict[str, Any] | None, *, forced: bool = False
) -> Step:
    """A step to a stage; ``resolved`` is the case by which it is judged, None for that of its artifact's making."""
    path, version = job.artifact(stage), STAGES[stage].load().VERSION
    header = artifact.read_header(path) if path.exists() and not forced else None
    if header and header.stage != stage:
        raise Fault(
            ExitCode.ARTIFACT, f"{path}: this is the result of '{header.stage}', not of '{stage}'; move it away."
        )
    if resolved is None:
        resolved = job.as_made(header) if header else plain(job.case)
    settings = stage_settings(resolved, stage)
    upstream_keys = (upstream.content_key,) if upstream else ()
    key = content_key(stage, version, settings, upstream_keys)
    if forced or not header:
        reasons = ["forced" if forced else "missing"]
    else:
        reasons = _stale(header, version, settings, upstream)
        if STAGES[stage].makes_part and not reasons:
            reasons = _part_changed(stage, path, job.files.exported)
        if not reasons and header.content_key != key:
            interrupted = header.content_key == artifact.UNFINISHED
            reasons = ["interrupted before its end" if interrupted else "content key differs"]
    return Step(stage, path, key, upstream_keys, tuple(reasons), False, header, _made_with(header))


def _made_with(header: Header | None) -> tuple[str, ...]:
    """What the command line said that made an artifact, where the case said something else."""
    if header is None:
        return ()
    said = {name: header.case_resolved[_parts(name)[0]].get(_parts(name)[1]) for name in header.replaced}
    own = dict(leaves(header.replaced))
    return tuple(f"{name} {value}" for name, value in leaves(said) if name not in own or own[name] != value)


def _parts(name: str) -> tuple[str, str]:
    section, _, key = name.partition(".")
    return section, key


def _stale(header: Header, version: int, settings: dict[str, Any], upstream: Step | None) -> list[str]:
    reasons = []
    if header.stage_version != version:
        reasons.append(f"stage version {header.stage_version} → {version}")
    old = stage_settings(header.case_resolved, header.stage)
    if differences := changes(old, settings):
        reasons.append(f"settings changed: {', '.join(differences)}")
    if upstream and upstream.runs:
        reasons.append(f"upstream changed: {upstream.stage} runs again")
    elif upstream and upstream.header and header.upstream_identity != upstream.header.identity:
        reasons.append(f"upstream changed: {upstream.path.name} is another one")
    return reasons


def _part_changed(stage: str, record: Path, part: Path) -> list[str]:
    if not part.is_file():
        return [f"missing: {part.name}"]
    written = contents.summary(record, stage)["sha256"]
    found = hashlib.sha256(part.read_bytes()).hexdigest()
    return [] if found == written else [f"{part.name} was changed after it was written"]

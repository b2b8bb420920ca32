"""What was made of another problem under the same name is kept: it moves to a numbered folder beside the case's."""

from __future__ import annotations

import contextlib
from itertools import count
from pathlib import Path

from pipeline.exit_codes import Fault
from pipeline.runs.job import Job
from pipeline.runs.keys import changes, plain, problem
from pipeline.runs.plan import Step
from pipeline.store import artifact
from pipeline.store.files import folder_of
from stages.chain import STAGES


def another_problem(job: Job, steps: list[Step]) -> list[str]:
    """What the case says otherwise than what the files were made from that the steps would replace.

    Returns:
        Each key with its old and its new value; nothing where the files are of the same problem, where they are asked
        to be replaced, or where the job works on a file of their own folder.
    """
    here = job.given is not None and folder_of(job.argument).resolve() == job.files.folder.resolve()
    if here or not any(step.runs for step in steps) or any("forced" in step.reasons for step in steps):
        return []
    own = problem(plain(job.case))
    for path in filter(Path.exists, (*map(job.files.artifact, STAGES), job.files.checkpoint)):
        with contextlib.suppress(Fault):  # unreadable: nothing to keep
            if found := changes(problem(artifact.read_header(path).case_resolved), own):
                return found
    return []


def set_aside(job: Job, differences: list[str]) -> str:
    """Move the files of another problem; returns the sentence that says so.

    Raises:
        OSError: if the folder does not let them go.
    """
    files = job.files
    places = (files.folder.with_name(f"{files.folder.name}.{number}") for number in count(1))
    place = next(each for each in places if not each.exists())
    kept = place / files.details.name
    kept.mkdir(parents=True)
    # The lock stays: it is this process that holds it.
    for path in [each for each in files.details.iterdir() if not each.name.startswith(".")]:
        path.rename(kept / path.name)
    for path in [each for each in files.folder.iterdir() if _of_case(job, each)]:
        path.rename(place / path.name)
    return f"{files.folder} held the results of another problem ({', '.join(differences)}); they are kept in {place}"


def _of_case(job: Job, path: Path) -> bool:
    return path.is_file() and (job.files.owns(path.name) or path == job.files.report)

"""The fields of the design updates: a small file each while an optimisation runs, then a group of its artifact.

A file of its own for every update costs the same at the two hundredth as at the first; written before the checkpoint,
it is there for every update that a resumed run counts as made.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.exit_codes import Fault
from pipeline.runs.checkpoint import OPTIMIZE, Checkpoint, path_header
from pipeline.runs.job import Job
from pipeline.runs.keys import path_key
from pipeline.store import artifact
from pipeline.store.artifact import Header
from stages.datasets import Dataset
from stages.design import FIELDS, Kept, Result
from stages.events import DesignUpdate, Event

STAGE = "update"


@dataclass(frozen=True)
class Place:
    """Where the fields of one case's updates lie while it is optimised.

    Attributes:
        folder: of their files.
        header: of every file; its content key is that of the path the optimisation takes.
    """

    folder: Path
    header: Header

    def file(self, update: int) -> Path:
        """File of an update."""
        return self.folder / f"{update:06d}.h5"

    def found(self) -> dict[int, Path]:
        """Files of this path, by number; those of another path and unreadable ones are left out."""
        files = {}
        for path in sorted(self.folder.glob("[0-9]*.h5")):
            try:
                if path.stem.isdigit() and artifact.read_header(path).content_key == self.header.content_key:
                    files[int(path.stem)] = path
            except Fault:
                continue
        return files


class UpdateKeeper:
    """Observer that stores the fields of every n-th design update.

    Args:
        job: the case; ``optimizer.keep_updates`` is n, and 0 stores nothing.
        start: where the optimisation continues, or None; with the first event, later files, and all of another path,
            are removed.
    """

    def __init__(self, job: Job, start: Checkpoint | None) -> None:
        self.every = job.case.optimizer.keep_updates
        self.finished = job.artifact(OPTIMIZE)
        self.place = Place(job.files.updates, path_header(job, STAGE))
        self.reached = start.updates if start else -1
        self._clean = False

    def observe(self, event: Event) -> None:
        """Store the fields of a design update if it is one of those to keep.

        Raises:
            OSError: if the disk does not take them, or give up older ones.
        """
        if not isinstance(event, DesignUpdate):
            return
        if not self._clean:  # not before there is something new: until then the older run can go on
            self._remove_others()
        update = int(event.record["update"])
        if self.every == 0 or update % self.every or self.place.file(update).exists():
            return
        self.place.folder.mkdir(parents=True, exist_ok=True)
        fields = event.fields()
        datasets = {
            name: Dataset(np.asarray(fields[name], dtype=np.float32), *meaning) for name, meaning in FIELDS.items()
        }
        artifact.write(self.place.file(update), self.place.header, datasets)

    def _remove_others(self) -> None:
        kept = self.place.found()
        for path in self.place.folder.glob("[0-9]*.h5"):
            if not path.stem.isdigit() or int(path.stem) not in kept or int(path.stem) > self.reached:
                path.unlink()
        self._clean = True

    def collect(self, result: Result) -> Kept:
        """The fields of all updates kept so far and of the last one, by number; none where none are to be kept.

        Args:
            result: of the optimisation.
        """
        if self.every == 0:
            return {}
        last = int(result.summary["updates"])
        kept = self._of_finished() if self.reached >= 0 else {}
        for number, path in self.place.found().items():
            try:
                kept[number] = dict(zip(FIELDS, artifact.read(path, STAGE, *FIELDS), strict=True))
            except Fault:  # a step less is no reason to lose the result
                continue
        n_vertices = len(result.chi)
        final = {"chi": result.chi, "pressure": result.pressure, "displacement": result.displacement[:n_vertices]}
        kept[last] = {name: values.astype(np.float32) for name, values in final.items()}
        return {number: kept[number] for number in sorted(kept) if number % self.every == 0 or number == last}

    def _of_finished(self) -> Kept:
        """What the finished run holds that this one continues."""
        try:
            header = artifact.read_header(self.finished)
            if path_key(header.case_resolved, OPTIMIZE, header.stage_version) != self.place.header.content_key:
                return {}
            return {number: fields for number, fields in read(self.finished).items() if number <= self.reached}
        except Fault:  # missing or unreadable
            return {}


def clear(job: Job) -> None:
    """Remove the files of a job's updates, once its artifact holds what they held."""
    shutil.rmtree(job.files.updates, ignore_errors=True)


def kept(job: Job) -> Kept:
    """The fields of a case's design updates so far: of its artifact, and of an optimisation under way or interrupted.

    Raises:
        Fault: if there is neither, or the artifact is unreadable (ARTIFACT).
    """
    files = {} if job.given else Place(job.files.updates, path_header(job, STAGE)).found()
    finished = job.artifact(OPTIMIZE)
    found = read(finished) if finished.exists() or not files else {}
    newer = {
        number: dict(zip(FIELDS, artifact.read(path, STAGE, *FIELDS), strict=True)) for number, path in files.items()
    }
    return found | newer


def read(path: Path) -> Kept:
    """The fields of the design updates that an artifact of ``optimize`` keeps; none if it keeps none.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    if not artifact.holds(path, OPTIMIZE, "updates/number"):
        return {}
    numbers, *flat = artifact.read(path, OPTIMIZE, "updates/number", *(f"updates/{name}" for name in FIELDS))
    fields = [values.reshape(len(numbers), -1, *values.shape[1:]) for values in flat]
    return {
        int(number): {name: values[i] for name, values in zip(FIELDS, fields, strict=True)}
        for i, number in enumerate(numbers)
    }

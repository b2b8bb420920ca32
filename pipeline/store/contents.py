"""What the artifact of a stage holds: summaries, designs and surfaces, read and refused where they are not finite."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.failure import InvalidField
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact
from stages import datasets
from stages.datasets import Dataset

if TYPE_CHECKING:
    from actuator.domains.interface import Domain


#: Of an artifact that can be read and does not hold what it should.
OTHER_VERSION = "as if another version of poro had made it; make it again with --force"


@dataclass(frozen=True)
class Stored:
    """The artifact of a stage, for a stage that works on it."""

    path: Path
    stage: str

    def read(self, *names: str) -> list[Any]:
        """Datasets by their path inside it.

        Raises:
            Fault: if the artifact is missing, unreadable, of another stage, or not finite (ARTIFACT).
        """
        found = artifact.read(self.path, self.stage, *names)
        self._refuse_not_finite(dict(zip(names, found, strict=True)))
        return found

    def read_group(self, group: str) -> dict[str, Any]:
        """All datasets of a group by name.

        Raises:
            Fault: as :meth:`read`.
        """
        found = artifact.read_group(self.path, self.stage, group)
        self._refuse_not_finite({f"{group}/{name}": values for name, values in found.items()})
        return found

    def _refuse_not_finite(self, found: Mapping[str, Any]) -> None:
        for name, values in found.items():
            if isinstance(values, np.ndarray) and values.dtype.kind == "f":
                refuse_not_finite(self.path, name, values)


def design(path: Path, stage: str) -> tuple[Domain, Floats]:
    """Domain and χ at its vertices from the artifact of ``optimize``, ``refine`` or ``finish``.

    Raises:
        Fault: if the artifact is missing, unreadable, of another stage, or not finite (ARTIFACT).
    """
    try:
        return datasets.design(Stored(path, stage))
    except InvalidField as failure:
        raise Fault(ExitCode.ARTIFACT, f"{path}: {failure}") from None


def surface(path: Path) -> tuple[Floats, Ints]:
    """Vertices (n, 3) and triangles (m, 3) from the artifact of ``mirror``.

    Raises:
        Fault: if the artifact is missing, unreadable, of another stage, or not finite (ARTIFACT).
    """
    try:
        return datasets.surface(Stored(path, "mirror"))
    except InvalidField as failure:
        raise Fault(ExitCode.ARTIFACT, f"{path}: {failure}") from None


def checkpoint(path: Path, stage: str) -> dict[str, Any]:
    """The optimiser's arrays, from the artifact of ``optimize`` or a checkpoint.

    Raises:
        Fault: if the file is missing, unreadable, of another stage, or not finite (ARTIFACT).
    """
    state = artifact.read_group(path, stage, "checkpoint")
    for name, value in state.items():
        # Of the columns of the history some may be unknown.
        if not name.startswith("history."):
            refuse_not_finite(path, f"checkpoint/{name}", value)
    return state


def refuse_not_finite(path: Path, name: str, values: Floats) -> None:
    """Do nothing if all values of a dataset are finite.

    Raises:
        Fault: with how many are not (ARTIFACT).
    """
    if bad := int(np.count_nonzero(~np.isfinite(values))):
        raise Fault(
            ExitCode.ARTIFACT, f"{path}: {name} is not finite in {bad} of {values.size} entries; make the file again."
        )


def summarised(summary: Mapping[str, Any]) -> dict[str, Dataset]:
    """A stage's summary as a dataset; numbers that are not finite, which JSON lacks, become null."""
    text = json.dumps(_json_value(summary), allow_nan=False)
    return {"report/summary": Dataset(text, "", "summary of the stage, JSON")}


def summary(path: Path, stage: str) -> dict[str, Any]:
    """A stage's summary, read from its artifact.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT); later, if an entry is asked for
            that it does not have.
    """

    class Summary(dict[str, Any]):
        def __missing__(self, name: str) -> Any:
            raise Fault(ExitCode.ARTIFACT, f"{path}: says nothing of '{name}', {OTHER_VERSION}.")

    (text,) = artifact.read(path, stage, "report/summary")
    try:
        found: dict[str, Any] = json.loads(text, object_hook=Summary)
    except ValueError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: its summary is no JSON, {OTHER_VERSION}.") from None
    return found


def _json_value(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _json_value(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _json_value(value.tolist())
    if isinstance(value, list | tuple):
        return [_json_value(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""Where the files of a case lie, and which of them are its own."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from stages.chain import PART, STAGES, Beside
from stages.formats import FORMATS


@dataclass(frozen=True)
class Files:
    """Where a job's files lie.

    Attributes:
        folder: of all of them.
        name: of the case.
        part: file name of the part, after which what is made of it is named too.
    """

    folder: Path
    name: str
    part: str

    def artifact(self, stage: str) -> Path:
        """The artifact of a stage; that of one that makes a part is the record beside the part."""
        row = STAGES[stage]
        return self.folder / f"{self.part if row.makes_part else self._stem(stage)}{row.suffix}"

    def _stem(self, stage: str) -> str:
        return self.exported.stem if STAGES[stage].of_part else self.name

    @property
    def exported(self) -> Path:
        """The part."""
        return self.folder / self.part

    def beside(self, stage: str, beside: Beside) -> Path:
        """A file that is written beside the artifact of a stage."""
        return self.folder / f"{self._stem(stage)}{beside.ending}"

    def film(self, of: str, format: str) -> Path:
        """A film of what happens to the case, or to a part of that name."""
        return self.folder / f"{self.name}.{of}.{format}"

    @property
    def log(self) -> Path:
        """The log, to which every command appends."""
        return self.folder / f"{self.name}.log"

    @property
    def checkpoint(self) -> Path:
        """State of an optimisation under way."""
        return self.folder / f"{self.name}.checkpoint.h5"

    @property
    def updates(self) -> Path:
        """Folder with the fields of the design updates of an optimisation under way."""
        return self.folder / f"{self.name}.updates"

    @property
    def lock(self) -> Path:
        """Locked while a process works on the case."""
        return self.folder / f".{self.name}.lock"

    @property
    def holder(self) -> Path:
        """Says which process that is."""
        return self.folder / f".{self.name}.holder"

    def owns(self, name: str) -> bool:
        """Whether a command that works on the case, and no other, writes a file of this name."""
        return any(re.fullmatch(f"{re.escape(self.name)}({ending})", name) for ending in _endings())


def part_of(record: Path) -> Path:
    """The part whose record an artifact is: it lies beside it, under the same name without the ending."""
    return record.with_suffix("")


def record_of(part: Path) -> Path:
    """Where the record of a part lies, or would lie."""
    return part.with_name(f"{part.name}{STAGES[PART].suffix}")


def _endings() -> Iterator[str]:
    """Patterns of all that may follow the name of a case."""
    yield re.escape(".checkpoint.h5")
    renaming = {option.name for row in STAGES.values() for option in row.options if option.renames}
    tags = "".join(rf"(\.{re.escape(name)}-[^/]+)?" for name in sorted(renaming))
    for row in STAGES.values():
        stems, tag = [""], tags if row.of_part else ""
        if row.makes_part:
            stems = [format.ending for format in FORMATS.values()]
            yield from (tag + re.escape(stem) for stem in stems)
        for stem in stems:
            artifact = tag + re.escape(stem + row.suffix)
            yield artifact
            if not row.makes_part:
                yield artifact.removesuffix(re.escape(".h5")) + re.escape(".vtkhdf")
        yield from (tag + re.escape(beside.ending) for beside in row.beside)

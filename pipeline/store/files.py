"""Where the files of a case lie, and which of them are its own.

A case has a folder. On top lie what a user looks for, the design and the parts with their picture, sheet and report;
all else lies in a folder below. Names are those of the case or the part, with what it is after a dot.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pipeline.exit_codes import ExitCode, Fault
from stages.chain import GOAL, PART, STAGES, Beside, path_to, renaming
from stages.formats import FORMATS

#: The folder of results in the working folder, and the one below, in that of a case.
OUTPUTS, DETAILS = "outputs", "details"


@dataclass(frozen=True)
class Files:
    """Where a job's files lie.

    Attributes:
        folder: of the case.
        name: of the case.
        part: file name of the part, after which what is made of it is named too.
    """

    folder: Path
    name: str
    part: str

    def artifact(self, stage: str) -> Path:
        """The artifact of a stage; that of one that makes a part is the record of the part."""
        row = STAGES[stage]
        folder = self.details if row.after else self.folder
        return folder / f"{self.part if row.makes_part else self._stem(stage)}{row.suffix}"

    @property
    def details(self) -> Path:
        """Folder of what is neither design nor part."""
        return self.folder / DETAILS

    def _stem(self, stage: str) -> str:
        return self.exported.stem if STAGES[stage].of_part else self.name

    @property
    def exported(self) -> Path:
        """The part."""
        return self.folder / self.part

    def beside(self, stage: str, beside: Beside) -> Path:
        """A file for people or other programs that belongs to the artifact of a stage."""
        return (self.folder if beside.on_top else self.details) / f"{self._stem(stage)}{beside.ending}"

    @property
    def report(self) -> Path:
        """The page about the case."""
        return self.folder / f"{self.name}.report.html"

    @property
    def log(self) -> Path:
        """The log, to which every command appends."""
        return self.details / f"{self.name}.log"

    @property
    def checkpoint(self) -> Path:
        """State of an optimisation under way."""
        return self.details / f"{self.name}.checkpoint.h5"

    @property
    def updates(self) -> Path:
        """Folder with the fields of the design updates of an optimisation under way."""
        return self.details / f"{self.name}.updates"

    @property
    def lock(self) -> Path:
        """Locked while a process works on the case."""
        return self.details / f".{self.name}.lock"

    @property
    def holder(self) -> Path:
        """Says which process that is."""
        return self.details / f".{self.name}.holder"

    def owns(self, name: str) -> bool:
        """Whether a command that works on the case, and no other, writes a file of this name."""
        return any(re.fullmatch(f"{re.escape(self.name)}({ending})", name) for ending in _endings())


def make_folder(folder: Path) -> None:
    """Make a folder for results, if it is not there.

    Raises:
        Fault: if it cannot be made (USAGE).
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        sentence = f"{folder}: cannot be made a folder for the results ({error.strerror}); choose another --output."
        raise Fault(ExitCode.USAGE, sentence) from None


def folder_of(path: Path) -> Path:
    """The folder of the case that a file of it lies in."""
    return path.parent.parent if path.parent.name == DETAILS else path.parent


def detail_of(path: Path, name: str) -> Path:
    """A file among the details of the case that a file belongs to."""
    return folder_of(path) / DETAILS / name


def part_of(record: Path) -> Path:
    """The part whose record an artifact is: it has the same name without the ending."""
    return folder_of(record) / record.stem


def record_of(part: Path) -> Path:
    """Where the record of a part lies, or would lie."""
    return detail_of(part, f"{part.name}{STAGES[PART].suffix}")


def located(path: Path) -> Path:
    """What a path names: itself, the design in the folder of a case, or a file in that of a case which is not named.

    ``case14.h5`` is ``case14/case14.h5`` or ``outputs/case14/case14.h5`` where there is none here, so that a command
    reads the same whichever folder the results went to. A design may still be on its way, in a checkpoint.
    """
    try:
        if path.is_dir() and _begun(path, name := path.resolve().name):
            return path / f"{name}.h5"
        if path.exists():
            return path
        bases = [base for base in (path.parent, path.parent / OUTPUTS) if base.is_dir()]
        folders = [each for base in bases for each in sorted(base.iterdir()) if path.name.startswith(f"{each.name}.")]
        places = [folder / path.name for each in folders for folder in (each, each / DETAILS)]
        begun = [each / path.name for each in folders if path.name == f"{each.name}.h5" and _begun(each, each.name)]
        return next((place for place in (*filter(Path.is_file, places), *begun)), path)
    except OSError:  # what reads the file will say so
        return path


def _begun(folder: Path, name: str) -> bool:
    """Whether a case has a design in its folder, or is on its way to one."""
    files = Files(folder, name, "")
    return files.artifact(path_to(GOAL)[0]).is_file() or files.checkpoint.is_file()


def _endings() -> Iterator[str]:
    """Patterns of all that may follow the name of a case."""
    yield re.escape(".checkpoint.h5")
    tags = "".join(rf"(\.{re.escape(name)}-[^/]+)?" for name in sorted(renaming().values()))
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

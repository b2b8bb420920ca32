"""The files that a case names, to begin with and for its regions: found, read, and known by what they hold."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.case import text as case_text
from pipeline.case.model import Case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.adopted import is_solid
from pipeline.store import artifact, contents
from pipeline.store.files import Files, located
from pipeline.store.solid_file import read_solid
from stages.regions import FileRegion

if TYPE_CHECKING:
    from actuator.geometry.zero_set import Surface
    from stages.initial import Given

#: Stages whose artifacts hold a density field on its mesh.
FIELDS = ("optimize", "refine", "finish")


def read(file: Path) -> tuple[Given, str]:
    """What a file holds to begin with, and its sha256; of a result that of the design alone, which reruns keep.

    Raises:
        Fault: if it is missing, unreadable, or holds neither a design nor a solid (ARTIFACT).
    """
    if is_solid(file):
        from actuator.geometry.zero_set import Surface  # only where it is wanted

        solid = read_solid(file)
        return Surface(solid.vertices, solid.triangles), solid.sha256
    if file.suffix != ".h5":
        raise Fault(ExitCode.ARTIFACT, f"{file}: holds no design; give a result, NAME.h5, or a part as STL or 3MF.")
    stage = artifact.read_header(file).stage
    if stage not in FIELDS:
        raise Fault(ExitCode.ARTIFACT, f"{file}: this is the result of '{stage}'; give that of {' or '.join(FIELDS)}.")
    domain, chi = contents.design(file, stage)
    sizes = {name: np.asarray(parameter.value).tolist() for name, parameter in domain.parameters.items()}
    digest = hashlib.sha256(json.dumps([domain.shape, sizes], sort_keys=True).encode() + chi.tobytes())
    return (domain, chi), digest.hexdigest()


def read_body(file: Path) -> tuple[Surface, str]:
    """The closed surface that the file of a region holds, and its sha256.

    Raises:
        Fault: if it is missing or unreadable (ARTIFACT), or its ending tells no format (USAGE).
    """
    from actuator.geometry.zero_set import Surface  # only where it is wanted

    solid = read_solid(file)
    return Surface(solid.vertices, solid.triangles), solid.sha256


def read_bodies(case: Case) -> dict[int, Surface]:
    """What the files hold that regions name, by the number of the region.

    Raises:
        Fault: if one cannot be read (ARTIFACT), or is another one than when the case was (BUSY).
    """
    found = {}
    for number, region in enumerate(case.regions):
        if isinstance(region, FileRegion):
            found[number], digest = read_body(Path(region.file))
            if region.sha256 not in (None, digest):
                raise replaced_meanwhile(region.file)
    return found


def replaced_meanwhile(file: str) -> Fault:
    """That a file does not hold any more what it did when the case was read."""
    sentence = f"{file}: was replaced by another process at this moment; run the same command again."
    return Fault(ExitCode.BUSY, sentence)


def known_by_content(case: Case, argument: Path, text: str, files: Files) -> Case:
    """The case with the sha256 of what its files hold, where it names any.

    Args:
        case: the case.
        argument: its file, for messages.
        text: of that file, as far as it is known.
        files: of the case; a case does not begin with its own result.

    Raises:
        Fault: if a file cannot be used or is not the one that the case means, with the line that names it.
    """
    changed: dict[str, Any] = {}
    if case.initial.file is not None:
        file = located(Path(case.initial.file))
        named = _Named(file, place_of(argument, text, ("initial", "file")), "initial.sha256", case.initial.sha256)
        if file.resolve() == files.artifact("optimize").resolve():
            sentence = f"{named.place} {file} is where the case's own result goes; give the case another name."
            raise Fault(ExitCode.USAGE, sentence)
        changed["initial"] = case.initial.model_copy(update={"file": str(file), "sha256": named.digest(read)})
    regions = list(case.regions)
    for number, region in enumerate(regions):
        if isinstance(region, FileRegion):
            path = ("regions", number, "file")
            named = _Named(Path(region.file), place_of(argument, text, path), f"regions.{number}.sha256", region.sha256)
            regions[number] = region.model_copy(update={"sha256": named.digest(read_body)})
            changed["regions"] = regions
    return case.model_copy(update=changed) if changed else case


def place_of(argument: Path, text: str, path: case_text.Path) -> str:
    """Where a case file says something: file, line as far as it is known, and key."""
    line = f":{case_text.parse(text.encode(), str(argument)).line(path)}" if text else ""
    return f"{argument}{line}: {case_text.dotted(path)}:"


@dataclass(frozen=True)
class _Named:
    """A file that a case names.

    Attributes:
        file: the file.
        place: where the case names it.
        key, sha256: what the case says that it holds, and by which key.
    """

    file: Path
    place: str
    key: str
    sha256: str | None

    def digest(self, read: Callable[[Path], tuple[Any, str]]) -> str:
        """sha256 of what it holds.

        Raises:
            Fault: if it cannot be used or is another one than the case says.
        """
        try:
            _, digest = read(self.file)
        except Fault as fault:
            raise Fault(fault.code, f"{self.place} {fault}") from None
        if self.sha256 not in (None, digest):
            raise Fault(
                ExitCode.USAGE,
                f"{self.place} what {self.file} holds is not what {self.key} says but {digest}; give the file that is "
                "meant, or leave that key out.",
            )
        return digest

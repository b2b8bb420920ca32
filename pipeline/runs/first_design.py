"""The file that a case names to begin with: found, read, and known by what it holds."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.case import text as case_text
from pipeline.case.model import Case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.adopted import is_solid
from pipeline.store import artifact, contents
from pipeline.store.files import Files, located
from pipeline.store.solid_file import read_solid

if TYPE_CHECKING:
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


def known_by_content(case: Case, argument: Path, text: str, files: Files) -> Case:
    """The case with the sha256 of what its file holds, where it names one.

    Args:
        case: the case.
        argument: its file, for messages.
        text: of that file, as far as it is known.
        files: of the case; a case does not begin with its own result.

    Raises:
        Fault: if the file cannot be used or is not the one that the case means, with the line that names it.
    """
    initial = case.initial
    if initial.file is None:
        return case
    line = f":{case_text.parse(text.encode(), str(argument)).line(('initial', 'file'))}" if text else ""
    place, file = f"{argument}{line}: initial.file:", located(Path(initial.file))
    if file.resolve() == files.artifact("optimize").resolve():
        sentence = f"{place} {file} is where the case's own result goes; give the case another name."
        raise Fault(ExitCode.USAGE, sentence)
    try:
        _, digest = read(file)
    except Fault as fault:
        raise Fault(fault.code, f"{place} {fault}") from None
    if initial.sha256 not in (None, digest):
        raise Fault(
            ExitCode.USAGE,
            f"{place} what {file} holds is not what initial.sha256 says but {digest}; give the file that is meant, or "
            "leave that key out.",
        )
    return case.model_copy(update={"initial": initial.model_copy(update={"file": str(file), "sha256": digest})})

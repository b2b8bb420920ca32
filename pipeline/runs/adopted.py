"""A solid that the user names in place of a case: one that poro exported, or one of another program."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from pipeline.case.model import Case, case_type, find_case, read_case, stored_case
from pipeline.exit_codes import Fault
from pipeline.runs.keys import plain
from pipeline.store import artifact, contents
from pipeline.store.artifact import Header
from pipeline.store.files import record_of
from pipeline.store.solid_file import format_of, read_bytes, read_solid
from stages.chain import PART, STAGES
from stages.formats import by_ending
from stages.words import Unit


def is_solid(path: Path) -> bool:
    """Whether a path ends as a solid does."""
    return by_ending(path.suffix) is not None


def refuse_other(path: Path) -> None:
    """Do nothing if a path may be that of a solid, of an artifact or of a case.

    Raises:
        Fault: if it ends otherwise (USAGE).
    """
    if path.suffix.lower() not in ("", ".h5", ".yaml", ".yml"):
        format_of(path)


def exported(solid: Path) -> Path | None:
    """The record beside a solid, if that is still as it was exported.

    Raises:
        Fault: if the solid cannot be read (ARTIFACT).
    """
    record, found = record_of(solid), hashlib.sha256(read_bytes(solid)).hexdigest()
    try:
        return record if contents.summary(record, PART)["sha256"] == found else None
    except Fault:  # there is none, or it is of something else
        return None


def adopted(solid: Path, case: Path | None, unit: Unit | None = None) -> tuple[Header, Case, str]:
    """A solid that poro did not export, as if the stage had made it that makes parts.

    Args:
        solid: the file.
        case: whose material, load, arm and spring it is to be inflated with. By default that of the record beside it,
            of which it is then a changed part, and else the default case.
        unit: of a file that does not say its own.

    Returns:
        A header whose keys are the file's own sha256, and its unit if that is not mm, the case under the name of the
        solid, and its text.

    Raises:
        Fault: if the case is not usable (USAGE), the solid cannot be read (ARTIFACT), or its unit is doubtful
            (BAD_SOLID).
    """
    digest = read_solid(solid, unit).sha256
    key = hashlib.sha256(f"{digest} {unit}".encode()).hexdigest() if unit not in (None, "mm") else digest
    own, text = _case_of(solid, case)
    # Names of cases are made of fewer letters than names of files.
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", solid.stem).lstrip("._-")[:100] or PART
    own = own.model_copy(update={"name": name})
    return Header(PART, STAGES[PART].load().VERSION, key, digest, (), "", text, plain(own)), own, text


def _case_of(solid: Path, case: Path | None) -> tuple[Case, str]:
    if case:
        return read_case(find_case(case))
    record = record_of(solid)
    try:
        header = artifact.read_header(record)
        return stored_case(header.case_resolved, record), header.case_text
    except Fault:
        return case_type().model_validate({}), ""


def identity(path: Path) -> str:
    """What tells a given artifact or solid from any other in its place.

    Raises:
        Fault: if it cannot be read (ARTIFACT).
    """
    if is_solid(path):
        return hashlib.sha256(read_bytes(path)).hexdigest()
    return artifact.read_header(path).identity

"""Artifacts: one HDF5 file per stage, self-describing, whole or not there.

Root attributes say what the file is and what it was made from (:class:`Header`), ``complete`` being written last.
The datasets ``case_text`` and ``case_resolved`` hold the case as the user wrote it and with every default.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import seal, vtkhdf
from pipeline.store.atomic import replacing_hdf5
from stages.datasets import Dataset, GridPaths

if TYPE_CHECKING:  # slow to load: only the functions that open a file import it
    import h5py

FILE_TYPE = "poro artifact"
SCHEMA_VERSION = 1
#: Content key of a result whose computation was interrupted: no plan takes it for up to date.
UNFINISHED = "unfinished"
#: What the headers of checkpoints have in place of a stage.
CHECKPOINT = "checkpoint"

#: Most bytes of one dataset; the largest mesh that was ever computed needs a hundredth of it.
MOST_BYTES = 8 * 2**30

#: Attributes of a header that are stored as JSON.
_AS_JSON = ("upstream_keys", "replaced")


@dataclass(frozen=True)
class Header:
    """What an artifact is.

    Attributes:
        stage, stage_version: who made it.
        content_key: hash of everything the result depends on (:mod:`pipeline.runs.keys`).
        identity: differs between any two runs; artifacts made from this one name it.
        upstream_keys: content keys of the artifacts it was made from.
        upstream_identity: identity of the artifact it was made from, or empty.
        program_version, git_revision, date: of the program, its checkout (or empty), and in ISO 8601, UTC.
        case_text: the case file as the user wrote it.
        case_resolved: the same with every default, and with what the command line said instead (stored as JSON).
        replaced: what the case itself says of the keys ``section.key`` that the command line changed (stored as JSON).
    """

    stage: str
    stage_version: int
    content_key: str
    identity: str
    upstream_keys: tuple[str, ...]
    upstream_identity: str
    case_text: str
    case_resolved: dict[str, Any]
    replaced: dict[str, Any] = field(default_factory=dict)
    program_version: str = ""
    git_revision: str = ""
    date: str = ""


def write(path: Path, header: Header, datasets: Mapping[str, Dataset], grid: GridPaths | None = None) -> None:
    """Write an artifact, replacing an older one only when the new one is whole.

    Args:
        path: where.
        header: what it is; version, revision and date of the program are filled in here.
        datasets: by their path inside the file.
        grid: which of them VTK readers shall find.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    attributes = asdict(header) | {
        "file_type": FILE_TYPE,
        "schema_version": SCHEMA_VERSION,
        "program_version": program_version(),
        "git_revision": git_revision(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    texts = {
        "case_text": Dataset(attributes.pop("case_text"), "", "case file as written by the user, YAML"),
        "case_resolved": Dataset(
            json.dumps(attributes.pop("case_resolved"), indent=2), "", "case with every default, JSON"
        ),
    }
    for name in _AS_JSON:
        attributes[name] = json.dumps(attributes[name])
    with replacing_hdf5(path, seal.block) as file:
        for name, value in attributes.items():
            file.attrs[name] = value
        for name, dataset in (texts | dict(datasets)).items():
            _create(file, name, dataset)
        if grid:
            vtkhdf.write(file, grid)
        file.attrs["complete"] = True


def _create(file: h5py.File, name: str, dataset: Dataset) -> None:
    import h5py

    if isinstance(dataset.values, str):
        created = file.create_dataset(name, data=dataset.values, dtype=h5py.string_dtype())
    else:
        values = np.asarray(dataset.values)
        # Other readers do not know the seal: this checksum tells them of a flipped bit; it needs chunks, which a scalar
        # cannot have. Shuffled, fields take a tenth less room and half the time.
        filters = {"fletcher32": True, "shuffle": True, "compression": "gzip", "compression_opts": 1}
        created = file.create_dataset(name, data=values, **(filters if values.size > 1 else {}))
    created.attrs["units"] = dataset.units
    created.attrs["description"] = dataset.description


def read_header(path: Path) -> Header:
    """What an artifact is.

    Raises:
        Fault: if it is missing, unreadable or no artifact (ARTIFACT).
    """
    with _opened(path) as file:
        values = {name: file.attrs[name] for name in Header.__dataclass_fields__ if name in file.attrs}
        values["stage_version"] = int(values["stage_version"])
        values |= {name: json.loads(values[name]) for name in _AS_JSON if name in values}
        values["upstream_keys"] = tuple(values["upstream_keys"])
        values["case_text"] = _value(file["case_text"])
        values["case_resolved"] = json.loads(file["case_resolved"][()])
        return Header(**values)


def read(path: Path, stage: str, *names: str) -> list[Any]:
    """Datasets of an artifact by their path inside it; arrays, and texts as ``str``.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    with _opened(path, stage) as file:
        return [_value(file[name]) for name in names]


def read_group(path: Path, stage: str, group: str) -> dict[str, Any]:
    """All datasets of a group of an artifact, by name.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    with _opened(path, stage) as file:
        return {name: _value(file[group][name]) for name in file[group]}


def holds(path: Path, stage: str, name: str) -> bool:
    """Whether an artifact has a dataset or group of this path inside it.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    with _opened(path, stage) as file:
        return name in file


def read_grid(path: Path) -> vtkhdf.Grid:
    """What VTK readers find in an artifact, with the arrays themselves.

    Raises:
        Fault: if the artifact is missing, unreadable, or has no mesh (ARTIFACT).
    """
    with _opened(path) as file:
        if vtkhdf.GROUP not in file:
            raise Fault(ExitCode.ARTIFACT, f"{path}: there is no mesh in this artifact; give an earlier stage's.")
        return vtkhdf.read(file)


@contextmanager
def _opened(path: Path, stage: str = "") -> Iterator[h5py.File]:
    """An artifact for reading, of a stage if one is given; whatever HDF5 cannot read becomes one sentence."""
    import h5py

    if path.is_dir():
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is a folder; give a file that poro wrote.")
    if not path.is_file():
        raise Fault(ExitCode.ARTIFACT, f"{path}: there is no such file; run the stage that makes it.")
    again = "delete it and make it again"
    try:
        if flaw := seal.flaw(path):
            raise ValueError(flaw)
        with h5py.File(path, "r") as file:
            if file.attrs.get("file_type") != FILE_TYPE:
                raise Fault(
                    ExitCode.ARTIFACT, f"{path}: this HDF5 file is no poro artifact; give a file that poro wrote."
                )
            if file.userblock_size and not seal.marked(path):
                raise ValueError("its seal is broken")
            if file.attrs["schema_version"] > SCHEMA_VERSION:
                found = file.attrs["schema_version"]
                raise Fault(
                    ExitCode.ARTIFACT,
                    f"{path}: written by a newer poro (schema {found}, this one reads up to {SCHEMA_VERSION}); "
                    "update poro.",
                )
            if not file.attrs.get("complete", False):
                raise Fault(ExitCode.ARTIFACT, f"{path}: the artifact was not written to its end; {again}.")
            if stage and file.attrs["stage"] != stage:
                found = file.attrs["stage"]
                raise Fault(ExitCode.ARTIFACT, f"{path}: this is the result of '{found}'; give the one of '{stage}'.")
            yield file
    except FileNotFoundError:  # replaced or removed at this moment, as a checkpoint is
        raise Fault(ExitCode.ARTIFACT, f"{path}: is not there any more; run the same command again.") from None
    except PermissionError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: may not be read; change its permissions.") from None
    except (OSError, LookupError, AttributeError, RuntimeError, ValueError, TypeError) as error:
        if "truncated" in str(error):
            raise Fault(ExitCode.ARTIFACT, f"{path}: the file is cut short; {again}.") from error
        if "signature not found" in str(error):
            raise Fault(ExitCode.ARTIFACT, f"{path}: this is no HDF5 file; give a file that poro wrote.") from error
        raise Fault(ExitCode.ARTIFACT, f"{path}: the file is damaged ({_first_line(error)}); {again}.") from error


def _first_line(error: Exception) -> str:
    return str(error).strip("'\"").splitlines()[0] if str(error) else type(error).__name__


def _value(dataset: h5py.Dataset) -> NDArray[Any] | str:
    import h5py

    if dataset.nbytes > MOST_BYTES:
        raise ValueError(f"{dataset.name} claims to hold {dataset.nbytes} bytes")
    if h5py.check_string_dtype(dataset.dtype):
        return str(dataset[()].decode())
    return np.asarray(dataset[()])


@cache
def program_version() -> str:
    """Version of the installed program."""
    return metadata.version("poro")


@cache
def git_revision() -> str:
    """Commit of the checkout the program runs from, with ``+`` if it has changes; empty if it is installed."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=40", "--dirty=+", "--exclude=*"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()

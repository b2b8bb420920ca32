"""Files that are either whole or not there: written under another name in the same folder, then moved into place."""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import h5py


#: How temporary files are named, around the name of their target.
_TEMPORARY = re.compile(r"\.(?P<target>.+)\.[0-9a-f]{8}\.tmp")


def temporaries(folder: Path) -> list[tuple[Path, str]]:
    """Files in a folder that are being written, or were when a process was killed, and what each was to be called.

    Raises:
        OSError: if the folder cannot be read.
    """
    found = ((path, _TEMPORARY.fullmatch(path.name)) for path in folder.iterdir())
    return [(path, match["target"]) for path, match in found if match]


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Give a temporary path beside ``target``; what is there at the end takes the target's place.

    The data reach the disk before the name does. If the block fails, the target stays as it was.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        _synchronise(temporary)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    if os.name == "posix":  # elsewhere a folder cannot be opened
        _synchronise(target.parent)


def write_bytes(target: Path, data: bytes) -> None:
    """Write a whole file.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    with replacing(target) as temporary:
        temporary.write_bytes(data)


def write_text(target: Path, text: str) -> None:
    """Write a whole text file, UTF-8.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    write_bytes(target, encoded(text))


def encoded(text: str) -> bytes:
    """A text as UTF-8, in which bytes of a file's name that are none stand as escapes such as ``\\udce9``."""
    return text.encode(errors="backslashreplace")


def _synchronise(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() or os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def replacing_hdf5(target: Path, user_block: Callable[[bytes], bytes] | None = None) -> Iterator[h5py.File]:
    """Give an empty HDF5 file; when the block ends well, it takes the target's place.

    It is built in memory, since the HDF5 library crashes rather than fails when a disk is full.

    Args:
        target: where.
        user_block: gives the 512 bytes to put before the HDF5 data, which are its argument; by default there are none.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    import h5py  # slow to load: only where a file is made

    # The image that HDF5 gives of a file with a user block begins after it.
    size = 512 if user_block else 0
    with h5py.File(target.name, "w", driver="core", backing_store=False, userblock_size=size) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    write_bytes(target, (user_block(image) if user_block else b"") + image)

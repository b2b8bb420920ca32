"""The seal of an artifact: a block before the HDF5 data that says how long they are and what they hash to.

HDF5 checks its arrays only chunk by chunk, and neither scalars nor attributes nor texts; the seal covers every byte. It
lies in the file's user block, which every HDF5 reader skips.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

#: Bytes of the user block, the least that HDF5 allows.
SIZE = 512
_MARK = b"poro artifact, HDF5 data follow at byte 512\n"


def block(data: bytes) -> bytes:
    """The seal of HDF5 data, :data:`SIZE` bytes."""
    return _block(len(data), hashlib.sha256(data).hexdigest())


def marked(path: Path) -> bool:
    """Whether a file begins as a sealed one; those of other programs do not.

    Raises:
        OSError: if the file cannot be read.
    """
    with path.open("rb") as file:
        return file.read(len(_MARK)) == _MARK


def flaw(path: Path) -> str:
    """What a file's seal finds wrong with it, in a few words; empty if nothing, or if the file has none.

    Raises:
        OSError: if the file cannot be read.
    """
    with path.open("rb") as file:
        found = file.read(SIZE)
        if not found.startswith(_MARK):
            return ""
        hashed = hashlib.file_digest(file, "sha256").hexdigest()
        length = file.tell() - SIZE
    if found == _block(length, hashed):
        return ""
    return "truncated" if length < _length(found) else "its bytes are not those that were written"


def _block(length: int, hashed: str) -> bytes:
    return _MARK + f"bytes {length}\nsha256 {hashed}\n".encode().ljust(SIZE - len(_MARK))


def _length(found: bytes) -> int:
    """Length that a seal states; 0 if it is not readable."""
    word = found[len(_MARK) :].partition(b"\n")[0].removeprefix(b"bytes ")
    return int(word) if word.isdigit() else 0

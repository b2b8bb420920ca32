"""Formats of the exported part: how each is written and read, and how its files end.

A format of another program is one more entry; for one that trimesh knows a line::

    from stages.formats import FORMATS, by_trimesh

    FORMATS.register("off", by_trimesh("off"))
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from actuator.failure import UnreadableSolid
from actuator.registry import Registry

if TYPE_CHECKING:  # slow to load: only where a file is written or read
    import trimesh

    from actuator.geometry.zero_set import Surface


#: How the STL of this program begins, by which is known that it is in mm.
OWN = b"poro: "


@dataclass(frozen=True)
class Format:
    """A file format of solids.

    Attributes:
        ending: of its files, with the dot, in lower case.
        write: bytes of a file, given a surface in mm and a title of one line.
        read: triangles in the bytes of a file, in mm, as they stand there; may raise whatever it meets.
        has_unit: whether a file says in which unit it is.
    """

    ending: str
    write: Callable[[Surface, str], bytes]
    read: Callable[[bytes], trimesh.Trimesh]
    has_unit: bool = False


def by_trimesh(name: str) -> Format:
    """A format that trimesh writes and reads, by trimesh's name of it, which is also the ending."""
    return Format(f".{name}", partial(_write, name), partial(_read, name))


def _write(name: str, surface: Surface, title: str) -> bytes:
    import trimesh

    data = trimesh.Trimesh(surface.vertices, surface.triangles, process=False).export(file_type=name)
    return data if isinstance(data, bytes) else data.encode()


def _read(name: str, data: bytes) -> trimesh.Trimesh:
    import trimesh

    mesh = trimesh.load_mesh(io.BytesIO(data), file_type=name, process=False)
    if mesh.units not in (None, "mm", "millimeter", "millimeters"):
        mesh.convert_units("millimeters")
    return mesh


def _write_stl(surface: Surface, title: str) -> bytes:
    header = stl_header(title)
    return header + _write("stl", surface, title)[len(header) :]


def _read_stl(data: bytes) -> trimesh.Trimesh:
    from stages import stl

    return stl.read(data)


def _read_3mf(data: bytes) -> trimesh.Trimesh:
    from stages import threemf

    return threemf.read(data)


def stl_header(title: str) -> bytes:
    """The free text of a binary STL, which must not look like that of an ASCII one."""
    from stages import stl

    return (OWN + title.encode("ascii", "replace"))[: stl.HEADER].ljust(stl.HEADER)


def _write_3mf(surface: Surface, title: str) -> bytes:
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    mesh.units = "millimeters"
    data: bytes = trimesh.Scene({title: mesh}).export(file_type="3mf")
    return data


FORMATS: Registry[Format] = Registry("format")
FORMATS.register("stl", Format(".stl", _write_stl, _read_stl))
FORMATS.register("3mf", Format(".3mf", _write_3mf, _read_3mf, has_unit=True))


def by_ending(ending: str) -> str | None:
    """Name of the format whose files end so, in capitals or not; None if there is none."""
    return next((name for name, format in FORMATS.items() if format.ending == ending.lower()), None)


def decode(data: bytes, name: str) -> trimesh.Trimesh:
    """The triangles in the bytes of a file, in mm, as they stand there.

    Raises:
        actuator.failure.UnreadableSolid: if the bytes are no such file.
    """
    try:
        return FORMATS[name].read(data)
    except UnreadableSolid:
        raise
    except Exception as error:  # parsers raise whatever they meet, such as the key they did not find
        reason = "" if isinstance(error, LookupError) or not str(error) else f" ({error})"
        raise UnreadableSolid(f"The bytes are no readable {name} file{reason}; export the part again.") from error

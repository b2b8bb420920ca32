"""Reading 3MF: the core specification and the production extension, as slicers write them.

A file is a zip archive of parts. The root model's build lists items; each is an object, that has triangles or is put
together of components, which are objects again. With the production extension items and components name the part, a
model of its own, in which their object stands (``p:path``).

An extension that a file requires changes what it means; a reader that does not know it must refuse the file (3MF core
specification, "requiredextensions"). lib3mf 2.5, the consortium's own library, only warns of an unknown one, reads
files that require beam lattices or slices without a word when just the triangles are asked for, does not find parts to
which no relationship leads, and has no wheel for Linux on ARM. The tests compare with it.
"""

from __future__ import annotations

import io
import posixpath
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.failure import UnreadableSolid

if TYPE_CHECKING:  # slow to load: only where a file is read
    import trimesh

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
#: Extensions that may be required: what this reader does, and what changes no shape (colours, names of triangles).
KNOWN = (
    PRODUCTION,
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
)
#: Relationship from the package to its root model, and where that is if a file has no relationships.
ROOT, USUAL_ROOT = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel", "/3D/3dmodel.model"
#: Millimetres of each unit.
UNITS = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
#: Most bytes of an unpacked part, and most triangles with all copies; more is an archive made to exhaust the memory.
MOST_BYTES, MOST_TRIANGLES = 1 << 32, 50_000_000
REMEDY = "export the part again"


@dataclass(frozen=True)
class _Placed:
    """An object where a build or another object puts it: ``points @ linear + shift``, in mm."""

    part: str
    number: str
    linear: Floats
    shift: Floats


@dataclass
class _Object:
    """An object: triangles, or others that it is put together of."""

    kind: str
    vertices: Floats = field(default_factory=lambda: np.empty((0, 3)))
    triangles: Ints = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))
    components: list[_Placed] = field(default_factory=list)


@dataclass
class _Model:
    """A model part: its objects by their number, and what its build lists."""

    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[_Placed] = field(default_factory=list)


def read(data: bytes) -> trimesh.Trimesh:
    """The triangles of all that a file builds, in mm; supports and what is not to be printed are left out.

    Raises:
        UnreadableSolid: if the file is damaged, lacks a part or an object, or requires an unknown extension.
    """
    import trimesh

    package = _Package(data)
    found = [mesh for item in package.model(package.root).items for mesh in package.meshes(item)]
    vertices = np.concatenate([np.empty((0, 3)), *(points for points, _ in found)])
    starts = np.cumsum([0, *(len(points) for points, _ in found)])
    triangles = [corners + start for (_, corners), start in zip(found, starts.tolist(), strict=False)]
    return trimesh.Trimesh(vertices, np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles]), process=False)


class _Package:
    """An archive whose models are read as they are needed, each once."""

    def __init__(self, data: bytes) -> None:
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
        except zipfile.BadZipFile:
            raise UnreadableSolid(f"The 3mf is cut short, or none: it is no whole zip archive; {REMEDY}.") from None
        self._names = {_folded(name): name for name in self._archive.namelist()}
        self._models: dict[str, _Model] = {}
        self._triangles = 0
        self.root = self._root()

    def _root(self) -> str:
        if _folded("_rels/.rels") in self._names:
            for element in _events(self._bytes("/_rels/.rels"), "/_rels/.rels"):
                if element.get("Type") == ROOT:
                    return posixpath.join("/", str(element.get("Target")))
        return USUAL_ROOT

    def _bytes(self, part: str) -> bytes:
        name = self._names.get(_folded(part))
        if name is None:
            raise UnreadableSolid(f"The 3mf has no part {part}, which it refers to; {REMEDY}.")
        if self._archive.getinfo(name).file_size > MOST_BYTES:
            raise UnreadableSolid(f"Part {part} of the 3mf has more than {MOST_BYTES >> 30} GiB; {REMEDY}, coarser.")
        try:
            return self._archive.read(name)
        # RuntimeError: of what is encrypted, or packed in a way that Python does not know.
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError) as error:
            raise UnreadableSolid(f"Part {part} of the 3mf cannot be unpacked ({error}); {REMEDY}.") from None

    def model(self, part: str) -> _Model:
        """A model part."""
        if part not in self._models:
            self._models[part] = _model(self._bytes(part), part)
        return self._models[part]

    def meshes(self, placed: _Placed, above: tuple[tuple[str, str], ...] = ()) -> Iterator[tuple[Floats, Ints]]:
        """Vertices, mm, and triangles of an object and all its components where they are placed."""
        here = (placed.part, placed.number)
        found = self.model(placed.part).objects.get(placed.number)
        if found is None:
            raise UnreadableSolid(f"The 3mf has no object {placed.number} in {placed.part}, which it uses; {REMEDY}.")
        if here in above:
            raise UnreadableSolid(f"Object {placed.number} in {placed.part} of the 3mf contains itself; {REMEDY}.")
        for inner in found.components:
            linear, shift = inner.linear @ placed.linear, inner.shift @ placed.linear + placed.shift
            yield from self.meshes(_Placed(inner.part, inner.number, linear, shift), (*above, here))
        # An object of components is what these are; of the others only models are the part itself.
        if found.kind == "model" and len(found.triangles):
            self._triangles += len(found.triangles)
            if self._triangles > MOST_TRIANGLES:
                raise UnreadableSolid(f"The 3mf has more than {MOST_TRIANGLES} triangles with all copies; {REMEDY}.")
            mirrored = np.linalg.det(placed.linear) < 0.0
            yield (
                found.vertices @ placed.linear + placed.shift,
                found.triangles[:, ::-1] if mirrored else found.triangles,
            )


def _folded(part: str) -> str:
    """Name of a part as the packaging compares them: without regard to case, escapes resolved."""
    return unquote(part).lstrip("/").casefold()


def _events(data: bytes, part: str, *tags: str, starts: bool = False) -> Iterator[Any]:
    """Elements of a part as they end, or the first as it begins."""
    from lxml import etree

    if b"<!DOCTYPE" in data:  # the specification forbids it; entities could fill the memory
        raise UnreadableSolid(f"Part {part} of the 3mf has a document type; {REMEDY}.")
    try:
        for _, element in etree.iterparse(
            io.BytesIO(data),
            events=("start" if starts else "end",),
            tag=tags or None,
            resolve_entities=False,
            no_network=True,
            load_dtd=False,
            huge_tree=True,
        ):
            yield element
    except etree.XMLSyntaxError as error:
        raise UnreadableSolid(f"Part {part} of the 3mf is no whole XML ({error}); {REMEDY}.") from None


def _model(data: bytes, part: str) -> _Model:
    root = next(_events(data, part, starts=True))
    if root.tag != f"{CORE}model":
        raise UnreadableSolid(f"Part {part} of the 3mf is no model of the core specification; {REMEDY}.")
    _refuse_unknown(root, part)
    unit = UNITS.get(root.get("unit", "millimeter"))
    if unit is None:
        raise UnreadableSolid(
            f"Part {part} of the 3mf has the unit '{root.get('unit')}', not one of {', '.join(UNITS)}."
        )
    model = _Model()
    kept = _Object("")
    for element in _events(
        data, part, *(f"{CORE}{name}" for name in ("vertices", "triangles", "component", "object", "item"))
    ):
        name = element.tag.removeprefix(CORE)
        if name == "vertices":
            kept.vertices = unit * _numbers(element, "vertex", ("x", "y", "z"), part)
        elif name == "triangles":
            kept.triangles = _numbers(element, "triangle", ("v1", "v2", "v3"), part).astype(np.int64)
        elif name == "component":
            kept.components.append(_placed(element, part, unit))
            continue  # is needed no more, but its object ends after it
        elif name == "item":
            model.items.append(_placed(element, part, unit))
        else:
            kept.kind = element.get("type", "model")
            number = element.get("id", "")
            if kept.triangles.size and not 0 <= kept.triangles.min() <= kept.triangles.max() < len(kept.vertices):
                raise UnreadableSolid(f"Object {number} in {part} of the 3mf lacks a vertex that it uses; {REMEDY}.")
            model.objects[number] = kept
            kept = _Object("")
        element.clear()  # what was read needs no memory any more
    return model


def _refuse_unknown(root: Any, part: str) -> None:
    """Do nothing if every extension that a model requires is known."""
    for prefix in root.get("requiredextensions", "").split():
        space = root.nsmap.get(prefix)
        if space not in KNOWN:
            named = f"'{prefix}' ({space})" if space else f"'{prefix}', which it does not declare"
            raise UnreadableSolid(
                f"The 3mf requires the extension {named} in {part}, which this program does not know, so that the "
                "triangles alone may not be the part; export it as plain triangles."
            )


def _placed(element: Any, part: str, unit: float) -> _Placed:
    path = element.get(f"{{{PRODUCTION}}}path")
    where = posixpath.join("/", path) if path else part
    number, text = element.get("objectid", ""), element.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0")
    try:
        values = np.array([float(word) for word in text.split()]).reshape(4, 3)
    except ValueError:
        values = np.full((4, 3), np.nan)
    if not (np.isfinite(values).all() and np.linalg.det(values[:3]) != 0.0):
        raise UnreadableSolid(
            f"The transform '{text[:80]}' of object {number} in {part} of the 3mf is none that can be undone; {REMEDY}."
        )
    return _Placed(where, number, values[:3], unit * values[3])


def _numbers(parent: Any, tag: str, names: tuple[str, ...], part: str) -> Floats:
    """Attributes (n, 3) of the children of an element."""
    first, second, third = names
    try:
        found = np.array(
            [
                (float(child[first]), float(child[second]), float(child[third]))
                for child in (element.attrib for element in parent.iterchildren(f"{CORE}{tag}"))
            ]
        ).reshape(-1, 3)
    except (KeyError, ValueError) as error:
        raise UnreadableSolid(f"A {tag} in {part} of the 3mf lacks a number ({error}); {REMEDY}.") from None
    if not np.isfinite(found).all():
        raise UnreadableSolid(f"A {tag} in {part} of the 3mf is not finite; {REMEDY}.")
    return found

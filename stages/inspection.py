"""What a reader finds in the file of a part, written by this program or any other."""

from __future__ import annotations

from dataclasses import dataclass

from actuator.failure import UnreadableSolid
from stages.formats import decode


@dataclass(frozen=True)
class Inspection:
    """What a reader finds in the bytes of a file, after merging equal vertices.

    Attributes:
        format: name of the file's format.
        size: number of bytes.
        vertices, triangles: counts after merging.
        watertight: every edge has exactly two triangles.
        winding_consistent: the two agree on orientation.
        volume: enclosed volume, mm³.
        area: surface area, mm².
        bounding_box: lower and upper corner, mm.
        bodies: volume of every separate body, mm³, largest first; those after the first are floating islands.
        cavities: volume of every enclosed void, mm³, largest first.
        euler_number: vertices - edges + triangles.
    """

    format: str
    size: int
    vertices: int
    triangles: int
    watertight: bool
    winding_consistent: bool
    volume: float
    area: float
    bounding_box: tuple[tuple[float, float, float], tuple[float, float, float]]
    bodies: tuple[float, ...]
    cavities: tuple[float, ...]
    euler_number: int


def inspect(data: bytes, format: str) -> Inspection:
    """Read the bytes of a file of a registered format, of this program or any other, and measure what is in them.

    Raises:
        actuator.failure.UnreadableSolid: if the bytes are no such file, or hold no triangle.
    """
    # trimesh and manifold3d: only where a file is written or read.
    import trimesh

    from actuator.geometry.solid import component_volumes, rounded

    mesh = decode(data, format)
    surface = rounded(mesh.vertices, mesh.faces)
    if not len(surface.triangles):
        raise UnreadableSolid(f"The {format} file holds no triangles; export the part again.")
    merged = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    volumes = component_volumes(surface)
    low, high = merged.bounds.tolist()
    return Inspection(
        format=format,
        size=len(data),
        vertices=len(surface.vertices),
        triangles=len(surface.triangles),
        watertight=bool(merged.is_watertight),
        winding_consistent=bool(merged.is_winding_consistent),
        volume=float(volumes.sum()),
        area=float(merged.area),
        bounding_box=(tuple(low), tuple(high)),
        bodies=tuple(volumes[volumes > 0.0].tolist()),
        cavities=tuple((-volumes[volumes < 0.0][::-1]).tolist()),
        euler_number=int(merged.euler_number),
    )

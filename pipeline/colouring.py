"""The printed shape of a design with a field as colour, for talks: GLB, which any browser shows, or PLY."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyvista
import trimesh
from numpy.typing import NDArray

import stages.mirror
import stages.refine
from pipeline import artifact, atomic
from pipeline.case import stored_case
from pipeline.design import Design, read_design
from pipeline.exit_codes import ExitCode, Fault

Floats = NDArray[np.float64]

FORMATS = (".glb", ".ply")
COLOURS = "viridis"
#: glTF has metres, and Y up where the actuator has X3.
METRES = 1e-3
UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def colour(source: Path, target: Path, field: str, deformed: bool) -> None:
    """Write the refined and mirrored shape of a design, each vertex coloured from 0 to 1.

    Args:
        source: artifact of ``optimize``.
        target: ends in one of :data:`FORMATS`.
        field: ``pressure``, over the source pressure, or ``density``.
        deformed: whether to draw it under pressure.

    Raises:
        Fault: if the source is no such artifact (ARTIFACT), or the target names another format or folder (USAGE).
        OSError: if the disk does not take the file.
    """
    ending = target.suffix.lower()
    if ending not in FORMATS:
        known = " and ".join(FORMATS)
        raise Fault(ExitCode.USAGE, f"{target}: only {known} hold colours; choose one of these endings.")
    if not target.parent.is_dir():
        raise Fault(ExitCode.USAGE, f"{target}: there is no folder {target.parent}; make it or choose another.")
    design = read_design(source)
    case = stored_case(artifact.read_header(source).case_resolved, source)
    fine = stages.refine.run(design.domain, design.chi, case.refine)
    shape = stages.mirror.run(fine.domain, fine.chi, case.mirror)
    found = _sampled(design, shape.vertices)
    vertices = shape.vertices + found["displacement"] if deformed else shape.vertices
    if ending == ".glb":
        vertices = METRES * vertices @ UP.T
    mesh = trimesh.Trimesh(vertices, shape.triangles, process=False)
    mesh.visual.vertex_colors = _colours(found[field])
    data = mesh.export(file_type=ending[1:])
    assert isinstance(data, bytes)
    atomic.write_bytes(target, data)


def _sampled(design: Design, points: Floats) -> dict[str, Floats]:
    """Fields of a design at points of the whole cylinder, (n,) or (n, 3); X2 < 0 is the mirror image."""
    domain = design.domain
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: _vtk_cells(domain.cells)}, domain.points)
    # The fine mesh rounds the cylinder better than the coarse one: points outside take the nearest cell's value.
    grid.point_data["pressure"] = design.pressure
    grid.point_data["density"] = 1.0 / (1.0 + np.exp(-np.clip(design.chi, -50.0, 50.0)))
    grid.point_data["displacement"] = design.displacement
    side = np.where(points[:, 1] < 0.0, -1.0, 1.0)
    half = pyvista.PolyData(points * np.stack([np.ones_like(side), side, np.ones_like(side)], axis=1))
    sampled: Any = half.sample(grid, snap_to_closest_point=True)
    fields = {name: np.asarray(sampled[name], dtype=np.float64) for name in ("pressure", "density", "displacement")}
    fields["displacement"][:, 1] *= side
    return fields


def _vtk_cells(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    from pipeline import vtkhdf

    return np.ascontiguousarray(cells[:, vtkhdf.vtk_order()[:8]])


def _colours(values: Floats) -> NDArray[np.uint8]:
    from matplotlib import colormaps

    return np.asarray(colormaps[COLOURS](np.clip(values, 0.0, 1.0), bytes=True))

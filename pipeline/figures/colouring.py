"""The printed shape of a design with a field as colour, for talks: GLB, which any browser shows, or PLY."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from actuator.arrays import Floats
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.design import read_design
from pipeline.store import atomic

FORMATS = (".glb", ".ply")
COLOURS = "viridis"
#: glTF has metres, and Y up where the actuator has X3.
METRES = 1e-3
UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def colour(source: Path, target: Path, field: str, deformed: bool) -> str:
    """Write the refined and mirrored shape of a design, each vertex coloured from 0 to 1.

    Args:
        source: artifact of ``optimize``, or a checkpoint.
        target: ends in one of :data:`FORMATS`.
        field: ``pressure``, over the source pressure, or ``density``.
        deformed: whether to draw it under pressure.

    Returns:
        What is to be said of a design that is unfinished, else nothing.

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
    shape = design.shape
    found, moved = design.fields_at(shape.vertices)
    vertices = shape.vertices + moved if deformed else shape.vertices
    if ending == ".glb":
        vertices = METRES * vertices @ UP.T
    mesh = trimesh.Trimesh(vertices, shape.triangles, process=False)
    mesh.visual.vertex_colors = _colours(found[field])
    data = mesh.export(file_type=ending[1:])
    assert isinstance(data, bytes)
    atomic.write_bytes(target, data)
    return design.label


def _colours(values: Floats) -> NDArray[np.uint8]:
    from matplotlib import colormaps

    return np.asarray(colormaps[COLOURS](np.clip(values, 0.0, 1.0), bytes=True))

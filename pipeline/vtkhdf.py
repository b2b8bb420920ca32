"""The ``/VTKHDF`` group, by which ParaView and other VTK readers find mesh and fields inside an artifact.

VTKHDF 2.0, UnstructuredGrid with time steps:
https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.atomic import replacing_hdf5

if TYPE_CHECKING:  # slow to load: h5py is imported where a file is written, scikit-fem where a mesh is
    import h5py

    from actuator.domain import HalfCylinder

#: VTK's cell types (vtkCellType.h).
TRIANGLE, HEXAHEDRON, QUADRATIC_HEXAHEDRON = 5, 12, 25
CELL_NODES = {TRIANGLE: 3, HEXAHEDRON: 8, QUADRATIC_HEXAHEDRON: 20}

# scikit-fem's own order gives VTK a left-handed cell when the mesh is right-handed, as HalfCylinder is: its default
# reference mesh is left-handed. Exchanging the first and the last face (corners, then their edges) mirrors it.
_SWAPPED_FACES = [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]


@dataclass(frozen=True)
class Grid:
    """A mesh of one cell type with fields on its points.

    Attributes:
        points: (n_points, 3), mm.
        connectivity: nodes of one cell after the other in VTK's order, (n_cells * nodes per cell,).
        cell_type: VTK's number.
        fields: name -> (n_points,) or (n_points, 3).
    """

    points: NDArray[np.float64]
    connectivity: NDArray[np.int64]
    cell_type: int
    fields: Mapping[str, NDArray[np.float64]]

    @property
    def cells(self) -> NDArray[np.int64]:
        """Nodes of every cell, (n_cells, nodes per cell)."""
        return self.connectivity.reshape(-1, CELL_NODES[self.cell_type])


@dataclass(frozen=True)
class GridPaths:
    """Where the arrays of a :class:`Grid` lie inside an artifact."""

    points: str
    connectivity: str
    cell_type: int
    fields: Mapping[str, str]


@cache
def vtk_order() -> NDArray[np.int64]:
    """Where VTK's 20 nodes of a hexahedron, the 8 corners first, stand in scikit-fem's order."""
    from skfem.io.meshio import HEX_MAPPING

    return np.array(HEX_MAPPING[:20], dtype=np.int64)[_SWAPPED_FACES]


def on_nodes(domain: HalfCylinder, vertex_field: NDArray[np.float64]) -> NDArray[np.float64]:
    """A field of the vertices on the nodes of the 20-node cells: on an edge, the mean of its ends."""
    return np.concatenate([vertex_field, vertex_field[domain.mesh.edges].mean(axis=0)])


def write(file: h5py.File, grid: GridPaths) -> None:
    """Add the group to a file that holds the arrays of a grid; they are linked, not copied."""
    import h5py

    group = file.create_group("VTKHDF")
    group.attrs["Version"] = np.array([2, 0], dtype=np.int64)
    group.attrs.create("Type", np.bytes_(b"UnstructuredGrid"))
    n_points, n_ids = len(file[grid.points]), len(file[grid.connectivity])
    n_cells = n_ids // CELL_NODES[grid.cell_type]
    group["Points"] = h5py.SoftLink(grid.points)
    group["Connectivity"] = h5py.SoftLink(grid.connectivity)
    offsets = np.arange(n_cells + 1, dtype=np.int64) * CELL_NODES[grid.cell_type]
    group.create_dataset("Offsets", data=offsets, compression="gzip")
    group.create_dataset("Types", data=np.full(n_cells, grid.cell_type, dtype=np.uint8), compression="gzip")
    for name, count in (("Points", n_points), ("Cells", n_cells), ("ConnectivityIds", n_ids)):
        group[f"NumberOf{name}"] = np.array([count], dtype=np.int64)
    fields = group.create_group("PointData")
    for name, path in grid.fields.items():
        fields[name] = h5py.SoftLink(path)
    _steps(group, list(grid.fields))


def _steps(group: h5py.Group, fields: list[str]) -> None:
    """One time step, the final state, with every offset the format knows."""
    steps = group.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(1)
    steps["Values"] = np.zeros(1)
    steps["NumberOfParts"] = np.ones(1, dtype=np.int64)
    for name in ("PartOffsets", "PointOffsets"):
        steps[name] = np.zeros(1, dtype=np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):  # one column per topology
        steps[name] = np.zeros((1, 1), dtype=np.int64)
    offsets = steps.create_group("PointDataOffsets")
    for name in fields:
        offsets[name] = np.zeros(1, dtype=np.int64)


def read(file: h5py.File) -> Grid:
    """The grid of a file, with the arrays themselves."""
    group = file["VTKHDF"]
    return Grid(
        points=group["Points"][()],
        connectivity=group["Connectivity"][()],
        cell_type=int(group["Types"][0]),
        fields={name: dataset[()] for name, dataset in group["PointData"].items()},
    )


def write_sidecar(artifact: Path) -> Path:
    """Write the tiny ``.vtkhdf`` beside an artifact that ParaView opens; returns its path.

    ParaView gives the ending ``.h5`` to another reader.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    import h5py

    path = sidecar(artifact)
    with replacing_hdf5(path) as file:
        file["VTKHDF"] = h5py.ExternalLink(artifact.name, "/VTKHDF")
    return path


def sidecar(artifact: Path) -> Path:
    """The file that ParaView opens for an artifact."""
    return artifact.with_suffix(".vtkhdf")

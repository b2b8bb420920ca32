"""The ``/VTKHDF`` group, by which ParaView and other VTK readers find mesh and fields inside an artifact.

VTKHDF 2.0, UnstructuredGrid with time steps:
https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.store.atomic import replacing_hdf5
from stages.datasets import CELL_NODES, GridPaths

if TYPE_CHECKING:  # slow to load: imported where a file is written
    import h5py

#: The grid of a file, and its series: the design updates of an optimisation.
GROUP, SERIES = "VTKHDF", "updates/VTKHDF"


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


def write(file: h5py.File, grid: GridPaths) -> None:
    """Add the group to a file that holds the arrays of a grid; they are linked, not copied."""
    if grid.series:
        _write(file, grid.series, SERIES)
    _write(file, grid, GROUP)


def _write(file: h5py.File, grid: GridPaths, name: str) -> None:
    import h5py

    group = file.create_group(name)
    group.attrs["Version"] = np.array([2, 0], dtype=np.int64)
    group.attrs.create("Type", np.bytes_(b"UnstructuredGrid"))
    n_points = len(file[grid.points]) if grid.n_points is None else grid.n_points
    n_ids = len(file[grid.connectivity])
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
    changing = {name: len(file[path]) > n_points for name, path in grid.fields.items()}
    _steps(group, grid.times, n_points, changing)


def _steps(group: h5py.Group, times: tuple[float, ...], n_points: int, changing: Mapping[str, bool]) -> None:
    """The time steps, with every offset the format knows; the mesh is the same in all of them."""
    count = len(times)
    steps = group.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(count)
    steps["Values"] = np.array(times, dtype=np.float64)
    steps["NumberOfParts"] = np.ones(count, dtype=np.int64)
    for name in ("PartOffsets", "PointOffsets"):
        steps[name] = np.zeros(count, dtype=np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):  # one column per topology
        steps[name] = np.zeros((count, 1), dtype=np.int64)
    offsets = steps.create_group("PointDataOffsets")
    for name, changes in changing.items():
        offsets[name] = np.arange(count, dtype=np.int64) * (n_points if changes else 0)


def read(file: h5py.File) -> Grid:
    """The grid of a file, with the arrays themselves; of several time steps the last.

    Raises:
        ValueError: if they do not fit each other.
        KeyError: if one is missing.
    """
    group = file[GROUP]
    points, connectivity, kind = group["Points"][()], group["Connectivity"][()], int(group["Types"][0])
    fields = {name: dataset[-len(points) :] for name, dataset in group["PointData"].items()}
    whole = connectivity.size and not connectivity.size % CELL_NODES[kind] and connectivity.max() < len(points)
    if not whole or any(len(values) != len(points) for values in fields.values()):
        raise ValueError("mesh and fields do not fit each other")
    return Grid(points, connectivity, kind, fields)


def write_sidecar(artifact: Path) -> None:
    """Write the tiny ``.vtkhdf`` beside an artifact that ParaView opens, if it has a grid.

    ParaView gives the ending ``.h5`` to another reader. The file shows the series if the artifact has one.

    Raises:
        OSError: if the folder or the disk does not take the file.
    """
    import h5py

    with h5py.File(artifact, "r") as written:
        shown = next((name for name in (SERIES, GROUP) if name in written), None)
    if shown:
        with replacing_hdf5(sidecar(artifact)) as file:
            file[GROUP] = h5py.ExternalLink(artifact.name, f"/{shown}")


def sidecar(artifact: Path) -> Path:
    """The file that ParaView opens for an artifact."""
    return artifact.with_suffix(".vtkhdf")

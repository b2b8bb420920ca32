"""What a stage's artifact holds, described without a file: arrays with units, the grids they form, and a summary.

A stage packs its result with these beside its ``run``; the pipeline only writes them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator.arrays import Floats, Ints
from actuator.failure import InvalidField

if TYPE_CHECKING:  # scikit-fem: only where a mesh is
    from actuator.domains.interface import Domain

#: VTK's cell types (vtkCellType.h).
TRIANGLE, HEXAHEDRON, QUADRATIC_TETRAHEDRON, QUADRATIC_HEXAHEDRON = 5, 12, 24, 25
CELL_NODES = {TRIANGLE: 3, HEXAHEDRON: 8, QUADRATIC_TETRAHEDRON: 10, QUADRATIC_HEXAHEDRON: 20}

# scikit-fem's own order gives VTK a left-handed cell when the mesh is right-handed, as those of all domains are: its
# default reference mesh is left-handed. Exchanging the first and the last face (corners, then their edges) mirrors it.
_SWAPPED_FACES = [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]


@dataclass(frozen=True)
class Dataset:
    """An array with its unit and meaning."""

    values: ArrayLike
    units: str
    description: str


@dataclass(frozen=True)
class GridPaths:
    """Where the arrays of a grid lie inside an artifact.

    Attributes:
        points: (n_points, 3), mm.
        connectivity: nodes of one cell after the other in VTK's order.
        cell_type: VTK's number.
        fields: name -> dataset with one value per point.
        times: one for each time step; a field with one value per point and step holds the steps one after the other,
            a field with one value per point does not change.
        n_points: how many of the points, the first ones, belong to the grid; all of them if None.
        series: another grid that sidecars show instead of this one.
    """

    points: str
    connectivity: str
    cell_type: int
    fields: Mapping[str, str]
    times: tuple[float, ...] = (0.0,)
    n_points: int | None = None
    series: GridPaths | None = None


@dataclass(frozen=True)
class Product:
    """A file of its own that a stage makes; its artifact is the record beside it.

    Attributes:
        data: the bytes.
        flaw: why they must not be written, with the remedy, as the end of a sentence; empty if nothing is wrong.
        inspected: given the bytes as they were read back, entries for the summary, and what is wrong with them, with
            the remedy; empty if nothing is.
    """

    data: bytes
    flaw: str
    inspected: Callable[[bytes], tuple[dict[str, Any], str]]


@dataclass(frozen=True)
class Packed:
    """The result of a stage, ready to be stored.

    Attributes:
        summary: nested values for people and programs; ``finished`` is false if the user interrupted the stage.
        datasets: by their path inside the artifact.
        grid: which of them VTK readers shall find, if any.
        product: the file that the stage makes, if it makes one.
    """

    summary: Mapping[str, Any]
    datasets: Mapping[str, Dataset] = field(default_factory=dict)
    grid: GridPaths | None = None
    product: Product | None = None


class Source(Protocol):
    """The artifact that a stage works on."""

    def read(self, *names: str) -> list[Any]:
        """Datasets by their path inside it; floating-point ones are finite."""

    def read_group(self, group: str) -> dict[str, Any]:
        """All datasets of a group by name; floating-point ones are finite."""


@cache
def vtk_order() -> NDArray[np.int64]:
    """Where VTK's 20 nodes of a hexahedron, the 8 corners first, stand in scikit-fem's order."""
    from skfem.io.meshio import HEX_MAPPING

    return np.array(HEX_MAPPING[:20], dtype=np.int64)[_SWAPPED_FACES]


def on_nodes(domain: Domain, vertex_field: Floats) -> Floats:
    """A field of the vertices on the nodes of the 20-node cells: on an edge, the mean of its ends."""
    return np.concatenate([vertex_field, vertex_field[domain.mesh.edges].mean(axis=0)])


def nodes(domain: Domain, group: str) -> dict[str, Dataset]:
    """Points and connectivity of the 20-node cells, in a group of the artifact."""
    return {
        f"{group}/points": Dataset(domain.nodes, "mm", "undeformed nodes of the 20-node cells, the vertices first"),
        f"{group}/connectivity": Dataset(
            domain.node_cells[:, vtk_order()].ravel(), "1", "nodes of the cells, 20 each, in VTK's order"
        ),
    }


def corners(domain: Domain) -> Dataset:
    """Connectivity of the cells without the nodes on their edges."""
    cells = domain.cells[:, vtk_order()[:8]].astype(np.int64)
    return Dataset(cells.ravel(), "1", "vertices of the cells, 8 each, in VTK's order")


def of_domain(domain: Domain) -> dict[str, Dataset]:
    """What a domain is made from; :func:`design` makes it again."""
    return {
        "domain/shape": Dataset(domain.shape, "", "which design domain"),
        **{f"domain/{name}": Dataset(*parameter) for name, parameter in domain.parameters.items()},
    }


def design(source: Source) -> tuple[Domain, Floats]:
    """Domain and χ at its vertices, (n_vertices,), from an artifact that holds a design.

    Raises:
        actuator.failure.InvalidField: if nobody registered the domain, or the field does not fit it.
    """
    from stages.domains import DOMAINS  # settings: only where a stage works on the design

    (chi,) = source.read("vertices/chi")
    stored = source.read_group("domain")
    shape = stored.pop("shape", "without a name")
    if shape not in DOMAINS:
        known = ", ".join(DOMAINS)
        raise InvalidField(f"its design domain, {shape}, is none of {known}; register it, or make the file again.")
    try:
        made_from = {name: value if np.ndim(value) else value.item() for name, value in stored.items()}
        domain = DOMAINS[shape].domain_type()(**made_from)
    except (TypeError, ValueError):
        raise InvalidField(f"its {shape} is not described as it should be; make the file again.") from None
    if chi.shape != (len(domain.points),):
        raise InvalidField("its design field does not fit its mesh; make the file again.")
    return domain, chi


def surface(source: Source) -> tuple[Floats, Ints]:
    """Vertices (n, 3), mm, and triangles (m, 3) from an artifact that holds a surface.

    Raises:
        actuator.failure.InvalidField: if they are no triangles between its points.
    """
    points, connectivity = source.read("surface/points", "surface/connectivity")
    if connectivity.size % 3 or not connectivity.size or connectivity.max() >= len(points):
        raise InvalidField("its surface is not whole; make the file again.")
    return points, connectivity.reshape(-1, 3)

"""Meshes as other programs write them, made of a domain's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from stages.datasets import vtk_order

NAMES = ("fixed", "tip", "symmetry")


def hexahedra(domain: Domain) -> Any:
    """Cells in the order of VTK, Gmsh and Abaqus."""
    return domain.cells[:, vtk_order()[:8]].astype(np.int64)


def write(
    path: Path, domain: Domain, points: Floats | None = None, names: tuple[str, ...] = NAMES, **more: Any
) -> None:
    """Write a mesh with its sets: node sets in .inp, arrays of the points in .vtu, physical surfaces in .msh.

    Args:
        path: its ending says which.
        domain: whose mesh it is.
        points: in place of the domain's.
        names: of the sets.
        more: ``inlet``, vertices of that set.
    """
    places = domain.points if points is None else points
    cells = hexahedra(domain)
    vertices = {name: getattr(domain, name).vertices for name in names} | more
    if path.suffix == ".inp":
        meshio.Mesh(places, [("hexahedron", cells)], point_sets=vertices).write(path)
    elif path.suffix == ".vtu":
        marks = {name: np.isin(np.arange(len(places)), found).astype(int) for name, found in vertices.items()}
        meshio.Mesh(places, [("hexahedron", cells)], point_data=marks).write(path)
    else:
        blocks, tags, fields = [("hexahedron", cells)], [np.zeros(len(cells), int)], {}
        for tag, name in enumerate(names, 1):
            quads = around(domain, getattr(domain, name).facets)
            blocks.append(("quad", quads))
            tags.append(np.full(len(quads), tag))
            fields[name] = np.array([tag, 2])
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        meshio.Mesh(places, blocks, cell_data=data, field_data=fields).write(path, file_format="gmsh22", binary=False)


def around(domain: Domain, facets: Any) -> Any:
    """Vertices of facets in an order that goes around them: those of the cell's edges."""
    edges = {tuple(pair) for pair in np.sort(domain.edges, axis=1).tolist()}
    found = []
    for corners in domain.mesh.facets[:, facets].T.tolist():
        first, *others = corners
        neighbours = [other for other in others if tuple(sorted((first, other))) in edges]
        (opposite,) = set(others) - set(neighbours)
        found.append([first, neighbours[0], opposite, neighbours[1]])
    return np.array(found)

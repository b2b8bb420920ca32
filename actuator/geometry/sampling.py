"""Fields of a domain, or of the half that is modelled, at any points of the whole."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator.arrays import Floats, Ints

#: Changes the side of the symmetry plane X2 = 0.
MIRROR = np.array([1.0, -1.0, 1.0])


def sampled(
    vertices: Floats, cells: Ints, points: Floats, scalars: dict[str, Floats], vector: Floats, *, mirrored: bool
) -> tuple[dict[str, Floats], Floats]:
    """Interpolate vertex fields at points, by VTK.

    Args:
        vertices: of the mesh, (n_vertices, 3), mm.
        cells: vertices of its hexahedra, (n_cells, 8), in VTK's order.
        points: (n, 3), mm; those outside of all cells, beyond a facet of the wall, take the nearest place's values.
        scalars: by name, (n_vertices,) each.
        vector: (n_vertices, 3).
        mirrored: whether the mesh is that of the half X2 >= 0, and what lies at X2 < 0 its mirror image.

    Returns:
        The scalars, (n,) each, and the vector, (n, 3), at the points.
    """
    import pyvista  # slow to load: only where something is sampled

    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: np.ascontiguousarray(cells)}, vertices)
    names = {f"scalar {name}": values for name, values in scalars.items()} | {"vector": vector}
    for name, values in names.items():
        grid.point_data[name] = values
    image = (mirrored & (points[:, 1] < 0.0))[:, None]
    places = np.where(image, points * MIRROR, points)
    found = _probe(grid, places)
    outside = found["vtkValidPointMask"] == 0
    if outside.any():
        _, nearest = grid.find_closest_cell(places[outside], return_closest_point=True)
        places[outside] = nearest
        found = _probe(grid, places)
    moved = np.asarray(found["vector"], dtype=np.float64)
    return (
        {name: np.asarray(found[f"scalar {name}"], dtype=np.float64) for name in scalars},
        np.where(image, moved * MIRROR, moved),
    )


def _probe(grid: Any, places: Floats) -> Any:
    import pyvista  # as in sampled

    return pyvista.PolyData(places).sample(grid, snap_to_closest_point=True)

"""What VTK draws: run with two arguments, what :func:`pipeline.figures.offscreen.pictures` packed and where they go."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyvista


def _draw(shot: Mapping[str, Any], arrays: Mapping[str, Any]) -> Any:
    """One picture, (height, width, 4)."""
    plotter = pyvista.Plotter(off_screen=True, window_size=shot["size"])
    for look in shot["pieces"]:
        vertices, normals, triangles = (
            arrays[f"{look['name']} {what}"] for what in ("vertices", "normals", "triangles")
        )
        mesh = pyvista.PolyData.from_regular_faces(vertices, triangles)
        mesh.point_data.active_normals = normals
        light = {"ambient": 0.25, "diffuse": 0.8, "specular": 0.1, "specular_power": 20, "lighting": look["lit"]}
        if "colours" in look:
            colours = {
                "scalars": arrays[f"{look['name']} values"],
                "cmap": look["colours"],
                "clim": (0.0, look["high"]),
            }
        else:
            colours = {"color": look["colour"]}
        plotter.add_mesh(mesh, smooth_shading=True, show_scalar_bar=False, **colours, **light)
    left, right, bottom, top = shot["extent"]
    rows = np.array(shot["rows"])
    middle = 0.5 * (left + right) * rows[0] + 0.5 * (bottom + top) * rows[1]
    plotter.enable_parallel_projection()
    # The distance decides nothing in a parallel projection, and the planes of clipping follow what is there.
    plotter.camera_position = [middle + 10.0 * (right - left + top - bottom) * rows[2], middle, rows[1]]
    plotter.camera.parallel_scale = 0.5 * (top - bottom)
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    picture = plotter.screenshot(return_img=True, transparent_background=True)
    plotter.close()
    return picture


def main(given: Path, target: Path) -> None:
    """Draw all shots."""
    with np.load(given, allow_pickle=False) as arrays:
        drawn = {str(number): _draw(shot, arrays) for number, shot in enumerate(json.loads(str(arrays["plan"])))}
    np.savez(target, allow_pickle=False, **drawn)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))

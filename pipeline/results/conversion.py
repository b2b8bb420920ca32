"""Mesh and fields of an artifact in the formats of other programs, by meshio."""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any

import meshio

from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact
from stages.datasets import HEXAHEDRON, QUADRATIC_HEXAHEDRON, QUADRATIC_TETRAHEDRON, TRIANGLE

_CELLS = {
    TRIANGLE: "triangle",
    HEXAHEDRON: "hexahedron",
    QUADRATIC_HEXAHEDRON: "hexahedron20",
    QUADRATIC_TETRAHEDRON: "tetra10",
}


def convert(source: Path, target: Path) -> None:
    """Write the mesh and fields of an artifact; the ending of the target decides the format.

    Raises:
        Fault: if the source is no artifact with a mesh (ARTIFACT), or the target's format is unknown or cannot hold
            the mesh (USAGE).
        OSError: if the disk does not take the file.
    """
    formats = meshio.extension_to_filetypes.get(target.suffix.lower())
    if not formats:
        known = " ".join(sorted(meshio.extension_to_filetypes))
        raise Fault(ExitCode.USAGE, f"{target}: the ending '{target.suffix}' names no format; use one of {known}.")
    if not target.parent.is_dir():
        raise Fault(ExitCode.USAGE, f"{target}: there is no folder {target.parent}; make it or choose another.")
    grid = artifact.read_grid(source)
    mesh = meshio.Mesh(grid.points, [(_CELLS[grid.cell_type], grid.cells)], point_data=dict(grid.fields))
    # In a folder of its own, since some formats write further files.
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".convert-") as folder:
        written = Path(folder) / target.name
        problems = []
        for format in formats:
            problem = _written(mesh, written, format)
            if not problem:
                break
            problems.append(problem)
        else:
            reason = "; ".join(problems)
            raise Fault(
                ExitCode.USAGE,
                f"{target}: {target.suffix} cannot hold this mesh ({reason}); use another format, such as .vtu.",
            )
        for path in Path(folder).iterdir():
            if path != written and (target.parent / path.name).exists():
                raise Fault(ExitCode.USAGE, f"{target}: would also overwrite {path.name}; choose another name.")
        for path in Path(folder).iterdir():
            path.replace(target.parent / path.name)


def _written(mesh: Any, path: Path, format: str) -> str:
    """Write in one format and read back, since some writers drop the cells they do not know; returns the problem."""
    # XDMF would put its arrays into an .h5 of the artifact's name.
    options = {"data_format": "XML"} if format == "xdmf" else {}
    said = io.StringIO()
    try:
        # meshio speaks on standard output, where only results belong.
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            meshio.write(path, mesh, file_format=format, **options)
            found = meshio.read(path, file_format=format)
    except (Exception, SystemExit) as error:  # meshio's writers and readers raise whatever they meet
        return str(error).strip('"') or type(error).__name__
    return "" if sum(len(block.data) for block in found.cells) == len(mesh.cells[0].data) else "cells would be lost"

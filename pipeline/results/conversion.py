"""Mesh and fields of an artifact in the formats of other programs, by meshio."""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.design import read_design
from pipeline.store import artifact
from pipeline.store.vtkhdf import Grid
from stages.datasets import HEXAHEDRON, QUADRATIC_HEXAHEDRON, QUADRATIC_TETRAHEDRON, TRIANGLE
from stages.design import pack

_CELLS = {
    TRIANGLE: "triangle",
    HEXAHEDRON: "hexahedron",
    QUADRATIC_HEXAHEDRON: "hexahedron20",
    QUADRATIC_TETRAHEDRON: "tetra10",
}


def convert(source: Path, target: Path) -> str:
    """Write the mesh and fields of an artifact or a checkpoint; the ending of the target decides the format.

    Returns:
        What is to be said of a design that is unfinished, else nothing.

    Raises:
        Fault: if the source is no artifact with a mesh (ARTIFACT), or the target's format is unknown or cannot hold
            the mesh (USAGE).
        OSError: if the disk does not take the file.
    """
    known = sorted(meshio.extension_to_filetypes, key=len, reverse=True)
    ending = next((each for each in known if target.name.lower().endswith(each)), None)
    if not ending:
        others = "with --colour also .glb, and `poro export --format 3mf` writes solids"
        raise Fault(
            ExitCode.USAGE,
            f"{target}: the ending '{target.suffix}' names no format of meshes; use one of {' '.join(sorted(known))} "
            f"({others}).",
        )
    if not target.parent.is_dir():
        raise Fault(ExitCode.USAGE, f"{target}: there is no folder {target.parent}; make it or choose another.")
    grid, label = _grid(source)
    mesh = meshio.Mesh(grid.points, [(_CELLS[grid.cell_type], grid.cells)], point_data=dict(grid.fields))
    # In a folder of its own, since some formats write further files.
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".convert-") as folder:
        written = Path(folder) / target.name
        problems = []
        for format in meshio.extension_to_filetypes[ending]:
            problem = _written(mesh, written, format)
            if not problem:
                break
            problems.append(problem)
        else:
            raise Fault(ExitCode.USAGE, f"{target}: {ending} {problems[0]}; use another format, such as .vtu.")
        for path in Path(folder).iterdir():
            if path != written and (target.parent / path.name).exists():
                raise Fault(ExitCode.USAGE, f"{target}: would also overwrite {path.name}; choose another name.")
        for path in Path(folder).iterdir():
            path.replace(target.parent / path.name)
    return label


def _grid(source: Path) -> tuple[Grid, str]:
    """Mesh and fields of an artifact, or of the state of a checkpoint and what is to be said of it."""
    if artifact.read_header(source).stage != artifact.CHECKPOINT:
        return artifact.read_grid(source), ""
    design = read_design(source)
    packed = pack(design)
    assert packed.grid

    def found(path: str) -> Any:
        return np.asarray(packed.datasets[path.removeprefix("/")].values)

    fields = {name: found(path) for name, path in packed.grid.fields.items()}
    return Grid(found(packed.grid.points), found(packed.grid.connectivity), packed.grid.cell_type, fields), design.label


def _written(mesh: Any, path: Path, format: str) -> str:
    """Write in one format and read back, since some writers drop the cells they do not know; returns the problem."""
    # XDMF would put its arrays into an .h5 of the artifact's name.
    options = {"data_format": "XML"} if format == "xdmf" else {}
    cannot = f"cannot hold cells of {mesh.cells[0].data.shape[1]} points in space"
    said = io.StringIO()
    try:
        # meshio speaks on standard output, where only results belong.
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            meshio.write(path, mesh, file_format=format, **options)
            found = meshio.read(path, file_format=format)
    except ImportError as error:
        return f"needs the Python package {error.name}, which is not installed"
    except OSError as error:
        if error.errno:  # of the disk, not of a reader that finds nothing
            raise
        return cannot
    except (Exception, SystemExit):  # meshio's writers and readers raise whatever they meet
        return cannot
    return "" if sum(len(block.data) for block in found.cells) == len(mesh.cells[0].data) else cannot

"""The mesh that a case names as its domain: found, read by meshio, checked, and known by what it holds."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.case import text as case_text
from pipeline.case.model import Case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact, contents
from pipeline.store.files import located
from stages.datasets import vtk_order
from stages.domains import MeshSettings

if TYPE_CHECKING:
    from actuator.domains.own_mesh import OwnMesh

#: Names of the sets.
SETS = ("fixed", "tip", "symmetry", "outside", "inlet")
#: Cells that may stand beside the hexahedra, as those of sets or of the geometry.
BESIDE = ("vertex", "line", "quad")


def with_mesh(case: Case, argument: Path, text: str) -> Case:
    """The case with the mesh that it names, where it names one.

    Args:
        case: the case.
        argument: its file, for messages.
        text: of that file, as far as it is known.

    Raises:
        Fault: if the file cannot be used or is not the one that the case means, with the line that names it.
    """
    settings = case.domain
    if not isinstance(settings, MeshSettings) or settings.file is None:
        return case
    line = f":{case_text.parse(text.encode(), str(argument)).line(('domain', 'file'))}" if text else ""
    place, file = f"{argument}{line}: domain.file:", located(Path(settings.file))
    try:
        mesh = read(file, settings)
    except Fault as fault:
        raise Fault(fault.code, f"{place} {fault}") from None
    digest = _digest(mesh)
    if settings.sha256 not in (None, digest):
        raise Fault(
            ExitCode.USAGE,
            f"{place} what {file} holds is not what domain.sha256 says but {digest}; give the file that is meant, or "
            "leave that key out.",
        )
    named = settings.model_copy(update={"file": str(file)})
    return case.model_copy(update={"domain": named.holding(mesh, digest)})


def of_artifact(case: Case, path: Path, stage: str) -> Case:
    """The case with the mesh that its own result holds, so that the file is not asked for again; a checkpoint has none.

    Raises:
        Fault: if the artifact does not hold it (ARTIFACT), or the checkpoint's file is not as it was.
    """
    settings = case.domain
    if not isinstance(settings, MeshSettings) or settings.sha256 is None:
        return case
    if stage == artifact.CHECKPOINT:
        return with_mesh(case, path, "")
    if stage != "optimize":
        return case
    mesh: Any = contents.design(path, stage)[0]
    return case.model_copy(update={"domain": settings.holding(mesh, settings.sha256)})


def read(file: Path, settings: MeshSettings) -> OwnMesh:
    """The domain that a file holds.

    Raises:
        Fault: if it cannot be read (ARTIFACT) or is no domain (USAGE).
    """
    import meshio  # slow to load

    from actuator.domains.own_mesh_checks import Unusable, checked  # scikit-fem

    if not file.is_file():
        raise Fault(ExitCode.USAGE, f"there is no file {file}; give the path of a mesh.")
    try:
        found = meshio.read(file)
    # What meshio's readers raise on a broken file is of many kinds; they also end the process.
    except (Exception, SystemExit) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        sentence = f"{file} cannot be read as a mesh ({reason}); give one that meshio reads."
        raise Fault(ExitCode.ARTIFACT, sentence) from None
    kinds = {block.type for block in found.cells}
    if other := sorted(kinds - {"hexahedron", *BESIDE}):
        raise Fault(
            ExitCode.USAGE, f"{file} has cells of the type {', '.join(other)}; mesh it by 8-node hexahedra alone."
        )
    if "hexahedron" not in kinds:
        raise Fault(ExitCode.USAGE, f"{file} has no hexahedra; mesh it by 8-node hexahedra.")
    hexahedra = np.concatenate([block.data for block in found.cells if block.type == "hexahedron"]).astype(np.int64)
    # Vertices of the geometry alone, such as centres of arcs, are no part of the mesh.
    used, numbered = np.unique(hexahedra, return_inverse=True)
    places = np.full(len(found.points), -1)
    places[used] = np.arange(len(used))
    cells = numbered.reshape(-1, 8)[:, np.argsort(vtk_order()[:8])]
    try:
        sets = {name: places[corners] for name, corners in _sets(found)}
        return checked(
            np.array(found.points[used], dtype=np.float64),
            cells,
            {name: corners[corners >= 0] if corners.ndim == 1 else corners for name, corners in sets.items()},
            length=settings.length,
            radius=settings.radius or 0.0,
            inlet_height=settings.inlet_height,
        )
    except Unusable as failure:
        raise Fault(ExitCode.USAGE, f"{file} {failure}.") from None


def _sets(found: Any) -> Iterator[tuple[str, Any]]:
    """The sets that a domain asks for: facets by their vertices (k, 4), or vertices (k,)."""
    physical = {int(tag): name for name, (tag, _) in found.field_data.items()}
    for name in SETS:
        corners: list[Any] = []
        tags = [tag for tag, other in physical.items() if other == name]
        for block, cells in enumerate(found.cells):
            if cells.type not in ("quad", "hexahedron"):
                continue
            inside = np.zeros(len(cells.data), dtype=bool)
            if name in found.cell_sets and found.cell_sets[name][block] is not None:
                inside[np.asarray(found.cell_sets[name][block], dtype=np.int64)] = True
            if "gmsh:physical" in found.cell_data:
                inside |= np.isin(found.cell_data["gmsh:physical"][block], tags)
            if name in found.cell_data:
                inside |= np.asarray(found.cell_data[name][block]) != 0
            if inside.any():
                corners.append(cells.data[inside])
        if corners and name != "inlet" and {each.shape[1] for each in corners} == {4}:
            yield name, np.concatenate(corners)
        elif corners:
            yield name, np.unique(np.concatenate([each.ravel() for each in corners]))
        elif name in found.point_sets:
            yield name, np.asarray(found.point_sets[name], dtype=np.int64)
        elif name in found.point_data:
            yield name, np.flatnonzero(np.asarray(found.point_data[name]))


def _digest(mesh: OwnMesh) -> str:
    """sha256 of all that the domain is made from."""
    found = hashlib.sha256()
    for name, parameter in mesh.parameters.items():
        found.update(name.encode() + np.asarray(parameter.value).tobytes())
    return found.hexdigest()

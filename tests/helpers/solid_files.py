"""Files of solids that are put together by hand, as programs write them and as they should not."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import trimesh

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"


def cube(size: float = 10.0, *corner: float) -> trimesh.Trimesh:
    """A cube with its lowest corner at a place, by default the origin."""
    place = np.array(corner or (0.0, 0.0, 0.0)) + 0.5 * size
    return trimesh.creation.box((size,) * 3, trimesh.transformations.translation_matrix(place))


def stl(*solids: trimesh.Trimesh) -> bytes:
    """Binary."""
    data: bytes = trimesh.util.concatenate(solids).export(file_type="stl")
    return data


def ascii_stl(*solids: trimesh.Trimesh) -> str:
    """One solid each."""
    lines = []
    for number, solid in enumerate(solids):
        lines.append(f"solid part {number}")
        for corners in solid.triangles:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid part {number}")
    return "\n".join(lines) + "\n"


def mesh_object(number: int, solid: trimesh.Trimesh, kind: str = "model") -> str:
    """An object of 3MF that has triangles."""
    vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in solid.vertices)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in solid.faces)
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"
    return f'<object id="{number}" type="{kind}">{mesh}</object>'


def model(resources: str, build: str, attributes: str = 'unit="millimeter"') -> str:
    """A model part of 3MF."""
    head = f'<model xmlns="{CORE}" xmlns:p="{PRODUCTION}" {attributes}>'
    return f'<?xml version="1.0"?>{head}<resources>{resources}</resources><build>{build}</build></model>'


def threemf(root: str, **others: str) -> bytes:
    """A package; other parts are 3D/Objects/NAME.model."""
    space = "http://schemas.openxmlformats.org/package/2006"
    kind = f'Type="{CORE.replace("core/2015/02", "2013/01")}/3dmodel"'
    inner = "".join(f'<Relationship Target="/3D/Objects/{name}.model" Id="{name}" {kind}/>' for name in others)
    outer = f'<Relationship Target="/3D/3dmodel.model" Id="r" {kind}/>'
    rels, inner_rels = (f'<Relationships xmlns="{space}/relationships">{r}</Relationships>' for r in (outer, inner))
    kinds = '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    kinds += '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{space}/content-types">{kinds}</Types>',
        "_rels/.rels": rels,
        "3D/_rels/3dmodel.model.rels": inner_rels,
        "3D/3dmodel.model": root,
    }
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in (parts | {f"3D/Objects/{name}.model": text for name, text in others.items()}).items():
            archive.writestr(name, text)
    return found.getvalue()

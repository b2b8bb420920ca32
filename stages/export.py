"""Stage ``export``: a proved 2-manifold, scaled, as the bytes of an STL or 3MF file that were read back and checked."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from actuator.arrays import Floats, Ints
from actuator.failure import LooseBodies
from stages import check
from stages.datasets import Packed, Product, surface
from stages.events import Message, Observer, silent
from stages.formats import FORMATS
from stages.inspection import inspect
from stages.settings import Section
from stages.task import Task

if TYPE_CHECKING:
    from actuator.geometry.bodies import Shell

VERSION = 4

Islands = Literal["remove", "refuse"]

#: Islands that a message describes one by one.
SHOWN = 5
#: Largest relative difference between the volume written and the volume read back.
VOLUME_TOLERANCE = 1.0e-5


def _known(name: Any) -> Any:
    """Refuse a format that is not registered, as pydantic refuses a word that is not one of some."""
    if not isinstance(name, str) or name not in FORMATS:
        known = [f"'{each}'" for each in FORMATS]
        expected = " or ".join(filter(None, [", ".join(known[:-1]), known[-1]]))
        raise PydanticCustomError("literal_error", "Input should be {expected}", {"expected": expected})
    return name


def _listed_formats(schema: dict[str, Any]) -> None:
    schema["enum"] = list(FORMATS)


class Settings(Section):
    """Size and format of the part (Section 4 of the paper: scale 1.5)."""

    scale: float = Field(1.0, gt=0, description="size of the part over size of the domain [-]")
    format: Annotated[str, BeforeValidator(_known)] = Field(
        "stl", description="file format: binary stl in mm, or 3mf", json_schema_extra=_listed_formats
    )
    islands: Islands = Field("remove", description="bodies that float beside the largest: remove or refuse")
    most_removed: float = Field(
        0.05, ge=0, le=1, description="share of the volume that islands may have and still be removed; chosen [-]"
    )
    decimation: float = Field(0.0, ge=0, description="how far fewer triangles may lie off; 0 keeps all [mm]")


@dataclass(frozen=True)
class Result:
    """The file and what was found when it was read back.

    Attributes:
        data: bytes of the file.
        vertices: (n_vertices, 3), mm, scaled, exactly as written.
        triangles: (n_triangles, 3), counter-clockwise seen from outside.
        volume: mm³, read back.
        watertight: read back.
        bounding_box: lower and upper corner, (2, 3), mm, read back.
        passed: whether every check of the file passed.
        report: ``manifold`` (what manifold3d did), ``file`` (the :class:`~stages.inspection.Inspection`), ``islands``
            (the removed ones, volume in mm³ and centre in mm), ``decimated`` (triangles left out), ``moved``
            (how far the surface lies off because of that, mm), ``checks`` (name -> passed), ``holds_air`` between
            plates on both ends, and ``chamber``, the sentence that says where it gets out if not.
    """

    data: bytes
    vertices: Floats
    triangles: Ints
    volume: float
    watertight: bool
    bounding_box: Floats
    passed: bool
    report: dict[str, Any]


def run(vertices: Floats, triangles: Ints, settings: Settings, observer: Observer = silent, name: str = "") -> Result:
    """Scale, prove, write, read back and check a part.

    Args:
        vertices: (n, 3), mm.
        triangles: (m, 3), counter-clockwise seen from outside.
        settings: scale and format.
        observer: receives a message about repairs and one about floating islands, if any.
        name: of the part; written into the file, with its scale.

    Raises:
        actuator.failure.InvalidField: if a coordinate is not finite.
        actuator.failure.EmptySolid: if there is no triangle.
        actuator.failure.NotManifold: if the triangles bound no solid and cannot be repaired.
        actuator.failure.LooseBodies: if there are floating islands and they are to be refused, or are
            more of the volume than may be removed.
    """
    # manifold3d: only where it runs
    from actuator.geometry.decimation import decimated
    from actuator.geometry.islands import without_islands
    from actuator.geometry.solid import component_volumes, prove_solid

    proof = prove_solid(settings.scale * vertices, triangles)
    if proof.repair_tolerance:
        observer(Message(f"repaired within {proof.repair_tolerance:.2g} mm ({proof.status})"))
    surface, islands = without_islands(proof.surface)
    if islands:
        listed = _listed(islands)
        if settings.islands == "refuse":
            raise LooseBodies(
                f"{len(islands)} bodies float beside the part: {listed}; set export.islands to 'remove', or change the "
                "design."
            )
        share = 1.0 - float(component_volumes(surface).sum() / component_volumes(proof.surface).sum())
        if share > settings.most_removed:
            raise LooseBodies(
                f"{len(islands)} bodies float beside the part and are {100.0 * share:.3g} % of the volume, and at most "
                f"{100.0 * settings.most_removed:.3g} % may be removed: {listed}; connect them in the design "
                "(mirror.threshold, refine.filter_radius), or allow more by export.most_removed (--most-removed)."
            )
        observer(Message(f"{len(islands)} floating islands removed: {listed}"))
    whole, off = surface, 0.0
    if settings.decimation > 0.0:
        surface, off = decimated(whole, settings.decimation)
        left_out = len(whole.triangles) - len(surface.triangles)
        observer(Message(f"{left_out} of {len(whole.triangles)} triangles left out, {off:.2g} mm off at most"))
    title = f"{name or 'part'}, scale {settings.scale:g}, mm"
    data = FORMATS[settings.format].write(surface, title)
    found = inspect(data, settings.format)
    volume = float(component_volumes(surface).sum())
    box = np.stack([surface.vertices.min(axis=0), surface.vertices.max(axis=0)])
    found_box = np.array(found.bounding_box)
    checks = {
        "watertight": found.watertight,
        "winding_consistent": found.winding_consistent,
        "one_body": len(found.bodies) == 1,
        "volume_positive": found.volume > 0.0,
        "volume_as_written": abs(found.volume - volume) <= VOLUME_TOLERANCE * volume,
        "bounding_box_as_written": bool(np.abs(found_box - box).max() <= 1e-6 * np.abs(box).max()),
    }
    air = check.air_chamber(surface, check.Settings())
    steps = {key: value for key, value in vars(proof).items() if key != "surface"}
    report: dict[str, Any] = {
        "manifold": steps,
        "file": asdict(found),
        "islands": [{"volume": island.volume, "centre": island.centre} for island in islands],
        "decimated": len(whole.triangles) - len(surface.triangles),
        "moved": off,
        "checks": checks,
        "holds_air": air.verdict == "pass",
        "chamber": air.text,
    }
    return Result(
        data,
        surface.vertices,
        surface.triangles,
        found.volume,
        found.watertight,
        found_box,
        all(checks.values()),
        report,
    )


def _listed(islands: list[Shell]) -> str:
    """The largest islands with volume and place."""
    shown = [
        f"{island.volume:.3g} mm³ at ({', '.join(f'{x:.1f}' for x in island.centre)}) mm" for island in islands[:SHOWN]
    ]
    more = [f"and {len(islands) - SHOWN} smaller ones"] if len(islands) > SHOWN else []
    return "; ".join(shown + more)


def start(task: Task) -> Result:
    """Make the part of a case from its solid."""
    return run(*surface(task.upstream), task.case.export, task.observer, task.case.name)


def pack(result: Result) -> Packed:
    """The part, and what was made of it."""
    failed = ", ".join(name for name, passed in result.report["checks"].items() if not passed)
    remedy = "refine further (refine.factor, refine.filter_radius) or optimise longer"
    flaw = f"the solid fails its checks ({failed}); {remedy}"
    summary = {key: value for key, value in result.report.items() if key != "file"}
    inspected = partial(_inspected, result.report["file"]["format"])
    return Packed(summary, product=Product(result.data, "" if result.passed else flaw, inspected))


def _inspected(format: str, data: bytes) -> tuple[dict[str, Any], str]:
    """What the part measures as it was read back from the disk, and what is wrong with it."""
    found = inspect(data, format)
    summary = {
        "sha256": hashlib.sha256(data).hexdigest(),
        "volume": found.volume,
        "watertight": found.watertight,
        "bounding_box": found.bounding_box,
    }
    whole = found.watertight and found.volume > 0.0
    return summary, "" if whole else "is not watertight when read back; export again"


def verdict(part: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Whether the part holds air, and where it gets out if not."""
    if "holds_air" not in part:  # of an older record
        return []
    return [("holds air", "yes")] if part["holds_air"] else [("holds air", "no"), ("", part["chamber"])]


def lines(part: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What a user reads of the part."""
    low, high = part["bounding_box"]
    box = " x ".join(f"{b - a:.2f}" for a, b in zip(low, high, strict=True))
    lines = [
        ("volume", f"{part['volume']:.1f} mm^3"),
        ("watertight", "yes" if part["watertight"] else "no"),
        ("bounding box", f"{box} mm"),
    ]
    if part["islands"]:
        volumes = [island["volume"] for island in part["islands"]]
        lines.append(("bodies removed", f"{len(volumes)}, together {sum(volumes):.2f} mm^3"))
    return lines

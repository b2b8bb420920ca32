"""The list ``regions``: parts of the domain that stay void or solid, each with the keys of its shape.

A shape is a :class:`actuator.regions.shapes.Shape` and its settings, registered in :data:`SHAPES`; those of another
program too, before a case is read.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from actuator.failure import InvalidRegion, NotManifold
from actuator.registry import Registry
from stages.datasets import Dataset, Source
from stages.section import Kinds, Section

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.geometry.zero_set import Surface
    from actuator.regions.bounds import Bounds, Regions
    from actuator.regions.shapes import Shape

#: What files of regions hold: closed surfaces in mm, by the number of the region.
Bodies = Mapping[int, "Surface"]

#: Names in artifacts of the bounds that regions of a kind make.
BOUNDS = {"solid": "lower_bound", "void": "upper_bound"}

Point = Annotated[list[float], Field(min_length=3, max_length=3)]


class RegionSettings(Section):
    """What the settings of every region have; those of a shape have a field ``shape`` besides, a literal."""

    if TYPE_CHECKING:  # a field of the subclasses
        shape: str

    kind: Literal["void", "solid", "free"] = Field(
        description="what it stays; free undoes in this place what earlier regions of the list say"
    )

    @abstractmethod
    def build(self, domain: Domain, body: Surface | None) -> Shape:
        """The shape on a domain.

        Args:
            domain: the meshed domain.
            body: what the region's file holds, if it names one, in the units of the domain.

        Raises:
            ValueError: if the domain has no such shape, as the end of a sentence.
            actuator.failure.NotManifold: if the body is no solid.
        """


class BoxRegion(RegionSettings):
    """A box with sides along the axes."""

    shape: Literal["box"] = Field(description="which shape")
    corner: Point = Field(description="a corner, (X1, X2, X3) [mm]")
    opposite: Point = Field(description="the corner that is opposite in all three directions [mm]")

    @model_validator(mode="after")
    def _has_sides(self) -> Self:
        if any(one == other for one, other in zip(self.corner, self.opposite, strict=True)):
            raise ValueError("the box is flat; let its corners differ in all three coordinates")
        return self

    def build(self, domain: Domain, body: Surface | None) -> Shape:
        """See :meth:`RegionSettings.build`."""
        from actuator.regions.shapes import Box  # VTK and SciPy: only where a mesh is

        corners = np.array([self.corner, self.opposite])
        return Box(corners.min(axis=0), corners.max(axis=0))


class CylinderRegion(RegionSettings):
    """A round cylinder between two points."""

    shape: Literal["cylinder"] = Field(description="which shape")
    start: Point = Field(description="centre of one end, (X1, X2, X3) [mm]")
    end: Point = Field(description="centre of the other end [mm]")
    radius: float = Field(gt=0, description="its radius [mm]")

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if self.start == self.end:
            raise ValueError("'start' and 'end' are the same point; let them differ")
        return self

    def build(self, domain: Domain, body: Surface | None) -> Shape:
        """See :meth:`RegionSettings.build`."""
        from actuator.regions.shapes import Cylinder  # as in BoxRegion

        return Cylinder(np.array(self.start), np.array(self.end), self.radius)


class SphereRegion(RegionSettings):
    """A sphere."""

    shape: Literal["sphere"] = Field(description="which shape")
    centre: Point = Field(description="its centre, (X1, X2, X3) [mm]")
    radius: float = Field(gt=0, description="its radius [mm]")

    def build(self, domain: Domain, body: Surface | None) -> Shape:
        """See :meth:`RegionSettings.build`."""
        from actuator.regions.shapes import Sphere  # as in BoxRegion

        return Sphere(np.array(self.centre), self.radius)


class SkinRegion(RegionSettings):
    """What lies within a distance of a surface of the domain."""

    shape: Literal["skin"] = Field(description="which shape")
    surface: Literal["fixed", "tip", "symmetry", "outside"] = Field(
        description="the face that is held, the face that moves with the arm, the symmetry plane, or the outer wall"
    )
    thickness: float = Field(gt=0, description="largest distance from it [mm]")

    def build(self, domain: Domain, body: Surface | None) -> Shape:
        """See :meth:`RegionSettings.build`."""
        from actuator.geometry.transfer import facets_of  # as in BoxRegion
        from actuator.regions.shapes import Skin

        facets = facets_of(domain, getattr(domain, self.surface))
        if not len(facets.triangles):
            raise ValueError(f"the domain has no surface '{self.surface}'; name another one")
        return Skin(facets, self.thickness)


class FileRegion(RegionSettings):
    """The inside of a closed surface in a file."""

    shape: Literal["file"] = Field(description="which shape")
    file: str = Field(
        min_length=1, description="STL or 3MF, in mm and the domain's coordinates; seen from the case file's folder"
    )
    sha256: str | None = Field(
        None, pattern="^[0-9a-f]{64}$", description="what the file must hold; found by the program if left out"
    )

    def build(self, domain: Domain, body: Surface | None) -> Shape:
        """See :meth:`RegionSettings.build`."""
        from actuator.regions.shapes import Body  # as in BoxRegion
        from stages.check.soundness import sound

        if body is None:
            raise ValueError(f"{self.file} was not read; give the closed surface that it holds")
        return Body(sound(body.vertices, body.triangles).surface)


#: Settings of the shapes by ``shape``.
SHAPES: Registry[type[RegionSettings]] = Registry("shape of a region")
for _name, _settings in (
    ("box", BoxRegion),
    ("cylinder", CylinderRegion),
    ("sphere", SphereRegion),
    ("skin", SkinRegion),
    ("file", FileRegion),
):
    SHAPES.register(_name, _settings)

AnyRegionSettings = Annotated[RegionSettings, Kinds(SHAPES, "shape")]


def regions_on(domain: Domain, settings: list[RegionSettings], bodies: Bodies) -> Regions:
    """The regions of a case on its domain or a finer one, in the same units.

    Raises:
        actuator.failure.InvalidRegion: if the domain has not what one of them names.
        actuator.failure.NotManifold: if what the file of one of them holds is no solid.
    """
    from actuator.regions.bounds import Region, Regions  # as in BoxRegion

    found = []
    for number, each in enumerate(settings):
        try:
            found.append(Region(each.kind, each.build(domain, bodies.get(number))))
        except ValueError as error:
            raise InvalidRegion(number, str(error)) from None
        except NotManifold as error:
            raise NotManifold(f"regions.{number}: {error}") from None
    return Regions(domain, found)


def stored_bounds(source: Source, settings: list[RegionSettings]) -> Bounds | None:
    """Bounds on χ for the part at the vertices of a finer mesh, from its artifact; None without regions."""
    from actuator.regions.bounds import Bounds  # as in BoxRegion

    kinds = {each.kind for each in settings}
    found = [source.read(f"vertices/{name}")[0] if kind in kinds else None for kind, name in BOUNDS.items()]
    return Bounds(*found) if settings else None


def pack_bounds(bounds: Bounds | None) -> dict[str, Dataset]:
    """Bounds on χ at the vertices, as :func:`stored_bounds` reads them."""
    return {
        f"vertices/{name}": Dataset(values, "1", f"bound on chi of the regions that stay {kind}")
        for (kind, name), values in zip(BOUNDS.items(), bounds or (None, None), strict=True)
        if values is not None
    }


def pack(bodies: Bodies) -> dict[str, Dataset]:
    """What files of regions hold, as an artifact keeps it: the part is made of it, wherever the files are by then."""
    return {
        name: dataset
        for number, body in bodies.items()
        for name, dataset in (
            (f"regions/{number}.vertices", Dataset(body.vertices, "mm", f"surface of regions.{number}")),
            (f"regions/{number}.triangles", Dataset(body.triangles, "1", "vertices of its triangles, 3 each")),
        )
    }


def unpack(source: Source, settings: list[RegionSettings]) -> dict[int, Surface]:
    """What :func:`pack` has put into the artifact of the optimisation."""
    from actuator.geometry.zero_set import Surface

    numbers = [number for number, each in enumerate(settings) if isinstance(each, FileRegion)]
    return {
        number: Surface(*source.read(f"regions/{number}.vertices", f"regions/{number}.triangles")) for number in numbers
    }

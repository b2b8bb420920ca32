"""The section ``domain``: which design domain a case has, and its sizes and mesh.

A domain is a subclass of :class:`actuator.domains.interface.Domain` and its settings, registered in :data:`DOMAINS`;
those of another program too, before a case is read.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field, PrivateAttr, model_validator

from actuator.failure import InvalidSettings
from actuator.registry import Registry
from stages.section import Kinds, Section

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.domains.own_mesh import OwnMesh


class DomainSettings(Section):
    """What the settings of every domain have: fields with units and bounds, and a mesh that is made of them.

    A subclass has a field ``shape``, a literal with the name it is registered by, and the field ``length``, L in mm.
    """

    #: Keys of the lengths that a part is measured by, and of the numbers of cells that make its mesh coarser or finer.
    lengths: ClassVar[tuple[str, ...]]
    counts: ClassVar[tuple[str, ...]]

    if TYPE_CHECKING:  # fields of the subclasses, in their own order
        shape: str
        length: float

    @property
    @abstractmethod
    def size(self) -> float:
        """R of the domain's interface, mm."""

    @property
    @abstractmethod
    def cells(self) -> int:
        """Number of cells; no mesh is built for it."""

    @property
    def halves(self) -> int:
        """How many halves of the actuator are modelled: 1, or 2 where there is no symmetry plane."""
        return 1

    @property
    def classes(self) -> int:
        """How many cells have shape functions of their own because nothing is known of them; 0 for a swept domain."""
        return 0

    @classmethod
    @abstractmethod
    def domain_type(cls) -> Callable[..., Domain]:
        """The type of the domain, imported here: to read a case must not load what meshes it."""

    def build(self) -> Domain:
        """The meshed domain; by default the fields but for ``shape`` are what its type is called with."""
        return self.domain_type()(**self.model_dump(exclude={"shape"}))


class RoundSettings(DomainSettings):
    """Sizes and mesh of a cylinder, O-grid section times layers (Table 1)."""

    lengths: ClassVar[tuple[str, ...]] = ("radius", "length")
    counts: ClassVar[tuple[str, ...]] = ("core_cells", "rings", "layers")

    radius: float = Field(15.0, gt=0, description="R, domain radius [mm]")
    length: float = Field(15.0, gt=0, description="L, domain length [mm]")
    core_cells: int = Field(12, ge=1, le=200, description="m, cells along a quarter of the section's core [-]")
    rings: int = Field(5, ge=1, le=200, description="k, rings of cells around the core [-]; N23 = 2 (m² + 2 m k)")
    layers: int = Field(18, ge=1, le=1000, description="N1, cells along X1 [-]")

    @property
    def size(self) -> float:
        """R, mm."""
        return self.radius

    @property
    def cells(self) -> int:
        """N1 N23, for both halves where both are meshed."""
        return 2 * self.halves * self.core_cells * (self.core_cells + 2 * self.rings) * self.layers


class HalfCylinderSettings(RoundSettings):
    """Design domain and mesh: half a cylinder, O-grid section times layers (Table 1)."""

    shape: Literal["half-cylinder"] = Field("half-cylinder", description="which design domain")

    @classmethod
    def domain_type(cls) -> Callable[..., Domain]:
        """The half cylinder."""
        from actuator.domains.half_cylinder import HalfCylinder  # scikit-fem: only where a mesh is wanted

        return HalfCylinder


class CylinderSettings(RoundSettings):
    """Design domain and mesh: the whole cylinder, twice the cells of the half; no symmetry is assumed."""

    shape: Literal["cylinder"] = Field("cylinder", description="which design domain")

    @property
    def halves(self) -> int:
        """Both."""
        return 2

    @classmethod
    def domain_type(cls) -> Callable[..., Domain]:
        """The whole cylinder."""
        from actuator.domains.cylinder import Cylinder  # as above

        return Cylinder


class WalledSettings(DomainSettings):
    """Mesh of a prism: an O-grid inside its wall, section times layers."""

    counts: ClassVar[tuple[str, ...]] = ("across", "up", "rings", "layers")

    length: float = Field(40.0, gt=0, description="L, length [mm]")
    across: int = Field(4, ge=1, le=200, description="m2, cells along X2 of a quarter of the section's core [-]")
    up: int = Field(4, ge=1, le=200, description="m3, cells along X3 of a quarter of the section's core [-]")
    rings: int = Field(3, ge=1, le=200, description="k, rings of cells around the core [-]")
    layers: int = Field(16, ge=1, le=1000, description="N1, cells along X1 [-]")
    whole: bool = Field(False, description="whether both halves are meshed; if not, X2 = 0 is a symmetry plane")

    @property
    def cells(self) -> int:
        """N1 times 2 (m2 m3 + (m2 + m3) k) of a half."""
        section = self.across * self.up + (self.across + self.up) * self.rings
        return 2 * self.halves * section * self.layers

    @property
    def halves(self) -> int:
        """One or both."""
        return 2 if self.whole else 1

    def build(self) -> Domain:
        """The meshed domain, as coarse as the case says."""
        return self.domain_type()(**self.model_dump(exclude={"shape"}), refinement=1)


class BoxSettings(WalledSettings):
    """Design domain and mesh: a box along X1 with rounded edges, a finger for instance, half of it or whole."""

    lengths: ClassVar[tuple[str, ...]] = ("length", "width", "height", "edge")

    width: float = Field(20.0, gt=0, description="W, width along X2, of both halves [mm]")
    height: float = Field(20.0, gt=0, description="H, height along X3 [mm]")
    edge: float = Field(2.0, ge=0, description="r_e, radius of the edges along X1; 0 for sharp ones [mm]")
    shape: Literal["box"] = Field("box", description="which design domain")

    @model_validator(mode="after")
    def _edges_fit(self) -> Self:
        if self.edge > 0.45 * min(self.width, self.height):
            raise ValueError(f"has edges of {self.edge:g} mm, more than 45 % of width or height; lower 'edge'")
        from actuator.domains import outline  # NumPy and SciPy: only where they are wanted

        wall, edges = outline.box(self.width, self.height, self.edge)
        outline.meshed(wall, 0.0, (self.across, self.up), self.rings, 1, edges)
        return self

    @property
    def size(self) -> float:
        """H / 2, mm."""
        return 0.5 * self.height

    @classmethod
    def domain_type(cls) -> Callable[..., Domain]:
        """The box."""
        from actuator.domains.prism import Box  # scikit-fem: only where a mesh is wanted

        return Box


class PrismSettings(WalledSettings):
    """Design domain and mesh: a prism along X1 of any section that is star-shaped seen from the inlet's axis."""

    lengths: ClassVar[tuple[str, ...]] = ("length",)

    profile: list[list[float]] = Field(
        [[0.0, -10.0], [12.0, -10.0], [7.0, 10.0], [0.0, 10.0]],
        description="points (X2, X3) of the wall of the half X2 >= 0, mm, from its lowest on X2 = 0 to its highest",
    )
    inlet_height: float = Field(0.0, description="X3 of the inlet's axis, which the section's mesh lies around [mm]")
    shape: Literal["prism"] = Field("prism", description="which design domain")

    @model_validator(mode="after")
    def _can_be_meshed(self) -> Self:
        import numpy as np  # as above

        from actuator.domains import outline

        if any(len(point) != 2 for point in self.profile):
            raise ValueError("has a profile with points that are not two numbers; write each as [X2, X3]")
        wall = np.array(self.profile, dtype=np.float64)
        if wrong := outline.fault(wall, self.inlet_height):
            raise ValueError(f"has a profile that {wrong}")
        outline.meshed(wall, self.inlet_height, (self.across, self.up), self.rings, 1)
        return self

    @property
    def size(self) -> float:
        """Half the height, mm."""
        heights = [height for _, height in self.profile]
        return 0.5 * (max(heights) - min(heights))

    def in_units(self, length: float, stress: float) -> Self:
        """The same with the profile's lengths, too, in other units."""
        profile = [[x2 / length, x3 / length] for x2, x3 in self.profile]
        return super().in_units(length, stress).model_copy(update={"profile": profile})

    @classmethod
    def domain_type(cls) -> Callable[..., Domain]:
        """The prism."""
        from actuator.domains.prism import Prism  # as above

        return Prism


class MeshSettings(DomainSettings):
    """Design domain and mesh: 8-node hexahedra from a file with sets fixed, tip, symmetry, outside and inlet.

    What the file holds is read by whoever opens files, and given by :meth:`holding`.
    """

    lengths: ClassVar[tuple[str, ...]] = ("length", "height")
    counts: ClassVar[tuple[str, ...]] = ()
    #: Keys that :meth:`holding` fills.
    found: ClassVar[tuple[str, ...]] = ("length", "height", "hexahedra", "whole", "sha256")

    file: str | None = Field(
        None, min_length=1, description="the mesh, .msh, .inp, .vtu or any that meshio reads; from the case's folder"
    )
    length: float | None = Field(  # type: ignore[assignment]  # until the mesh is read
        None, gt=0, description="L, to which the mesh is scaled; left out, its vertices count in mm [mm]"
    )
    radius: float | None = Field(
        None, gt=0, description="radius of an outer wall that is round about the axis X1; none for any other [mm]"
    )
    inlet_height: float = Field(0.0, description="X3 of an inlet channel along X1, without a set inlet [mm]")
    height: float | None = Field(None, gt=0, description="H, height along X3; found by the program [mm]")
    hexahedra: int | None = Field(None, ge=1, description="number of cells; found by the program [-]")
    whole: bool | None = Field(None, description="whether there is no set symmetry; found by the program")
    sha256: str | None = Field(
        None, pattern="^[0-9a-f]{64}$", description="what the file must hold; found by the program if left out"
    )
    shape: Literal["mesh"] = Field("mesh", description="which design domain")

    _mesh: OwnMesh | None = PrivateAttr(None)

    @model_validator(mode="after")
    def _of_a_file(self) -> Self:
        if self.file is None:
            raise ValueError("has no mesh; write 'file'")
        return self

    def holding(self, mesh: OwnMesh, sha256: str) -> Self:
        """The settings with what the file holds, its sha256 by the cells, vertices and sets that count."""
        found = mesh.length, 2.0 * mesh.size, len(mesh.hexahedra), not mesh.mirrored, sha256
        made = self.model_copy(update=dict(zip(self.found, found, strict=True)))
        made._mesh = mesh
        return made

    @property
    def size(self) -> float:
        """H / 2, mm."""
        return 0.5 * (self.height or 0.0)

    @property
    def cells(self) -> int:
        """As many as the file has."""
        return self.hexahedra or 0

    @property
    def halves(self) -> int:
        """Two without a symmetry plane."""
        return 2 if self.whole else 1

    @property
    def classes(self) -> int:
        """All of them."""
        return self.cells

    @classmethod
    def domain_type(cls) -> Callable[..., Domain]:
        """The mesh."""
        from actuator.domains.own_mesh import OwnMesh  # scikit-fem: only where a mesh is wanted

        return OwnMesh

    def build(self) -> Domain:
        """The mesh that was read, in the units of these settings.

        Raises:
            actuator.failure.InvalidSettings: if it was not read.
        """
        if self._mesh is None:
            raise InvalidSettings(f"domain.file: {self.file} was not read; give the case with the mesh it names.")
        return self._mesh.scaled((self.length or self._mesh.length) / self._mesh.length)


#: Settings of the domains by ``shape``.
DOMAINS: Registry[type[DomainSettings]] = Registry("domain")
DOMAINS.register("half-cylinder", HalfCylinderSettings)
DOMAINS.register("cylinder", CylinderSettings)
DOMAINS.register("prism", PrismSettings)
DOMAINS.register("box", BoxSettings)
DOMAINS.register("mesh", MeshSettings)

AnyDomainSettings = Annotated[DomainSettings, Kinds(DOMAINS, "shape", default="half-cylinder")]

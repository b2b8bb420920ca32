"""The section ``domain``: which design domain a case has, and its sizes and mesh.

A domain is a subclass of :class:`actuator.domains.interface.Domain` and its settings, registered in :data:`DOMAINS`;
those of another program too, before a case is read.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from actuator.registry import Registry
from stages.section import Kinds, Section

if TYPE_CHECKING:
    from actuator.domains.interface import Domain


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


#: Settings of the domains by ``shape``.
DOMAINS: Registry[type[DomainSettings]] = Registry("domain")
DOMAINS.register("half-cylinder", HalfCylinderSettings)
DOMAINS.register("cylinder", CylinderSettings)

AnyDomainSettings = Annotated[DomainSettings, Kinds(DOMAINS, "shape", default="half-cylinder")]

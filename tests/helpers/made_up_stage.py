"""A stage that the program does not have, as another program would bring it, in one file: what the solid weighs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import Field

from actuator.arrays import Floats, Ints
from stages.chain import Option, Stage
from stages.datasets import Dataset, Packed, surface
from stages.section import Section
from stages.task import Task

VERSION = 1


class Settings(Section):
    """What the solid is made of."""

    density: float = Field(1.1, gt=0, description="of the cured resin [g/cm³]")


@dataclass(frozen=True)
class Result:
    """The weighed solid: volume in mm³ and mass in g."""

    volume: float
    mass: float


def run(vertices: Floats, triangles: Ints, settings: Settings) -> Result:
    """Weigh the solid inside triangles, by the divergence theorem."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
    return Result(volume, 1e-3 * volume * settings.density)


def start(task: Task) -> Result:
    """Weigh the solid of a case."""
    return run(*surface(task.upstream), task.case.weigh)


def pack(result: Result) -> Packed:
    """Volume and mass."""
    return Packed(vars(result), {"weight/mass": Dataset(result.mass, "g", "mass of the solid")})


def lines(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What a user reads."""
    return [("mass", f"{summary['mass']:.3f} g")]


WEIGH = Stage(
    "weigh",
    "Weigh the solid.",
    module=__name__,
    suffix=".weigh.h5",
    sections=("weigh",),
    after="mirror",
    options=(Option("--density", float, "weigh", "density", "Density of the cured resin, g/cm³."),),
)

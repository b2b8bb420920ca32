"""Numerical choices behind the state equations; docs/explain/accuracy.md says what each of them costs and gains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from actuator.linear.interface import Precision

Element = Literal["hex20", "hex8"]


@dataclass(frozen=True)
class Scheme:
    """How the equations are discretised and solved; a case runs with the defaults.

    Attributes:
        element: of the displacements: the 20-node serendipity hexahedron, or the trilinear one with 8 nodes. Of second
            derivatives, which c_r penalises, the latter has only the mixed ones in reference coordinates and those
            that the map of non-affine cells adds: c_r then acts on the warping of cells, not on their bending.
        quadrature: points per cell: 8 (Gauss, degree 3), 14 (Stroud, degree 5) or 27 (Gauss, degree 5 in each
            variable).
        precision: of the factors of the mechanical block, which only precondition.
        forcing: largest relative residual that is left by the linear solve of a Newton step.

    Raises:
        ValueError: if there is no such element or forcing is not between 0 and 1. An unknown number of points or
            precision is refused where it is used.
    """

    element: Element = "hex20"
    quadrature: int = 14
    precision: Precision = "single"
    forcing: float = 1e-3

    def __post_init__(self) -> None:
        if self.element not in get_args(Element):
            raise ValueError(f"element must be one of {', '.join(get_args(Element))}, not {self.element!r}")
        if not 0.0 < self.forcing < 1.0:
            raise ValueError(f"forcing must lie between 0 and 1, not at {self.forcing}")


DEFAULT = Scheme()

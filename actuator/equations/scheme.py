"""Numerical choices behind the state equations; docs/explain/accuracy.md says what each of them costs and gains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

if TYPE_CHECKING:  # a case file names elements, and is read without numba and SciPy
    from actuator.linear.interface import Precision

Element = Literal["hex20", "hex8"]
PressureElements = Literal["fitted", "summed", "plain"]


@dataclass(frozen=True)
class Scheme:
    """How the equations are discretised and solved; a case runs with the defaults.

    Attributes:
        element: of the displacements: the 20-node serendipity hexahedron, or the trilinear one with 8 nodes. Of second
            derivatives, which c_r penalises, the latter has only the mixed ones in reference coordinates and those
            that the map of non-affine cells adds: c_r then acts on the warping of cells, not on their bending.
        quadrature: points per cell: 8 (Gauss, degree 3), 14 (Stroud, degree 5) or 27 (Gauss, degree 5 in each
            variable).
        pressure: trilinear elements of p: plain, with the matrices of source and drainage summed by rows, or with k
            fitted to the cells as well (:func:`actuator.equations.kernels.cell_permeability`).
        precision: of the factors of the mechanical block, which only precondition.
        forcing: largest relative residual that is left by the linear solve of a Newton step.

    Raises:
        ValueError: if there are no such elements or forcing is not between 0 and 1. An unknown number of points or
            precision is refused where it is used.
    """

    element: Element = "hex20"
    quadrature: int = 14
    pressure: PressureElements = "fitted"
    precision: Precision = "single"
    forcing: float = 1e-3

    def __post_init__(self) -> None:
        for name, kind in (("element", Element), ("pressure", PressureElements)):
            if (value := getattr(self, name)) not in get_args(kind):
                raise ValueError(f"{name} must be one of {', '.join(get_args(kind))}, not {value!r}")
        if not 0.0 < self.forcing < 1.0:
            raise ValueError(f"forcing must lie between 0 and 1, not at {self.forcing}")


DEFAULT = Scheme()

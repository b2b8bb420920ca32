"""The leak of three walls by every kind of elements of p, beside finer meshes.

    OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.pressure_elements

Eq. (5) alone, at rest, so that nothing but p differs: the initial design with its whole wall and with two thinner ones,
on four meshes. The kinds are those of ``elements.pressure`` and the 20-node elements
of :mod:`actuator.solve.leak_check`. Two numbers for each: C_p, and the largest |p| / p_in on the outer wall. Writes a
table and a CSV to ``benchmarks/results``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

import numpy as np

from actuator.compilation import compile_kernels
from actuator.domains.half_cylinder import HalfCylinder
from actuator.equations.scheme import PressureElements, Scheme
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.leak_check import Leak, second_order_leak
from actuator.threads import use_threads
from benchmarks.tables import Row, markdown, start_log, write_csv, write_markdown
from stages.settings import ProblemSettings

logger = start_log("benchmarks.pressure_elements")

#: m, k and N1: 1,080 and 2,688 cells, the paper's mesh, and 21,504.
MESHES = ((6, 2, 9), (8, 3, 12), (12, 5, 18), (16, 6, 24))
#: What is taken from χ of the initial design, by what that leaves of its wall.
WALLS = {"whole": 0.0, "thinner": 2.0, "thinnest": 3.0}


def found(equilibrium: Equilibrium, chi: np.ndarray) -> Leak:
    """The leak that the equilibrium's own elements of p see at rest."""
    x, p_in = np.zeros(equilibrium.kinematics.size), equilibrium.coefficients.pressure
    p = equilibrium.pressure(chi, x) / p_in
    on_wall = p[equilibrium.domain.outside.vertices]
    return Leak(float(np.abs(on_wall).max()), float(p @ (equilibrium.discretisation.wall_mass @ p)))


def rows(problem: ProblemSettings, mesh: tuple[int, int, int]) -> Iterator[Row]:
    """One row for each wall and kind."""
    size = problem.domain.size
    domain = HalfCylinder(size, problem.domain.length, *mesh)
    material, load, objective = problem.parameters()
    initial = domain.initial_design(domain.points, objective.interface_width)
    for kind in (*get_args(PressureElements), "20 nodes"):
        scheme = Scheme(pressure=kind) if kind in get_args(PressureElements) else Scheme()
        equilibrium = Equilibrium(domain, material, load, objective, threads=1, scheme=scheme)
        for wall, less in WALLS.items():
            chi, rest = initial - less, np.zeros(equilibrium.kinematics.size)
            if kind == "20 nodes":
                leak = second_order_leak(equilibrium, equilibrium.at(chi, rest, 0.0 * chi))
            else:
                leak = found(equilibrium, chi)
            yield {
                "wall": wall,
                "cells": domain.mesh.nelements,
                "elements of p": kind,
                "C_p": 0.5 * objective.leak_weight * leak.mean_square,
                "largest p / p_in": leak.largest,
            }


def main() -> None:
    """All meshes, then the table, by walls."""
    compile_kernels()
    use_threads(1)
    found_rows = [row for mesh in MESHES for row in rows(ProblemSettings(), mesh)]
    found_rows.sort(key=lambda row: list(WALLS).index(str(row["wall"])))
    write_csv("pressure_elements", found_rows)
    said = "At rest, initial design less 0, 2 and 3 in χ; finer meshes and 20 nodes are the reference."
    write_markdown("pressure_elements", "The leak by every kind of elements of p", [said, markdown(found_rows)])
    logger.info("%s", markdown(found_rows))


if __name__ == "__main__":
    main()

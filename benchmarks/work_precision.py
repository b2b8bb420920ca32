"""Run time against error of one design evaluation: meshes, elements, quadrature, c_r, tolerances, precision.

    python -m benchmarks.work_precision                          # optimises the small case itself first; hours
    python -m benchmarks.work_precision --design case14.h5       # with a design that `poro optimize` has made
    python -m benchmarks.work_precision --meshes 6,2,9 --repeats 1

Two designs stay fixed: the initial one, given by a formula on every mesh, and an optimised one, carried to every mesh
by trilinear interpolation. Each variant changes one numerical choice of the program. An evaluation is state, adjoint
and gradient of C0 with a fresh factorisation: of the initial design from rest, of the optimised one from the state of
a neighbour, as the optimiser does it; from rest Newton's method is damped there, and how long is a matter of chance.
The reference is the finest mesh with 27 points and tight tolerances.

Seconds are those of the processor, with one thread, the default measured before and after every few variants.
Measurements go to ``benchmarks/results/work_precision.csv`` one by one and are not repeated by a second run unless
``--anew`` is given; :mod:`benchmarks.work_precision_report` makes table and plot of them.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from actuator.arrays import Floats
from actuator.compilation import compile_kernels
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.failure import SolveFailure
from actuator.optimiser.loop import Optimiser
from actuator.solve.reduced import ReducedObjective
from actuator.threads import use_threads
from benchmarks.designs import carried, directions
from benchmarks.tables import RESULTS, Row, read_csv, start_log, write_csv
from benchmarks.work_precision_report import NAME, REFERENCE, write_report
from pipeline.case.model import find_case, read_case
from pipeline.store.contents import design
from stages.domains import HalfCylinderSettings
from stages.settings import MaterialSettings, ProblemSettings

logger = start_log("benchmarks.work_precision")

#: m, k, layers of much the same shape of cells: the small case's mesh, two between, the paper's.
MESHES = ((6, 2, 9), (8, 3, 12), (10, 4, 15), (12, 5, 18))
FINEST = (18, 7, 26)
#: How far, in χ, the neighbour is away; design updates change it by 0.05 to 6.
NEIGHBOUR = 0.1
#: Design updates of the small case that make the optimised design if none is given.
UPDATES = 15


@dataclass(frozen=True)
class Variant:
    """The program's numerical choices, one of them changed; ``regularisation`` multiplies c_r."""

    scheme: Scheme = DEFAULT
    state: float = 1e-8
    adjoint: float = 1e-10
    regularisation: float = 1.0

    @property
    def discretisation(self) -> tuple[object, ...]:
        """What needs a model of its own; the rest is set from call to call."""
        return self.scheme.element, self.scheme.quadrature, self.scheme.precision, self.regularisation


TIGHT = Variant(Scheme(quadrature=27), 1e-10, 1e-10)
VARIANTS = {
    "default": Variant(),
    "tight tolerances": Variant(Scheme(forcing=1e-5), 1e-11, 1e-11),
    "Newton 1e-2": Variant(state=1e-2),
    "Newton 1e-4": Variant(state=1e-4),
    "Newton 1e-6": Variant(state=1e-6),
    "Newton 1e-10": Variant(state=1e-10),
    "Krylov 1e-1": Variant(Scheme(forcing=1e-1)),
    "Krylov 1e-2": Variant(Scheme(forcing=1e-2)),
    "Krylov 1e-5": Variant(Scheme(forcing=1e-5)),
    "adjoint 1e-4": Variant(adjoint=1e-4),
    "adjoint 1e-6": Variant(adjoint=1e-6),
    "adjoint 1e-8": Variant(adjoint=1e-8),
    "8 points": Variant(Scheme(quadrature=8)),
    "27 points": Variant(Scheme(quadrature=27)),
    "hex8": Variant(Scheme(element="hex8")),
    "hex8, 8 points": Variant(Scheme(element="hex8", quadrature=8)),
    "double factors": Variant(Scheme(precision="double")),
    "c_r / 4": Variant(regularisation=0.25),
    "c_r / 2": Variant(regularisation=0.5),
    "c_r × 2": Variant(regularisation=2.0),
}
#: Variants that are measured between two measurements of the default.
GROUP = 3
#: On meshes from this many cells on, where a measurement takes minutes, those that matter most.
LARGE = 5000
CHOSEN = ("default", "Newton 1e-4", "Krylov 1e-2", "adjoint 1e-6", "8 points", "hex8", "double factors")


@dataclass(frozen=True)
class FixedDesign:
    """A design on the mesh that it was made on, with its state there; on that of no mesh if a formula gives it.

    Attributes:
        chi, pressure: (n_vertices,), pressure in N/mm².
        displacement: u at the vertices, (n_vertices, 3), mm.
        arm: T = [T1, T3, θ2], (3,).
    """

    domain: Domain
    chi: Floats
    displacement: Floats
    pressure: Floats
    arm: Floats

    def on(self, objective: ReducedObjective) -> tuple[Floats, tuple[Floats, Floats]]:
        """χ on another mesh, and the state (x, p) carried there, from which Newton's method finds the one there."""
        domain, source = objective.domain, self.domain
        assert isinstance(source, HalfCylinder)

        def field(values: Floats, points: Floats) -> Floats:
            return carried(values, source, points)

        u = np.stack([field(component, domain.nodes) for component in self.displacement.T], axis=-1)
        x = objective.equilibrium.kinematics.reduced(u, self.arm)
        return field(self.chi, domain.points), (x, field(self.pressure, domain.points))


def main_objective_alone(mesh: tuple[int, int, int], variant: Variant) -> ReducedObjective:
    """The paper's problem on a mesh, with all weights but that of C0 zero.

    The other terms are explicit in χ or penalise what a coarse mesh violates in its own way: a wall that leaks a
    little makes c_p p² anything. Their price is the same without their weights.
    """
    core, rings, layers = mesh
    default = MaterialSettings().hessian_regularisation
    settings = ProblemSettings(
        domain=HalfCylinderSettings(core_cells=core, rings=rings, layers=layers),
        material=MaterialSettings(hessian_regularisation=variant.regularisation * default),
    )
    material, load, limits = settings.parameters()
    alone = replace(
        limits, area_weight=0.0, slope_weight=0.0, leak_weight=0.0, strain_energy_weight=0.0, passive_weight=0.0
    )
    return ReducedObjective(settings.domain.build(), material, load, alone, threads=1, scheme=variant.scheme)


class Evaluator:
    """One model, with which every variant of the same discretisation can be measured."""

    def __init__(self, mesh: tuple[int, int, int], variant: Variant, fixed: FixedDesign | None) -> None:
        self.objective = main_objective_alone(mesh, variant)
        domain, limits = self.objective.domain, self.objective.objective
        self.directions = directions(domain)
        self.start: tuple[Floats, Floats] | None = None
        if fixed is None:
            self.chi = domain.initial_design(domain.points, limits.interface_width)
        else:
            self.chi, self.start = fixed.on(self.objective)

    def prepare(self) -> None:
        """Have factors analysed and kernels compiled, and the neighbour's state to start from unless from rest."""
        if self.start is None:
            self(Variant())
        else:
            state = self.objective.evaluate(self.chi + NEIGHBOUR * self.directions[3], self.start).state
            self.start = state.x, state.p

    def __call__(self, variant: Variant) -> dict[str, float]:
        """One evaluation: seconds, counts, and what was found."""
        objective, equilibrium = self.objective, self.objective.equilibrium
        equilibrium.scheme, equilibrium.tolerance = variant.scheme, variant.state
        objective.adjoint_tolerance = variant.adjoint
        equilibrium.forget_factors()
        work = equilibrium.work
        before = work.newton, work.krylov, work.factorisations
        began = process_time()
        at = objective.evaluate(self.chi, self.start)
        gradient = objective.gradient(at).total
        seconds = process_time() - began
        counts = (now - then for now, then in zip((work.newton, work.krylov, work.factorisations), before, strict=True))
        return {
            "seconds": seconds,
            **dict(zip(("newton", "krylov", "factorisations"), counts, strict=True)),
            "T3": float(at.state.arm[1]),
            "theta2": float(at.state.arm[2]),
            "C0": at.terms["C0"],
            **{f"g{k}": float(slope) for k, slope in enumerate(self.directions @ gradient, start=1)},
        }


def measured(
    mesh: tuple[int, int, int], names: list[str], fixed: FixedDesign | None, repeats: int
) -> Iterator[dict[str, object]]:
    """Rows of the variants asked for on one mesh: what was found, and the ratio of seconds to the default's."""
    if not names:
        return
    reference = Evaluator(mesh, VARIANTS["default"], fixed)
    reference.prepare()
    default_seconds: list[float] = []
    for first in range(0, len(names), GROUP):
        group = names[first : first + GROUP]
        evaluators = {name: reference for name in group}
        failed: dict[str, str] = {}
        ratios: dict[str, list[float]] = {name: [] for name in group}
        found: dict[str, dict[str, float]] = {}
        for name in group:
            if VARIANTS[name].discretisation != VARIANTS["default"].discretisation:
                evaluators[name] = Evaluator(mesh, VARIANTS[name], fixed)
                try:
                    evaluators[name].prepare()
                except SolveFailure as failure:
                    failed[name] = str(failure)
        for _ in range(repeats):
            default = reference(VARIANTS["default"])
            default_seconds.append(default["seconds"])
            for name in group:
                if name in failed:
                    continue
                try:
                    found[name] = default if name == "default" else evaluators[name](VARIANTS[name])
                except SolveFailure as failure:
                    failed[name] = str(failure)
                else:
                    ratios[name].append(found[name]["seconds"] / default["seconds"])
        for name in group:
            if name in failed:
                logger.info("%s: %s", name, failed[name])
                yield {"variant": name, "ratio": None}
            else:
                ratio = median(ratios[name])
                yield {"variant": name, "ratio": ratio, **found[name], "seconds": ratio * median(default_seconds)}


def own_design() -> FixedDesign:
    """The small case after some design updates."""
    settings, _ = read_case(find_case(Path("quick.yaml")))
    domain = settings.domain.build()
    objective = ReducedObjective(domain, *settings.parameters(), threads=1)
    optimiser = Optimiser(objective)
    progress = optimiser.begin(domain.initial_design(domain.points, settings.objective.interface_width))
    at = optimiser.run(progress, UPDATES).progress.evaluation
    return FixedDesign(domain, at.chi, at.state.displacement[: len(at.chi)], at.state.p, at.state.arm)


def stored_design(path: Path) -> FixedDesign:
    """The design and the state of an artifact of ``poro optimize``."""
    from pipeline.store import artifact

    domain, chi = design(path, "optimize")
    u, p, arm = artifact.read(path, "optimize", "nodes/displacement", "vertices/pressure", "arm")
    return FixedDesign(domain, chi, u[: len(chi)], p, arm)


COLUMNS = (
    *("design", "mesh", "cells", "variant", "ratio", "seconds", "newton", "krylov", "factorisations"),
    *("T3", "theta2", "C0", "g1", "g2", "g3", "g4", "g5", "g6"),
)


def main() -> None:
    """Measure what is missing, then write table and plot."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--design", type=Path, help="artifact of `poro optimize` that holds the optimised design")
    parser.add_argument("--designs", nargs="+", choices=("initial", "optimised"), default=("initial", "optimised"))
    parser.add_argument("--meshes", nargs="+", type=_mesh, default=MESHES, metavar="m,k,N1")
    parser.add_argument("--finest", type=_mesh, default=FINEST, metavar="m,k,N1", help="mesh of the reference")
    parser.add_argument("--coarser", nargs="+", type=_mesh, default=MESHES[-2:], metavar="m,k,N1",
                        help="meshes that tell how good the reference is")  # fmt: skip
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, help="only these; all if left out")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--anew", action="store_true", help="forget what has been measured")
    options = parser.parse_args()
    compile_kernels()
    use_threads(1)
    kept = (RESULTS / f"{NAME}.csv").exists() and not options.anew
    rows: list[Row] = list(read_csv(NAME)) if kept else []
    fixed: FixedDesign | None = None
    if "optimised" in options.designs:
        fixed = stored_design(options.design) if options.design else own_design()

    def keep(name: str, mesh: tuple[int, int, int], found: Row) -> None:
        cells = 2 * mesh[0] * (mesh[0] + 2 * mesh[1]) * mesh[2]
        row = {"design": name, "mesh": "{} x {} x {}".format(*mesh), "cells": cells, **found}
        rows.append({column: row.get(column) for column in COLUMNS})
        write_csv(NAME, rows)
        logger.info(" ".join(f"{key}={value}" for key, value in row.items()))

    def missing(name: str, mesh: tuple[int, int, int], variant: str) -> bool:
        key = name, "{} x {} x {}".format(*mesh), variant
        return key not in {(row["design"], row["mesh"], row["variant"]) for row in rows}

    for name in options.designs:
        there = fixed if name == "optimised" else None
        for mesh in options.meshes:
            large = 2 * mesh[0] * (mesh[0] + 2 * mesh[1]) * mesh[2] >= LARGE
            asked = options.variants or (CHOSEN if large else VARIANTS)
            for row in measured(mesh, [v for v in asked if missing(name, mesh, v)], there, options.repeats):
                keep(name, mesh, row)
        for mesh in (*options.coarser, options.finest):
            if missing(name, mesh, REFERENCE):
                found = Evaluator(mesh, TIGHT, there)(TIGHT)
                keep(name, mesh, {"variant": REFERENCE, **found})
    write_report(rows)


def _mesh(text: str) -> tuple[int, int, int]:
    core, rings, layers = (int(number) for number in text.split(","))
    return core, rings, layers


if __name__ == "__main__":
    main()

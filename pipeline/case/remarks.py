"""Values of a case that are far from what was tried: no mistakes, but to be looked at before an hour goes by."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pipeline.case.model import Case
from stages.domains import RoundSettings
from stages.similarity import PAPER

#: p_in / E over the paper's. From twice the pressure on, states were found that are not stable
#: (docs/project/notebook/stability.md, "The void is what fails"); below a hundredth a unit is mistaken, kPa for MPa.
PRESSURES = (1e-2, 2.0)
#: Cells per interface width, and longest over shortest side of a cell, that were tried (docs/explain/stability.md).
CELLS, LONGEST = (1.0, 10.0), 50.0
#: Poisson's ratio from which on the void folds at the paper's pressure (docs/project/notebook/stability.md).
POISSON = 0.45
#: Largest strain limit of the paper's designs, and of those here; above twice that the limit hardly binds.
STRAIN, MOST_STRAIN = 0.14, 0.28


def remarks(case: Case) -> list[str]:
    """Sentences, each with the key, what was tried, and what to do."""
    return [*_pressure(case), *_material(case), *_mesh(case)]


def _pressure(case: Case) -> Iterator[str]:
    paper, modulus = PAPER.load.pressure_ratio, case.material.youngs_modulus
    low, high = PRESSURES
    loads = {f"load.cases, {each.name}": case.load.only(each) for each in case.load.cases} or {"load": case.load}
    for key, load in loads.items():
        ratio = load.pressure_ratio
        stands = f"{key}: p_in / E is {ratio:.3g}, {ratio / paper:.3g} times the paper's {paper:g}"
        if ratio >= high * paper:
            yield f"{stands}; states may not be stable or not be found: lower the pressure, or try `poro simulate`."
        elif 0.0 < ratio < low * paper:
            yield f"{stands}; hardly anything moves: check the units of pressure and modulus."
    if "pressure" not in case.given:
        return
    if "youngs_modulus" not in case.material.model_fields_set:
        yield f"load.pressure: counts with the paper's E, {modulus:g} N/mm²; write material.youngs_modulus of your own."
    printed = case.rig.youngs_modulus
    if printed is not None and printed != modulus:
        on_print = case.given["pressure"] * printed / modulus
        yield (
            f"load.pressure: is that of a part of material.youngs_modulus, {modulus:g} N/mm²; on the print of "
            f"rig.youngs_modulus, {printed:g} N/mm², it is {on_print:.3g} kPa."
        )


def _material(case: Case) -> Iterator[str]:
    ratio, limit = case.material.poisson_ratio, case.objective.strain_limit
    if ratio <= POISSON:
        yield (
            f"material.poisson_ratio: is {ratio:g}; up to {POISSON:g} the void folds at the paper's pressure: raise "
            "material.hessian_regularisation."
        )
    if limit > MOST_STRAIN:
        percent = f"; {limit:g} % is written {limit / 100.0:g}" if limit >= 1.0 else ""
        yield f"objective.strain_limit: is {limit:g}, the paper's are 0.11 and {STRAIN:g}; more was not tried{percent}."


def _mesh(case: Case) -> Iterator[str]:
    domain, width = case.domain, case.objective.interface_width
    if not isinstance(domain, RoundSettings):
        return
    # Sides of cells: along X1, and the mean in the half circle.
    along = domain.length / domain.layers
    across = domain.radius * math.sqrt(0.5 * math.pi * domain.halves * domain.layers / domain.cells)
    for side, keys in ((across, "domain.core_cells and rings"), (along, "domain.layers")):
        found = width / side
        if not CELLS[0] <= found <= CELLS[1]:
            change = "raise" if found < CELLS[0] else "lower"
            yield (
                f"objective.interface_width: is {found:.2g} cells of {side:.3g} mm, {CELLS[0]:g} to {CELLS[1]:g} were "
                f"tried: {change} {keys}, or check the units."
            )
    if not 1.0 / LONGEST <= along / across <= LONGEST:
        yield (
            f"domain.layers: cells are {along:.3g} mm long and {across:.3g} mm wide, up to {LONGEST:g} to 1 was tried: "
            "change it, or domain.core_cells."
        )

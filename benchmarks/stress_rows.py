"""The trials: what is stressed, how far, and what each result is compared with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from benchmarks.stress_checks import (
    bar_rotation,
    held_arm,
    law_error,
    material_is_finite,
    patch_error,
    skewed_trial,
)
from benchmarks.stress_trial import Found, Trial, again, difference, run, settings
from stages.domains import HalfCylinderSettings
from stages.settings import ProblemSettings

#: An error, and what it is measured against.
Error = tuple[float, str]
Check = Callable[[Found, Found], Error]


@dataclass(frozen=True)
class Entry:
    """A row to be: a trial, its check against its result and the default's, and whether to follow the path as well."""

    trial: Trial
    check: Check | None = None
    follow: bool = False


def default() -> Trial:
    """What all others differ from in one respect."""
    return Trial("default", "320 cells")


# ------------------------------------------------------------------------------------------- parameters


def parameters() -> Iterator[Entry]:
    """Rows of the material and the load."""
    for ratio in (0.3, 0.4, 0.45, 0.48, 0.49, 0.499, 0.4999):
        yield Entry(Trial("ν", f"{ratio}", settings(material__poisson_ratio=ratio)))
    yield Entry(
        Trial(
            "ν, α ten times larger", "0.3", settings(material__poisson_ratio=0.3, material__hessian_regularisation=1e-5)
        )
    )
    same = settings(material__poisson_ratio=0.4999, material__hessian_regularisation=1e-6 * bulk_ratio(0.48, 0.4999))
    yield Entry(Trial("ν, c_r of the default", "0.4999", same))
    for power in range(3, 10):
        yield Entry(Trial("E0", f"1e-{power}", settings(material__stiffness_contrast=10.0**-power)))
    for power in range(3, 10):
        yield Entry(Trial("k_s / k_v", f"1e-{power}", settings(material__permeability_contrast=10.0**-power)))
    for alpha in (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4):
        yield Entry(Trial("c_r / (L² K)", f"{alpha:g}", settings(material__hessian_regularisation=alpha)))
    for factor in (0.0, 0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0):
        case = settings(load__pressure_ratio=0.02 * factor)
        yield Entry(Trial("p_in", f"{factor:g} ×", case), at_rest if factor == 0.0 else None)
    for factor in (5.0, 10.0):
        case = settings(load__pressure_ratio=0.02 * factor, material__hessian_regularisation=1e-6 * factor**3)
        yield Entry(Trial("p_in, α raised by its cube", f"{factor:g} ×", case))
    for ratio in (0.0, 1.6e-2, 1.0, 1e2, 1e4, 1e6):
        yield Entry(Trial("spring", f"{ratio:g}", settings(load__spring_ratio=ratio)), held if ratio >= 1.0 else None)


def bulk_ratio(poisson_ratio: float, other: float) -> float:
    """K at one ν over K at another."""
    return (1.0 - 2.0 * other) / (1.0 - 2.0 * poisson_ratio)


def at_rest(found: Found, _: Found) -> Error:
    """Without a pressure nothing may move."""
    return float(np.abs(found.at.state.x).max() + np.abs(found.at.state.p).max()), "rest, mm"


def held(found: Found, _: Found) -> Error:
    """A stiff spring against one that does not give."""
    exact = held_arm(found)
    return float(np.abs(found.at.state.arm - exact).max() / np.abs(exact).max()), "held end"


# ----------------------------------------------------------------------------------------------- designs


def uniform(chi: float) -> Callable[[Domain], Floats]:
    return lambda domain: np.full(domain.mesh.nvertices, chi)


def tube(factor: float) -> Callable[[Domain], Floats]:
    """The initial design, ``factor`` times as steep, cut off at ±1000."""
    return lambda domain: np.clip(factor * default().chi(domain), -1000.0, 1000.0)


def noise(size: float, seed: int = 0) -> Callable[[Domain], Floats]:
    """Independent values at the vertices."""
    return lambda domain: size * np.random.default_rng(seed).standard_normal(domain.mesh.nvertices)


def waves(domain: Domain) -> Floats:
    """Random waves about as long as the domain."""
    rng = np.random.default_rng(2)
    phases = domain.points @ (rng.normal(size=(3, 6)) * np.pi / domain.size) + rng.uniform(0.0, 2.0 * np.pi, 6)
    return np.asarray(3.0 * np.sin(phases).sum(axis=1))


def signs(domain: Domain) -> Floats:
    """±1000, by chance."""
    return np.random.default_rng(0).choice([-1000.0, 1000.0], domain.mesh.nvertices)


def designs() -> Iterator[Entry]:
    """Rows of extreme fields, without an update."""
    for chi in (-1000.0, -30.0, 30.0, 1000.0):
        yield Entry(Trial("χ everywhere", f"{chi:g}", design=uniform(chi)), laws_at(chi))
    for factor in (10.0, 1000.0):
        yield Entry(Trial("χ of the tube", f"{factor:g} ×, cut at ±1000", design=tube(factor)))
    yield Entry(Trial("χ = ±1000", "by chance", design=signs))


def laws_at(chi: float) -> Check:
    def check(found: Found, _: Found) -> Error:
        if not material_is_finite(found.objective, found.trial.chi(found.objective.domain)):
            return np.inf, "finite tangent"
        return law_error(chi), "exact fractions (laws)"

    return check


def updates(count: int = 3) -> Iterator[Entry]:
    """Rows with design updates."""
    started: tuple[tuple[str, Callable[[Domain], Floats] | None], ...] = (
        ("tube", None),
        ("all solid", uniform(8.0)),
        ("all void", uniform(-8.0)),
        ("noise", noise(3.0)),
        ("waves", waves),
    )
    for name, design in started:
        yield Entry(Trial("initial design", name, design=design, updates=count), fell)
    for name, limit in (("as it is", 0.14), ("30 ×", None), ("100 ×", None)):
        if limit is None:
            limit = exceeded(float(name.split()[0]))
        yield Entry(
            Trial("strain energy over its limit", name, settings(objective__strain_limit=limit), updates=count), fell
        )
    for cells in (1, 2, 5, 10):
        case = settings(objective__interface_width=3.0 * cells, objective__diffusivity_length=15.0 * cells)
        yield Entry(Trial("L_i in cells", f"{cells}", case, updates=count), fell)
    for factor in (2.0, 3.0):
        case = settings(load__pressure_ratio=0.02 * factor)
        yield Entry(Trial("p_in with updates", f"{factor:g} ×", case, updates=count), fell)


def exceeded(times: float) -> float:
    """Strain limit at which the default's Ψ/Ψ_lim is so large; Ψ_lim goes with its square."""
    case = settings()
    ratio = run(Trial("strain limit", "", case)).at.measures["energy_ratio"]
    return float(case.objective.strain_limit * (ratio / times) ** 0.5)


def fell(found: Found, _: Found) -> Error:
    """Largest rise of C in an update, over the start's C: must be zero."""
    values = np.array([record["C"] for record in found.history])
    return float(np.diff(values, prepend=values[0]).max(initial=0.0) / abs(values[0])), "rise of C"


# ------------------------------------------------------------------------------------------------ meshes


def meshes() -> Iterator[Entry]:
    """Rows of flat, long and skewed cells."""
    flat = settings().model_copy(update={"domain": HalfCylinderSettings(core_cells=1, rings=1, layers=100)})
    yield Entry(Trial("cells 50 times as wide as thick", "m 1, k 1, 100 layers", flat))
    for aspect in (10, 50):
        case = settings(domain__length=15.0 * aspect)
        yield Entry(Trial("cells longer than wide", f"{aspect} ×", case))
    skewed = skewed_trial()
    yield Entry(skewed, lambda found, _: (patch_error(found.objective.domain), "uniform stress"))


def locking() -> list[dict[str, object]]:
    """Rotation of a solid bar as ν nears 1/2, over M L / (E I) of Euler and Bernoulli: lines of the table."""
    lines: list[dict[str, object]] = []
    for ratio in (0.3, 0.48, 0.4999):
        coarse, fine = bar_rotation(ratio), bar_rotation(ratio, 2)
        line = {"what": "ν", "value": f"{ratio}", "converged": "yes", "rotation E I / (M L)": coarse}
        lines.append(line | {"error": abs(coarse / fine - 1.0), "against": "8 × the cells"})
    return lines


# ------------------------------------------------------------------------------------------ same answers


def scaled(length: float, stiffness: float) -> ProblemSettings:
    """The default with all lengths and all stiffnesses multiplied: the same actuator in other units."""
    case = settings()
    return settings(
        domain__radius=case.domain.size * length,
        domain__length=case.domain.length * length,
        objective__interface_width=case.objective.interface_width * length,
        objective__diffusivity_length=case.parameters()[2].diffusivity_length * length,
        objective__length_unit=length,
        material__youngs_modulus=case.material.youngs_modulus * stiffness,
    )


def same(found: Found, default: Found) -> Error:
    """Against the default."""
    return difference(found, default), "default"


def same_after_updates(found: Found, _: Found) -> Error:
    """Against the default, updated as often."""
    return difference(found, again(default(), updates=found.trial.updates)), "default"


def equal_answers() -> Iterator[Entry]:
    """Rows that must give the default's answer: scaled cases, threads, linear solvers."""
    for length, stiffness in ((1e3, 1.0), (1e-3, 1.0), (1.0, 1e3), (1.0, 1e-3), (1e3, 1e3), (1e-3, 1e-3)):
        value = f"lengths × {length:g}, E × {stiffness:g}"
        yield Entry(Trial("scaled case", value, scaled(length, stiffness)), same)
    for count in (0, 2):
        what = "threads, 2 updates" if count else "threads"
        check = same_after_updates if count else same
        for threads in (1, 2):
            yield Entry(Trial(what, f"{threads}", threads=threads, updates=count), check)
    yield Entry(Trial("linear solver", "pardiso", solver="pardiso"), same)
    yield Entry(Trial("linear solver", "superlu", solver="superlu"), same)


# ------------------------------------------------------------------------------------------- physical states


def paths() -> Iterator[Entry]:
    """Rows that compare Newton's method from rest with the path from zero pressure."""
    for factor in (1.0, 2.0, 3.0):
        yield Entry(Trial("p_in", f"{factor:g} ×", settings(load__pressure_ratio=0.02 * factor)), follow=True)
    yield Entry(Trial("c_r / (L² K)", "1e-07", settings(material__hessian_regularisation=1e-7)), follow=True)

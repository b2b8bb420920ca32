"""What the way from a design to a part costs, and how exact it is: seconds against distance.

    OMP_NUM_THREADS=1 python -m benchmarks.export_precision                      # thin walls by formula
    OMP_NUM_THREADS=1 python -m benchmarks.export_precision --design quick.h5    # an optimised design

A design on the small mesh goes through refine, mirror and export, for several factors of refinement, radii of the
filter and tolerances of the decimation, at scale 1. Every part is compared with two surfaces: the zero set of its own
refined field, which says how well the triangles follow the field, and the part of the same design refined most, with
the paper's filter, which stands for the zero set that refinement leads to. Times are CPU seconds of one thread over
those of the default, medians of several rounds. Writes a table, a CSV and a plot to ``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from time import process_time
from typing import TypeVar

import numpy as np

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.geometry.distance import distance
from actuator.geometry.hausdorff import Distance
from actuator.geometry.zero_set import Surface
from benchmarks.tables import RESULTS, Row, markdown, start_log, write_csv, write_markdown
from pipeline.store import contents
from stages import export, mirror, refine

logger = start_log("benchmarks.export_precision")
T = TypeVar("T")

#: Factor and filter radius (mm) of refine, and tolerance of the decimation (mm).
Variant = tuple[int, float, float]
DEFAULT: Variant = (2, 0.1, 0.0)
VARIANTS: tuple[Variant, ...] = (
    *((factor, radius, 0.0) for factor in (1, 2, 3, 4) for radius in (0.0, 0.1)),
    *((factor, 0.1, tolerance) for factor in (2, 3, 4) for tolerance in (0.01, 0.02, 0.05, 0.1)),
)
#: What stands for the limit of refinement.
FINEST = (6, 0.1)
#: Share of time or of distance by which a variant has to be better than the default to be named.
MUCH = 0.2


@dataclass
class Part:
    """What became of one variant.

    Attributes:
        seconds: CPU time over that of the default.
        own, own_rms: distance to the zero set of the field it was made from, before the decimation, mm.
        moved: what the decimation adds at most, mm.
        limit, limit_rms: distance to the part of the finest refinement, mm.
        volume: over that of the finest, minus 1.
    """

    variant: Variant
    seconds: float
    triangles: int
    size: int
    own: float
    own_rms: float
    moved: float
    limit: float
    limit_rms: float
    volume: float


def thin_walls() -> tuple[Domain, Floats]:
    """A bellows of radius 0.7 R with a rib across, walls of 2.2 mm, on the small mesh; χ at the vertices."""
    domain = HalfCylinder(15.0, 15.0, 6, 2, 9)
    x1, x2, x3 = domain.points.T
    r = np.hypot(x2, x3)
    middle = domain.size * (0.7 + 0.04 * np.cos(2.0 * np.pi * x1 / domain.length))
    rib = np.minimum(1.1 - np.abs(x3 - 4.0), middle - r)
    return domain, 8.0 / 3.0 * np.maximum(1.1 - np.abs(r - middle), rib)


def spread(one: Surface, other: Surface) -> tuple[float, float]:
    """Largest and root mean square distance of two surfaces symmetric about X2 = 0, the larger of both ways, mm."""
    largest, squares = [], []
    for surface, target in ((one, other), (other, one)):
        points, area = _samples(surface)
        apart = distance(points, target)
        largest.append(apart.max())
        squares.append(apart**2 @ area / area.sum())
    return float(max(largest)), float(np.sqrt(max(squares)))


def _samples(surface: Surface) -> tuple[Floats, Floats]:
    """Centroids and vertices at X2 >= 0, and the area that each stands for: exact for quadratic polynomials."""
    corners = surface.vertices[surface.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    around = np.bincount(surface.triangles.ravel(), np.repeat(area, 3), len(surface.vertices))
    points = np.concatenate([corners.mean(axis=1), surface.vertices])
    kept = points[:, 1] >= 0.0
    return points[kept], np.concatenate([0.75 * area, around / 12.0])[kept]


def _timed(call: Callable[[], T]) -> tuple[float, T]:
    began = process_time()
    result = call()
    return process_time() - began, result


class Chain:
    """refine, mirror and export of one design, with what each took."""

    def __init__(self, domain: Domain, chi: Floats) -> None:
        self.domain, self.chi = domain, chi
        self.seconds: dict[Variant, list[float]] = {}

    def run(self, variants: list[Variant]) -> dict[Variant, tuple[mirror.Result, export.Result]]:
        """All variants once; those that share a surface share the time that it took."""
        results = {}
        surfaces: dict[tuple[int, float], tuple[float, mirror.Result]] = {}
        for variant in variants:
            factor, radius, tolerance = variant
            if (factor, radius) not in surfaces:
                surfaces[factor, radius] = _timed(partial(self._surface, factor, radius))
            before, surface = surfaces[factor, radius]
            settings = export.Settings(decimation=tolerance)
            after, part = _timed(partial(export.run, surface.vertices, surface.triangles, settings))
            self.seconds.setdefault(variant, []).append(before + after)
            results[variant] = surface, part
        return results

    def _surface(self, factor: int, radius: float) -> mirror.Result:
        refined = refine.run(self.domain, self.chi, refine.Settings(factor=factor, filter_radius=radius))
        return mirror.run(refined.domain, refined.chi, mirror.Settings())

    def ratio(self, variant: Variant) -> float:
        """Median over the rounds of the time over that of the default in the same round."""
        pairs = zip(self.seconds[variant], self.seconds[DEFAULT], strict=True)
        return median(mine / default for mine, default in pairs)


def measure(
    domain: Domain, chi: Floats, rounds: int, variants: tuple[Variant, ...] = VARIANTS
) -> tuple[list[Part], Distance]:
    """All variants of one design, and how far the finest lies off its own zero set."""
    chain = Chain(domain, chi)
    chain.run([DEFAULT])  # imports and compiles
    chain.seconds.clear()
    for _ in range(rounds):
        results = chain.run(list(variants))
    reference, finest = Chain(domain, chi).run([(*FINEST, 0.0)])[(*FINEST, 0.0)]
    limit = Surface(finest.vertices, finest.triangles)
    logger.info(f"finest: {len(limit.triangles)} triangles")
    parts = []
    for variant, (surface, part) in results.items():
        largest, rms = spread(Surface(part.vertices, part.triangles), limit)
        parts.append(
            Part(
                variant,
                chain.ratio(variant),
                len(part.triangles),
                len(part.data),
                surface.distance.maximum,
                surface.distance.rms,
                part.report["moved"],
                largest,
                rms,
                part.volume / finest.volume - 1.0,
            )
        )
        logger.info(str(parts[-1]))
    return parts, reference.distance


def front(parts: list[Part], distance_of: Callable[[Part], float]) -> list[Part]:
    """Those that no other part is both faster and nearer than, fastest first."""
    best: list[Part] = []
    for part in sorted(parts, key=lambda p: (p.seconds, distance_of(p))):
        if not best or distance_of(part) < distance_of(best[-1]):
            best.append(part)
    return best


def better(parts: list[Part], distance_of: Callable[[Part], float]) -> list[Part]:
    """Those that save more than :data:`MUCH` of the default's time or distance and lose nothing of the other."""
    default = next(part for part in parts if part.variant == DEFAULT)
    found = []
    for part in parts:
        time, apart = part.seconds / default.seconds, distance_of(part) / distance_of(default)
        if (time < 1.0 - MUCH and apart <= 1.0) or (apart < 1.0 - MUCH and time <= 1.0):
            found.append(part)
    return found


def _name(variant: Variant) -> str:
    factor, radius, tolerance = variant
    return f"factor {factor}, r = {radius:g} mm" + (f", decimation {tolerance:g} mm" if tolerance else "")


def write(parts: list[Part], finest: Distance, name: str, title: str) -> str:
    """Table, CSV and plot."""
    fronts = {what: front(parts, of) for what, of in MEASURES.items()}
    rows: list[Row] = [
        {
            "factor": part.variant[0],
            "r, mm": part.variant[1],
            "decimation, mm": part.variant[2] or "off",
            "time / default": round(part.seconds, 2),
            "triangles": part.triangles,
            "STL, MB": round(part.size / 1e6, 2),
            "to its own zero set, mm: max": round(part.own, 4),
            "rms": round(part.own_rms, 4),
            "decimation adds, max": round(part.moved, 4),
            "to the finest, mm: max": round(part.limit, 4),
            "rms ": round(part.limit_rms, 4),
            "volume error, %": round(100.0 * part.volume, 3),
            "on a front": ", ".join(what for what, best in fronts.items() if part in best),
        }
        for part in parts
    ]
    sentences = [
        f"The finest is refined by a factor of {FINEST[0]} with r = {FINEST[1]:g} mm and lies {finest.maximum:.3f} mm "
        f"at most, {finest.rms:.4f} mm rms, off its own zero set."
    ]
    for what, of in MEASURES.items():
        sentences.append(f"Pareto front, time against {what} distance to the finest: ")
        sentences[-1] += "; ".join(_name(part.variant) for part in fronts[what]) + "."
        named = "; ".join(
            f"{_name(part.variant)} ({part.seconds:.2f} of the time, {of(part):.4f} mm)" for part in better(parts, of)
        )
        sentences.append(
            f"More than {100 * MUCH:.0f} % better than the default in time or {what} distance, and no worse in the "
            f"other: {named or 'none'}."
        )
    write_csv(name, rows)
    path = write_markdown(name, title, [markdown(rows), *sentences, f"![Seconds against distance]({name}.png)"])
    _plot(parts, fronts, name)
    return path.read_text(encoding="utf-8")


MEASURES: dict[str, Callable[[Part], float]] = {
    "largest": lambda part: part.limit,
    "rms": lambda part: part.limit_rms,
}


def _plot(parts: list[Part], fronts: dict[str, list[Part]], name: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    kinds = (
        ("r = 0.1 mm", "C0", "o", lambda v: v[1] > 0.0 and not v[2]),
        ("no filter", "C1", "s", lambda v: v[1] == 0.0),
        ("r = 0.1 mm, decimated", "C2", "v", lambda v: v[2] > 0.0),
    )
    for axis, (what, of) in zip(axes, MEASURES.items(), strict=True):
        best = fronts[what]
        axis.loglog([part.seconds for part in best], [of(part) for part in best], "k--", lw=0.8, label="Pareto front")
        for label, colour, marker, fits in kinds:
            chosen = [part for part in parts if fits(part.variant)]
            axis.loglog([p.seconds for p in chosen], [of(p) for p in chosen], marker, color=colour, label=label, ms=5)
            for part in chosen:
                if not part.variant[2]:
                    axis.annotate(str(part.variant[0]), (part.seconds, of(part)), (4, 4), textcoords="offset points")
        default = next(part for part in parts if part.variant == DEFAULT)
        axis.loglog([default.seconds], [of(default)], "o", mfc="none", mec="r", ms=12, label="default")
        axis.set(
            xlabel="CPU time of refine, mirror and export / default's", ylabel=f"{what} distance to the finest, mm"
        )
        axis.grid(True, which="both", alpha=0.3)
    axes[0].legend(fontsize=8)
    figure.suptitle("Numbers: factor of refinement", fontsize=9)
    figure.savefig(RESULTS / f"{name}.png", dpi=110)


def main() -> None:
    """Measure one design and write the results."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--design", type=Path, help="an optimised design, NAME.h5; without it thin walls by formula")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    if options.design is None:
        (domain, chi), what, name = thin_walls(), "thin walls by formula, 1,080 cells", "export_precision"
    else:
        domain, chi = contents.design(options.design, "optimize")
        what = f"the design of {options.design.name}, {domain.mesh.nelements:,} cells"
        name = f"export_precision-{options.design.stem}"
    logger.info(write(*measure(domain, chi, options.rounds), name, f"From a design to a part: {what}"))


if __name__ == "__main__":
    main()

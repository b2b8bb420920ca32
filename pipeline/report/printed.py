"""What the report says of the part as printed: whether it holds air, and what it does under pressure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pipeline.report.rows import Entry
from stages import inflation
from stages.rig import RigUnits

Summary = Mapping[str, Any]


def verdict(exported: Summary, inflated: Summary | None, rig: RigUnits) -> str:
    """The verdict in a paragraph; empty if nothing is known."""
    if inflated:
        moved = inflation.verdict(inflated, rig)[1:]
        return f"As printed: holds air; {'; '.join(sentence for _, sentence in moved)}."
    if exported.get("holds_air") is False:
        return f"As printed: does not hold air. {exported['chamber']}"
    return "As printed: holds air; not inflated yet." if exported.get("holds_air") else ""


def entries(found: Summary, rig: RigUnits) -> list[Entry]:
    """Figures at p_in, and what else is said of the path; volumes are those of the part."""
    at, optimised = found["at_target"], found["optimised"] or {}
    if at is None:
        return [Entry("p_in", f"not reached; largest load factor {found['largest_load']:.4g}")]

    def beside(name: str) -> str:
        change = optimised.get(name, {}).get("relative")
        return "" if change is None else f", {100.0 * change:+.1f} % against the optimiser"

    pressure, volumes = inflation.pressure_in(found, rig), (found["volume_at_rest"], at["chamber_volume"])
    rest, volume = (rig.scale**3 * each for each in volumes)
    air = inflation.air_needed(rest, volume, 1e-3 * rig.kilopascals(pressure))
    rows = [
        Entry("p_in", rig.both_pressures(pressure)),
        Entry("travel of the spring's end", f"{rig.both_lengths(abs(at['elongation']), 3)}{beside('elongation')}"),
        Entry("T3", f"{rig.both_lengths(at['T3'], 3)}{beside('T3')}".replace(" -", " −").replace("-", "−", 1)),
        Entry("θ2", f"{math.degrees(at['theta2']):.3f}°{beside('theta2')}"),
        Entry(
            "strain sqrt(2 Ψ / E)",
            f"{at['strain_max']:.3f} at most, 99 % of the volume below {at['strain_p99']:.3f}; "
            f"limit {found['strain_limit']:g}",
        ),
        Entry("volume above the limit", f"{100.0 * at['share_above']:.2g} %"),
        Entry("volume of the part's chamber", f"{rest:.0f} mm³ at rest, {volume:.0f} at p_in"),
        Entry("air it needs, at atmospheric pressure", f"{air:.0f} mm³"),
    ]
    return rows + [Entry("path", sentence) for _, sentence in inflation.lines(found, rig)]


def worst(found: Summary) -> list[tuple[str, str]]:
    """Spots of the largest strain at p_in: strain, and place."""
    return [(f"{spot['strain']:.3f}", ", ".join(f"{x:.1f}" for x in spot["at"])) for spot in found["worst"]]

"""What the report says of the response to pressure: simulated, and beside a recorded test."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.report.rows import Entry
from pipeline.results.wording import count
from stages.curves import sentences
from stages.rig import RigUnits

Summary = dict[str, Any]


def simulated(summary: Summary, rig: RigUnits) -> list[Entry]:
    """The answers of a simulation."""
    rows = []
    if at := summary["at_target"]:
        rows += [
            Entry("p_in", rig.both_pressures(summary["pressure_in"])),
            Entry("θ2 at p_in", f"{np.degrees(at['theta2']):.3f}°"),
            Entry("T3 at p_in", rig.both_lengths(at["T3"], 3)),
            Entry("travel of the arm's end at p_in", rig.both_lengths(at["elongation"], 3)),
            Entry("max Ψ / Ψ_lim at p_in", f"{at['energy_ratio']:.3f}"),
            Entry("largest p / p_in on the outer wall at p_in", f"{at['leak']:.1e}"),
        ]
    return [*rows, Entry("path", "; ".join(sentences(summary, rig)))]


def measured(comparison: Summary) -> list[Entry]:
    """The numbers of a comparison with a recorded test that matter first; what is not known is said to be so."""
    target, line, loop = comparison["target"], comparison["linearity"]["measured"], comparison["hysteresis"]
    pressure, spread = f"{target['pressure_kPa']:.4g} kPa", _number(target["spread_mm"], " ± {:.3f}", "")
    percent = _number(target["deviation_percent"], ", {:+.1f} %", "")
    return [
        Entry("recorded test", f"{comparison['measured']}, {count(comparison['cycles'], 'cycle')}"),
        *(Entry("remark in the file", remark) for remark in comparison["comments"]),
        Entry(f"measured at {pressure}", f"{target['measured_mm']:.3f}{spread} mm"),
        Entry(f"predicted at {pressure}", _number(target["predicted_mm"], "{:.3f} mm", "the prediction does not say")),
        Entry("deviation", _number(target["deviation_mm"], f"{{:+.3f}} mm{percent}", "not known")),
        Entry(
            "hysteresis",
            f"{loop['area']:.2f} % of the area under loading" if loop else "not known without a whole unloading",
        ),
        Entry("linearity of loading", f"R² {line['r_squared']:.5f}, {line['largest']:.2f} % off the line at most"),
    ]


def _number(value: float | None, pattern: str, unknown: str) -> str:
    return unknown if value is None else pattern.format(value)

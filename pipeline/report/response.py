"""What the report says of the response to pressure: simulated, and beside a recorded test."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.report.rows import Entry
from stages.curves import sentences

Summary = dict[str, Any]


def simulated(summary: Summary) -> list[Entry]:
    """The answers of a simulation, field by field."""
    rows = []
    for field, found in summary["fields"].items():
        if at := found["at_target"]:
            rows += [
                Entry(f"{field}: T3, θ2 at p_in", f"{at['T3']:.3f} mm, {np.degrees(at['theta2']):.3f}°"),
                Entry(f"{field}: spring elongation at p_in", f"{at['elongation']:.3f} mm"),
                Entry(f"{field}: max Ψ / Ψ_lim at p_in", f"{at['energy_ratio']:.3f}"),
                Entry(f"{field}: largest p / p_in on the outer wall at p_in", f"{at['leak']:.1e}"),
            ]
        rows.append(Entry(f"{field}: path", "; ".join(sentences(field, found))))
    return rows


def measured(comparison: Summary) -> list[Entry]:
    """The figures of a comparison with a recorded test that matter first."""
    target, line = comparison["target"], comparison["linearity"]["measured"]
    rows = [Entry("recorded test", f"{comparison['measured']}, {comparison['cycles']} cycles")]
    rows += [Entry("remark in the file", remark) for remark in comparison["comments"]]
    if target:
        pressure = f"{target['pressure_kPa']:.4g} kPa"
        rows += [
            Entry(f"measured at {pressure}", f"{target['measured_mm']:.3f} ± {target['spread_mm']:.3f} mm"),
            Entry(f"predicted at {pressure}", f"{target['predicted_mm']:.3f} mm"),
            Entry("deviation", f"{target['deviation_mm']:+.3f} mm, {target['deviation_percent']:+.1f} %"),
        ]
    rows += [
        Entry("hysteresis", f"{comparison['hysteresis']['area']:.2f} % of the area under loading"),
        Entry("linearity of loading", f"R² {line['r_squared']:.5f}, {line['largest']:.2f} % off the line at most"),
    ]
    return rows

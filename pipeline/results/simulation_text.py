"""What a user reads of a simulation: figures at p_in, and whether the optimised state is the one that is reached."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

#: Limit points, and changes of stability, that are said one by one.
SHOWN = 6


def lines(found: Mapping[str, Any]) -> list[str]:
    """The summary of a simulation as lines of text."""
    text = [f"  {'at p_in':<20}{'T3/mm':>10}{'theta2/deg':>12}{'spring/mm':>11}{'energy':>9}{'leak':>10}"]
    for name, field in found["fields"].items():
        at = field["at_target"]
        if at is None:
            text.append(f"  {name:<20}not reached; largest load factor {field['largest_load']:.4g}")
            continue
        text.append(
            f"  {name:<20}{at['T3']:10.4f}{math.degrees(at['theta2']):12.4f}{at['elongation']:11.4f}"
            f"{at['energy_ratio']:9.4f}{at['leak']:10.2e}"
        )
    for name, field in found["fields"].items():
        text += [f"  {name if row == 0 else '':<20}{sentence}" for row, sentence in enumerate(sentences(name, field))]
    for name, change in found["between_fields"].items():
        if name in ("T3", "theta2", "elongation"):
            text.append(
                f"  {'thresholding' if name == 'T3' else '':<20}changes {name} by {100 * change['relative']:+.2f} %"
            )
    return text


def sentences(name: str, field: Mapping[str, Any]) -> list[str]:
    """What a summary says of a field, besides its figures at p_in."""
    meant = "the optimised state" if name == "density" else "the state found directly"
    difference = field["difference"]
    said = []
    if difference:
        figures = ", ".join(f"{key} {value:.1e}" for key, value in difference.items())
        answer = "is reached" if field["reached"] else "is NOT the one that is reached"
        said.append(f"{meant} {answer} (relative differences: {figures})")
    elif field["at_target"]:
        said.append("no state was found directly to compare with")
    if field["limit_points"]:
        said += [_limit(limit) for limit in field["limit_points"][:SHOWN]]
        if (more := len(field["limit_points"]) - SHOWN) > 0:
            said.append(f"and {more} more limit points")
    else:
        said.append(f"no limit point up to a load factor of {field['largest_load']:.4g}")
    for change in [change for change in field["instabilities"] if not change["at_limit_point"]][:SHOWN]:
        (low, high), (before, after) = change["load_factors"], change["negative_eigenvalues"]
        said.append(f"between {low:.4g} and {high:.4g} the negative eigenvalues change from {before} to {after}")
    if field["hysteresis"]:
        said.append(f"up and down differ by {max(field['hysteresis'].values()):.1e} of the largest value")
    if field["ended"]:
        said.append(field["ended"])
    return said


def _limit(limit: Mapping[str, Any]) -> str:
    way = "up" if limit["loading"] else "down"
    text = f"limit point, a {limit['kind']}, at a load factor of {limit['load_factor']:.5g} on the way {way}"
    jump = limit["jump_to"]
    return text if jump is None else f"{text}: T3 would jump from {limit['T3']:.4f} to {jump['T3']:.4f} mm"

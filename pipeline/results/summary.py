"""The summary at the end of a run, for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pipeline.results import simulation_text
from pipeline.runs.execution import Execution


def as_json(execution: Execution) -> dict[str, Any]:
    """What ``--json`` prints: the optimisation's summary, then one entry per later stage, and times."""
    stages = dict(execution.summaries)
    rig = {"rig": execution.rig} if execution.rig else {}
    seconds = {stage: summary["stage_seconds"] for stage, summary in stages.items()}
    for stage, summary in stages.items():
        stages[stage] = {key: value for key, value in summary.items() if key not in ("stage_seconds", "peak_memory")}
    found = {"name": execution.job.case.name, **stages.pop("optimize", {})}
    return found | stages | rig | {"stage_seconds": seconds, "peak_memory": _peak_memory(execution)}


def as_text(execution: Execution, files: list[str]) -> str:
    """What a user reads at the end."""
    lines = [f"{execution.job.case.name}"]
    stages = execution.summaries
    if "optimize" in stages:
        lines += _design_lines(stages["optimize"])
    if "export" in stages:
        lines += _part_lines(stages["export"])
    if "simulate" in stages:
        lines += simulation_text.lines(stages["simulate"])
    if execution.rig:
        lines += _rig_lines(execution.rig)
    memory = _peak_memory(execution)
    if memory:
        lines.append(_line("peak memory", f"{memory / 2**30:.2f} GiB"))
    times = ", ".join(f"{stage} {summary['stage_seconds']:.1f}" for stage, summary in stages.items())
    lines.append(_line("seconds", times))
    lines += [_line("files" if file == files[0] else "", file) for file in files]
    return "\n".join(lines)


def _design_lines(design: Mapping[str, Any]) -> list[str]:
    return [
        _line("ended", design["reason"]),
        _line("C0", f"{design['terms']['C0']:.6f}   (total objective C {design['C']:.6f})"),
        _line("T3", f"{design['T3']:.4f} mm"),
        _line("theta2", f"{math.degrees(design['theta2']):.3f} degrees"),
        _line("spring elongation", f"{design['spring_elongation']:.3f} mm"),
        *(_line("constraints" if row == 0 else "", text) for row, text in enumerate(_constraints(design))),
        _line("stationarity", f"{design['stationarity']:.1e}"),
        *(_line("work" if row == 0 else "", text) for row, text in enumerate(_work(design))),
    ]


def _peak_memory(execution: Execution) -> int | None:
    """Largest memory of all stages, bytes; None where no system told."""
    told = (summary.get("peak_memory") for summary in execution.summaries.values())
    return max((memory for memory in told if memory), default=None)


def _constraints(design: Mapping[str, Any]) -> list[str]:
    """How well the penalised constraints are met, in physical terms."""
    shown = (
        ("wall_leak", "largest p / p_in on the outer wall {:.1e}"),
        ("wall_leak_second_order", "the same with second-order pressure {:.1e}"),
        ("energy_ratio", "largest energy density over its limit {:.3f}"),
        ("steepest", "steepest interface over its limit {:.3f}"),
        ("passive_share", "share of the solid in the passive core {:.1e}"),
    )
    # Artifacts of older versions lack some.
    return [text.format(design[key]) for key, text in shown if key in design]


def _work(design: Mapping[str, Any]) -> list[str]:
    """What the design cost."""
    if "work" not in design:  # made by an older version
        return [f"{design['updates']} updates, {design['evaluations']} evaluations"]
    work, seconds = design["work"], design["seconds_per_part"]
    return [
        f"{design['updates']} updates, {design['evaluations']} evaluations, {work['factorisations']} factorisations",
        f"{work['newton']} Newton, {work['krylov']} Krylov iterations, {work['inner']} inner steps, "
        f"{work['products']} Hessian products",
        "seconds: " + ", ".join(f"{part} {time:.1f}" for part, time in seconds.items()),
    ]


def _part_lines(part: Mapping[str, Any]) -> list[str]:
    low, high = part["bounding_box"]
    box = " x ".join(f"{b - a:.2f}" for a, b in zip(low, high, strict=True))
    lines = [
        _line("volume", f"{part['volume']:.1f} mm^3"),
        _line("watertight", "yes" if part["watertight"] else "no"),
        _line("bounding box", f"{box} mm"),
    ]
    if part["islands"]:
        volumes = [island["volume"] for island in part["islands"]]
        lines.append(_line("loose bodies removed", f"{len(volumes)}, together {sum(volumes):.2f} mm^3"))
    return lines


def _rig_lines(rig: Mapping[str, Any]) -> list[str]:
    length = "" if rig["spring_length"] is None else f", a cantilever of {rig['spring_length']:.1f} mm"
    lines = [
        _line("rig", f"p_in {rig['pressure']:.3g} kPa, arm {rig['arm_length']:g} mm"),
        _line("", f"spring {rig['spring_stiffness']:.4g} N/mm{length}"),
    ]
    if rig["spring_travel"] is not None:
        lines.append(_line("", f"predicted travel of the spring's end {rig['spring_travel']:.2f} mm"))
    return lines


def _line(name: str, value: str) -> str:
    return f"  {name:<20}{value}"

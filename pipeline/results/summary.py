"""The summary at the end of a run, for people and for programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pipeline.terminal import Verdict, painted
from stages.chain import STAGES
from stages.inflation import pressure_in
from stages.rig import RigUnits

Summaries = Mapping[str, Mapping[str, Any]]

#: Entries of every stage's summary that are told of all stages together.
_COMMON = ("stage_seconds", "peak_memory")


def as_json(name: str, summaries: Summaries, rig: RigUnits, beside: Mapping[str, Any]) -> dict[str, Any]:
    """What ``--json`` prints.

    Args:
        name: of the case.
        summaries: by stage, in N, mm and s of the case; that of a stage that works on no other stands on the outermost
            level.
        rig: the units of the part, which is told of in an entry of its own.
        beside: what was said of the files beside the artifacts.
    """
    found: dict[str, Any] = {"name": name}
    for stage, summary in summaries.items():
        own = {key: value for key, value in summary.items() if key not in _COMMON}
        found |= {stage: own} if STAGES[stage].after else own
    seconds = {stage: summary["stage_seconds"] for stage, summary in summaries.items()}
    found["part"] = {"scale": rig.scale, "youngs_modulus": rig.youngs_modulus} | _at_pressure(summaries, rig)
    return found | dict(beside) | {"stage_seconds": seconds, "peak_memory": _peak_memory(summaries)}


def _at_pressure(summaries: Summaries, rig: RigUnits) -> dict[str, Any]:
    """Pressure and travel of the part: as printed where that is known, else of the optimised density field."""
    inflated = summaries.get("inflate", {}).get("at_target")
    pressure, travel = rig.pressure, summaries.get("optimize", {}).get("spring_elongation")
    if inflated:
        pressure, travel = rig.kilopascals(pressure_in(summaries["inflate"], rig)), inflated["elongation"]
    moved = None if travel is None else abs(rig.millimetres(travel))
    return {"pressure_kPa": pressure, "travel_mm": moved, "as_printed": bool(inflated)}


def as_text(
    name: str,
    summaries: Summaries,
    rig: RigUnits,
    beside: Iterable[tuple[str, str]],
    files: Iterable[Path],
    design: str = "",
) -> str:
    """What a user reads at the end.

    Args:
        name: of the case.
        summaries: by stage, of those that are to be told.
        rig: the units of the part.
        beside: names and values of what was said of the files beside the artifacts.
        files: that were written or found up to date.
        design: where the design is told, if it is not here.
    """
    verdicts = [STAGES[stage].verdict(summary, rig) for stage, summary in summaries.items()]
    lines = list(next(filter(None, reversed(verdicts)), []))  # the last stage knows best
    lines.append(("part", rig.of_part()))
    lines += [line for stage, summary in summaries.items() for line in STAGES[stage].lines(summary, rig)]
    lines += beside
    lines += [("design", design)] if design else []
    if memory := _peak_memory(summaries):
        lines.append(("peak memory", f"{memory / 2**30:.2f} GiB"))
    times = ", ".join(f"{stage} {summary['stage_seconds']:.1f}" for stage, summary in summaries.items())
    lines.append(("seconds", times))
    lines += [("files" if row == 0 else "", str(file)) for row, file in enumerate(files)]
    return "\n".join([name, *(f"  {label:<19} {painted(value, _VERDICTS.get(value))}" for label, value in lines)])


#: What is said of a result in one word.
_VERDICTS: dict[str, Verdict] = {"yes": "pass", "no": "fail"}


def _peak_memory(summaries: Summaries) -> int | None:
    """Largest memory of all stages, bytes; None where no system told."""
    told = (summary["peak_memory"] for summary in summaries.values())
    return max((memory for memory in told if memory), default=None)

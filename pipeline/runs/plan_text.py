"""A plan for people and for programs."""

from __future__ import annotations

from pipeline.results.json_output import result_json
from pipeline.runs.plan import Step
from pipeline.runs.under_way import UnderWay


def as_text(steps: list[Step], *, reasons: bool, now: UnderWay | None = None) -> str:
    """A plan, one stage a line, and behind it what happens now."""
    rows = [(step.stage, _word(step), _why(step, reasons)) for step in steps]
    return "\n".join(f"{name:<10}{word:<12}{why}" for name, word, why in rows + (now.as_text() if now else []))


def _word(step: Step) -> str:
    return "given" if step.given else "run" if step.runs else "up to date"


def _why(step: Step, reasons: bool) -> str:
    if reasons and step.runs:
        return "; ".join(step.reasons)
    made_with = f" (made with {', '.join(step.made_with)})" if step.made_with and not step.runs else ""
    return f"{step.path}{made_with}"


def as_json(steps: list[Step], command: str, now: UnderWay | None = None) -> str:
    """A plan as JSON, and what happens now; its files are those that are up to date."""
    found = [
        {"stage": step.stage, "runs": step.runs, "given": step.given, "reasons": step.reasons}
        | {"made_with": step.made_with, "path": str(step.path)}
        for step in steps
    ]
    happening = {"under_way": now.as_json()} if now else {}
    return result_json(command, {"steps": found} | happening, [step.path for step in steps if not step.runs])

"""A plan for people and for programs."""

from __future__ import annotations

from pipeline.results.json_output import result_json
from pipeline.runs.plan import Step
from pipeline.runs.under_way import UnderWay
from pipeline.terminal import painted


def told(
    steps: list[Step], command: str, warnings: list[str], now: UnderWay | None, *, reasons: bool, as_json: bool
) -> str:
    """A plan as a command prints it; JSON has what is to be said of the case too."""
    return _as_json(steps, command, warnings, now) if as_json else as_text(steps, reasons=reasons, now=now)


def as_text(steps: list[Step], *, reasons: bool, now: UnderWay | None = None) -> str:
    """A plan, one stage a line, and behind it what happens now."""
    rows = [(step.stage, _word(step), _why(step, reasons)) for step in steps]
    rows += [(name, f"{word:<12}", why) for name, word, why in (now.as_text() if now else [])]
    width = max([9, *(len(name) for name, _, _ in rows)])
    return "\n".join(f"{name:<{width}} {word}{why}" for name, word, why in rows)


def _word(step: Step) -> str:
    if step.given:
        return f"{'given':<12}"
    return painted(f"{'run':<12}", "warn") if step.runs else painted(f"{'up to date':<12}", "pass")


def _why(step: Step, reasons: bool) -> str:
    if reasons and step.runs:
        return "; ".join(step.reasons)
    made_with = f" (made with {', '.join(step.made_with)})" if step.made_with and not step.runs else ""
    return f"{step.path}{made_with}"


def _as_json(steps: list[Step], command: str, warnings: list[str], now: UnderWay | None) -> str:
    """A plan as JSON, with what is to be said of its case and what happens now; its files are those up to date."""
    found = [
        {"stage": step.stage, "runs": step.runs, "given": step.given, "reasons": step.reasons}
        | {"made_with": step.made_with, "path": str(step.path)}
        for step in steps
    ]
    happening = {"under_way": now.as_json()} if now else {}
    return result_json(
        command,
        {"warnings": warnings, "steps": found} | happening,
        [step.path for step in steps if not step.runs],
    )

"""Stability under stress: what converges, in how many steps, how exactly, and what the program says where it does not.

    NUMBA_NUM_THREADS=2 OMP_NUM_THREADS=1 python -m benchmarks.stress         # about twenty minutes
    python -m benchmarks.stress --only parameters                             # one group, the others stay

Each row is one case of 320 cells or fewer that differs from the paper's in one respect: state and adjoint gradient
from rest, or a few design updates. NumPy's warnings are errors, and values that are not finite end the benchmark.
Writes ``benchmarks/results/stress.md`` and ``stress.csv``; docs/explain/stability.md says how to read them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from statistics import median

import numpy as np

from actuator.compilation import compile_kernels
from benchmarks.stress_checks import path_from_rest
from benchmarks.stress_rows import (
    Entry,
    default,
    designs,
    equal_answers,
    locking,
    meshes,
    parameters,
    paths,
    updates,
)
from benchmarks.stress_trial import Found, gradient_error, residual, run
from benchmarks.tables import RESULTS, Row, markdown, read_csv, start_log, write_csv, write_markdown

logger = start_log("benchmarks.stress")

GROUPS: dict[str, tuple[str, Callable[[], Iterable[Entry]]]] = {
    "parameters": ("Material and load, from rest at full pressure", parameters),
    "designs": ("Fields χ, from rest", designs),
    "meshes": ("Cells, from rest", meshes),
    "same": ("Rows that must give the default's answer", equal_answers),
    "updates": ("Three design updates", updates),
    "paths": ("The state by Newton's method from rest, and the path from zero pressure in at most 25 steps", paths),
}

TITLES = {name: title for name, (title, _) in GROUPS.items()} | {
    "locking": "A solid bar of ten radii under a small moment: rotation of 192 cells against 1,536"
}

COLUMNS = (
    "what",
    "value",
    "converged",
    "updates",
    "Newton",
    "Krylov",
    "factorisations",
    "load steps",
    "load reached",
    "limit points",
    "lowest det F",
    "negative eigenvalues",
    "residual",
    "gradient error",
    "error",
    "against",
    "time / default",
    "theta2",
    "C0",
    "rotation E I / (M L)",
    "reason",
)
#: Columns that hold no numbers.
TEXTS = ("what", "value", "converged", "against", "reason")


def tabulated(entry: Entry, reference: Found, seconds: list[float]) -> dict[str, object]:
    """The entry's figures.

    Args:
        entry: the trial and its check.
        reference: the default's result.
        seconds: of the default, run in between; one more is added, and the last nine count by their median.
    """
    trial = entry.trial
    found = run(trial)
    seconds.append(run(default()).seconds)
    steps = found.history[-1]["update"] if found.history else None
    line: dict[str, object] = {
        "what": trial.what,
        "value": trial.value,
        "converged": "yes" if found.converged else "no",
        "updates": None if steps is None else int(steps),
        "Newton": found.newton,
        "Krylov": found.krylov,
        "factorisations": found.factorisations,
        "lowest det F": None,
        "negative eigenvalues": None,
        "residual": None,
        "gradient error": None,
        "error": None,
        "against": "",
        "time / default": found.seconds / median(seconds[-9:]),
        "theta2": None,
        "C0": None,
        "reason": found.reason,
    }
    if found.converged:
        line["lowest det F"] = found.at.state.lowest_jacobian
        line["residual"] = residual(found)
        line["theta2"], line["C0"] = float(found.at.state.arm[2]), found.at.terms["C0"]
        line["gradient error"] = gradient_error(found)
        line["negative eigenvalues"] = found.objective.equilibrium.linearise(
            found.at.state, fresh=True
        ).negative_eigenvalues
        if entry.check:
            line["error"], line["against"] = entry.check(found, reference)
    if entry.follow:
        _along_the_path(line, found)
    logger.info(" | ".join(f"{key} {_short(value)}" for key, value in line.items() if value not in (None, "")))
    return line


def _along_the_path(line: dict[str, object], found: Found) -> None:
    path = path_from_rest(found)
    line["load steps"] = path.points
    line["load reached"] = path.load
    line["limit points"] = path.limits
    if found.converged and path.arm is not None:
        line["error"] = float(np.abs(path.arm - found.at.state.arm).max() / np.abs(found.at.state.arm).max())
        line["against"] = "path's state"
    line["reason"] = " ".join(filter(None, (found.reason, path.reason)))


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def main() -> None:
    """Run the groups and write the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--only", choices=[*GROUPS, "locking"], nargs="+")
    options = parser.parse_args()
    compile_kernels()
    run(default())  # loads the compiled kernels
    reference = run(default())
    seconds = [run(default()).seconds for _ in range(3)]
    for name, (_, rows) in GROUPS.items():
        if options.only and name not in options.only:
            continue
        _store(name, [tabulated(entry, reference, seconds) for entry in rows()])
    if not options.only or "locking" in options.only:
        _store("locking", locking())


def _store(group: str, lines: list[dict[str, object]]) -> None:
    """Replace a group's rows in the CSV, and write the Markdown of all groups."""
    kept = read_csv("stress") if (RESULTS / "stress.csv").exists() else []
    of_group: dict[str, list[Row]] = {name: [row for row in kept if row["group"] == name] for name in TITLES}
    of_group[group] = [{"group": group, **{key: line.get(key) for key in COLUMNS}} for line in lines]
    write_csv("stress", [row for rows in of_group.values() for row in rows])
    parts = [part for name, rows in of_group.items() if rows for part in (f"## {TITLES[name]}", _table(rows))]
    write_markdown("stress", "Stability under stress", [READING, *parts])


def _table(rows: list[Row]) -> str:
    """Markdown of the columns in which any row has something."""
    used = [key for key in COLUMNS if any(row[key] not in (None, "") for row in rows)]
    return markdown({key: _figure(row[key]) if key not in TEXTS else row[key] for key in used} for row in rows)


def _figure(value: object) -> object:
    """Numbers of the CSV as numbers; whole ones stay whole."""
    if not isinstance(value, str) or not value:
        return value
    return int(value) if value.lstrip("-").isdigit() else float(value)


READING = """By `python -m benchmarks.stress`; [docs/explain/stability.md](../../docs/explain/stability.md) says what \
the columns mean, and what follows."""


if __name__ == "__main__":
    main()

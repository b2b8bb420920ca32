"""Stability under stress: what converges, in how many steps, how exactly, and what the program says where it does not.

    NUMBA_NUM_THREADS=2 OMP_NUM_THREADS=1 python -m benchmarks.stress         # about twenty minutes
    python -m benchmarks.stress --only parameters                             # one group; writes nothing

Each row is one case of 320 cells or fewer that differs from the paper's in one respect: state and adjoint gradient
from rest, or a few design updates. NumPy's warnings are errors, and values that are not finite end the benchmark.
Writes ``benchmarks/results/stress.md`` and ``stress.csv``; docs/stability.md says how to read them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from statistics import median

import numpy as np

from actuator.compilation import compile_kernels
from benchmarks.stress_checks import path_from_rest
from benchmarks.stress_rows import (
    Locking,
    Row,
    default,
    designs,
    equal_answers,
    meshes,
    parameters,
    paths,
    updates,
)
from benchmarks.stress_trial import Found, gradient_error, residual, run
from benchmarks.tables import markdown, start_log, write_csv, write_markdown

logger = start_log("benchmarks.stress")

GROUPS: dict[str, tuple[str, Callable[[], Iterable[Row]]]] = {
    "parameters": ("Material and load, from rest at full pressure", parameters),
    "designs": ("Fields χ, from rest", designs),
    "meshes": ("Cells, from rest", meshes),
    "same": ("Rows that must give the default's answer", equal_answers),
    "updates": ("Three design updates", updates),
    "paths": ("The state by Newton's method from rest, and the path from zero pressure in at most 25 steps", paths),
}


def tabulated(row: Row, reference: Found, seconds: list[float]) -> dict[str, object]:
    """The row's figures.

    Args:
        row: the trial and its check.
        reference: the default's result.
        seconds: of the default, run in between; one more is added, and the last nine count by their median.
    """
    trial = row.trial
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
        line["negative eigenvalues"] = found.objective.equilibrium.negative_eigenvalues(found.at.state)
        if row.check:
            line["error"], line["against"] = row.check(found, reference)
    if row.follow:
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
    parts: list[str] = []
    everything: list[dict[str, object]] = []
    seconds = [run(default()).seconds for _ in range(3)]
    for name, (title, rows) in GROUPS.items():
        if options.only and name not in options.only:
            continue
        lines = [tabulated(row, reference, seconds) for row in rows()]
        everything += [{"group": name, **line} for line in lines]
        parts += [f"## {title}", _table(lines)]
    if not options.only or "locking" in options.only:
        parts += [LOCKING, markdown(Locking().rows)]
        logger.info(parts[-1])
    if not options.only:
        write_markdown("stress", "Stability under stress", [READING, *parts])
        names = list(dict.fromkeys(key for line in everything for key in line))
        write_csv("stress", [{key: line.get(key) for key in names} for line in everything])


def _table(lines: list[dict[str, object]]) -> str:
    """Markdown of the columns in which any line has something."""
    names = list(dict.fromkeys(key for line in lines for key in line))
    used = [key for key in names if any(line.get(key) not in (None, "") for line in lines)]
    return markdown({key: line.get(key) for key in used} for line in lines)


READING = """By `python -m benchmarks.stress`; [docs/stability.md](../../docs/stability.md) says what \
the columns mean, and what follows."""

LOCKING = """## Locking

Rotation of a solid bar of length 10 R under a small moment on the arm, over M L / (E I) of Euler and Bernoulli, on \
192 cells and on eight times as many."""


if __name__ == "__main__":
    main()

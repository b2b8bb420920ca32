"""How fast one program, or one setting, lowers C beside another: C against seconds of runs that are done.

    poro optimize case14.yaml --output old            # with the one program, and the same with the other
    python -m benchmarks.convergence case14 old=old/case14/details/case14.history.csv new=...

Runs that are compared must have been made on the same machine with nothing else on it. Writes the seconds at which each
run reached levels of C, their ratio, and a figure to ``benchmarks/results``. Levels are shares of the way from C = 0 to
the worst of the ends, so that every run reaches them all.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from actuator.arrays import Floats
from benchmarks.tables import RESULTS, Row, markdown, start_log, write_csv, write_markdown

logger = start_log("benchmarks.convergence")

#: Shares of the way at which seconds are compared; the last is the end of the run that stays highest.
SHARES = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 1.0)


def history(path: Path) -> tuple[Floats, Floats]:
    """Seconds and C of a run's designs, from its CSV."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    seconds, values = (np.array([float(row[key]) for row in rows]) for key in ("seconds [s]", "C [1]"))
    return seconds, values


def reached(seconds: Floats, values: Floats, level: float) -> float:
    """Seconds at which C first was at a level or below."""
    return float(seconds[np.argmax(values <= level)])


def compared(runs: dict[str, tuple[Floats, Floats]]) -> list[Row]:
    """One row per level: seconds of each run, and those of the first over those of the last."""
    end = max(values[-1] for _, values in runs.values())
    rows: list[Row] = []
    for share in SHARES:
        times = {name: reached(*run, share * end) for name, run in runs.items()}
        first, last = next(iter(times.values())), next(reversed(times.values()))
        rows.append({"share of the way": share, "C": share * end, **times, "ratio": first / last})
    return rows


def draw(name: str, runs: dict[str, tuple[Floats, Floats]]) -> Path:
    """C against seconds."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 4.0), layout="constrained")
    for label, (seconds, values) in runs.items():
        axes.plot(seconds, values, marker=".", label=label)
    axes.set(xlabel="seconds", ylabel="C", ylim=(None, min(0.02, max(v[0] for _, v in runs.values()))))
    axes.grid(visible=True, alpha=0.3)
    axes.legend()
    path = RESULTS / f"convergence-{name}.png"
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path


def main() -> None:
    """Read the runs and write what they show."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", help="of the results")
    parser.add_argument("runs", nargs="+", metavar="LABEL=CSV", help="histories, the oldest program first")
    arguments = parser.parse_args()
    runs = {label: history(Path(path)) for label, _, path in (run.partition("=") for run in arguments.runs)}
    rows = compared(runs)
    ends: list[Row] = [
        {"run": label, "updates": len(values) - 1, "C": float(values[-1]), "seconds": float(seconds[-1])}
        for label, (seconds, values) in runs.items()
    ]
    write_csv(f"convergence-{arguments.name}", rows)
    picture = draw(arguments.name, runs)
    title = f"Seconds to levels of C, {arguments.name}"
    parts = [markdown(ends), markdown(rows), f"![C against seconds]({picture.name})"]
    path = write_markdown(f"convergence-{arguments.name}", title, parts)
    logger.info("%s", path)


if __name__ == "__main__":
    main()

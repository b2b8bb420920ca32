"""What is skipped because a scene does not need it: with the needless work and without, results beside the saving.

    taskset -c 1 python -m benchmarks.skip                 # about ten minutes on one core
    taskset -c 1 python -m benchmarks.skip --only model    # or program: the other rows stay as they are

The needless work is brought about by values that are almost zero, or by calling what does more; no switch of the
product serves it. Times are medians of the processor's, of calls in turn in one process on one thread. Writes
``results/skip.csv`` and ``skip.md``, which ``docs/project/notebook/skipping.md`` explains.
"""

from __future__ import annotations

import argparse

import numpy as np

from actuator.compilation import compile_kernels
from actuator.threads import use_threads
from benchmarks.skip_model import model_skips
from benchmarks.skip_program import program_skips
from benchmarks.skip_rows import Skip
from benchmarks.tables import markdown, read_csv, start_log, write_csv, write_markdown

NAME = "skip"
PARTS = {"model": model_skips, "program": program_skips}

logger = start_log("benchmarks.skip")


def main() -> None:
    """Measure the rows and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--only", choices=PARTS, help="measure these rows and keep the others of the table")
    options = parser.parse_args()
    compile_kernels()
    use_threads(1)
    found: dict[str, list[Skip]] = {}
    for part, skips in PARTS.items():
        if options.only in (None, part):
            found[part] = []
            for skip in skips():
                found[part].append(skip)
                logger.info(f"{skip.item}: {skip.what}: {skip.skipped / max(skip.needless, 1e-300):.3g}")
    kept = read_csv(NAME) if options.only else []
    rows: list[dict[str, object]] = []
    for part in PARTS:
        these = found[part] if part in found else [Skip.from_row(row) for row in kept if row["part"] == part]
        rows += [{"part": part, **skip.row()} for skip in these]
    write_csv(NAME, rows)
    note = (
        "`left` is what is left of the needless work: of processor time, median over median of calls in turn, with "
        "`noise` the half width of the middle half of the times; of counts, their quotient. `difference` is the "
        "largest difference of the results, as a part of their largest value, unless the remark says otherwise."
    )
    table = markdown({key: value for key, value in row.items() if key != "part"} for row in rows)
    logger.info(write_markdown(NAME, "What is skipped", [note, table]).read_text(encoding="utf-8"))


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()

"""What is skipped because a scene does not need it: with the needless work and without, results beside the saving.

    taskset -c 1 python -m benchmarks.skip       # about ten minutes on one core

The needless work is brought about by values that are almost zero, or by calling what does more; no switch of the
product serves it. Times are medians of calls in turn in one process on one thread. Writes ``results/skip.csv`` and
``skip.md``, which ``docs/skipping.md`` explains.
"""

from __future__ import annotations

import numba
import numpy as np

from actuator.compilation import compile_kernels
from benchmarks.skip_model import model_skips
from benchmarks.skip_program import program_skips
from benchmarks.tables import markdown, start_log, write_csv, write_markdown

logger = start_log("benchmarks.skip")


def main() -> None:
    """Measure all rows and write the table."""
    compile_kernels()
    numba.set_num_threads(1)
    rows = []
    for skips in (model_skips(), program_skips()):
        for skip in skips:
            rows.append(skip.row())
            logger.info(f"{skip.item}: {skip.what}: {skip.skipped / max(skip.needless, 1e-300):.3g}, {skip.difference}")
    write_csv("skip", rows)
    note = (
        "`left` is what is left of the needless work: of a time, median over median of calls in turn, with `noise` the "
        "half width of the middle half of the times; of counts, their quotient. `difference` is the largest difference "
        "of the results, as a part of their largest value, unless the remark says otherwise."
    )
    path = write_markdown("skip", "What is skipped", [note, markdown(rows)])
    logger.info(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()

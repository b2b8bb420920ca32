"""What ``poro sweep`` does, without the parsing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from pipeline import terminal
from pipeline.case.model import available_cores
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.json_output import result_json
from pipeline.runs.job import default_folder
from pipeline.runs.progress import reporting
from pipeline.study import table as sweep_table
from pipeline.study.study import Variant, read_study
from pipeline.study.sweep import Sweep
from pipeline.study.table import Row

WORKFLOW = Path(__file__).parent / "workflow" / "Snakefile"


def open_sweep(path: Path, output: Path | None, threads: int) -> Sweep:
    """The sweep that a command line describes.

    Raises:
        Fault: one sentence for every mistake of the study (USAGE).
    """
    return Sweep(read_study(path), output or default_folder(), threads)


def planned(sweep: Sweep, variants: Iterable[Variant], *, as_json: bool) -> str:
    """Which cases would run."""
    found = [
        {"name": variant.case.name, "values": variant.values, "runs": not sweep.complete(variant)}
        | {"case": str(sweep.case_file(variant))}
        for variant in variants
    ]
    if as_json:
        return result_json("sweep", {"study": sweep.study.name, "cases": found}, [])
    return "\n".join(f"{'run' if entry['runs'] else 'up to date':<12}{entry['case']}" for entry in found)


def run(sweep: Sweep, variants: tuple[Variant, ...], jobs: int | None) -> None:
    """Run what is missing or stale.

    Raises:
        Fault: if the user interrupts (INTERRUPTED).
        OSError: if the disk does not take a file.
    """
    from actuator.compilation import compile_kernels

    waiting = []
    for variant in variants:
        if sweep.complete(variant):
            outcome = sweep.outcome(variant)
            assert outcome is not None, "what is complete has ended"
            sweep.keep(variant, outcome)
        else:
            waiting.append(variant)
    jobs = jobs or max(1, available_cores() // sweep.threads)
    with reporting(sweep.result("log"), "cases") as reporter:
        reporter.say(
            f"{sweep.study.name}: {len(waiting)} of {len(variants)} cases to run, {jobs} at once with "
            f"{sweep.threads} thread{'s' if sweep.threads > 1 else ''} each"
        )
        if not waiting:
            return
        laws = (variant.case.parameters()[0].law for variant in waiting)
        for law in {type(law): law for law in laws}.values():
            compile_kernels(law)  # once, not in every process
        try:
            sweep.run(waiting, jobs, reporter)
        except KeyboardInterrupt:
            left = sum(not sweep.complete(variant) for variant in variants)
            sentence = f"Interrupted with {left} of {len(variants)} cases left; run the same command to continue."
            reporter.log.error(sentence)
            raise Fault(ExitCode.INTERRUPTED, sentence) from None


def told(sweep: Sweep, *, as_json: bool) -> tuple[str, list[Row]]:
    """Write table and plot of all cases; returns what is printed, and the rows.

    Raises:
        OSError: if the folder or the disk does not take a file.
    """
    table = sweep_table.rows(sweep)
    files = sweep_table.write(sweep, table)
    if as_json:
        keys = sweep.study.keys
        found = [
            {"name": row["name"], "values": {key: row[key] for key in keys}}
            | {key: value for key, value in row.items() if key not in (*keys, "name")}
            for row in table
        ]
        return result_json("sweep", {"study": sweep.study.name, "cases": found}, files), table
    return terminal.told(sweep_table.as_markdown(sweep, table) + "\n" + "\n".join(map(str, files)), files), table


def refuse_ended(sweep: Sweep, variants: Iterable[Variant]) -> None:
    """Do nothing if these cases ended with a result; that one is not stable is for the table of all of them to say.

    Raises:
        Fault: with the exit code and sentence of the first that failed.
    """
    for variant in variants:
        outcome = sweep.outcome(variant)
        if outcome and outcome.exit_code not in (ExitCode.OK, ExitCode.UNSTABLE):
            raise Fault(ExitCode(outcome.exit_code), f"{variant.case.name}: {outcome.sentence}")


def refuse(table: list[Row]) -> None:
    """Do nothing if all cases ended well.

    Raises:
        Fault: with the exit code of the first case of the table that failed; if none failed but some have not been
            run to an end, ARTIFACT, or BUSY if others work on all of these, or else if the state of some is not
            stable, UNSTABLE.
    """
    unstable = [row for row in table if row["exit_code"] == ExitCode.UNSTABLE]
    busy = [row for row in table if row["exit_code"] == ExitCode.BUSY]
    failed = [row for row in table if row["exit_code"] and row not in (*unstable, *busy)]
    missing = [row for row in table if row["exit_code"] is None]
    if failed:
        first = failed[0]
        raise Fault(
            ExitCode(first["exit_code"]),
            f"{len(failed)} of {len(table)} cases failed, the first of them {first['name']}: {first['sentence']}",
        )
    if missing:
        raise Fault(
            ExitCode.ARTIFACT,
            f"{len(missing)} of {len(table)} cases are not run to an end, the first of them {missing[0]['name']}; "
            "run the study without --collect.",
        )
    if busy:
        raise Fault(
            ExitCode.BUSY,
            f"{len(busy)} of {len(table)} cases are not run, the first of them {busy[0]['name']}: "
            f"{busy[0]['sentence']}; run the same command again once that has ended.",
        )
    if unstable:
        first = unstable[0]
        raise Fault(
            ExitCode.UNSTABLE,
            f"The state of {len(unstable)} of {len(table)} cases is not stable, the first of them {first['name']}: "
            f"{first['sentence']}",
        )

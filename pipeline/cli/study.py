"""The commands ``poro new`` and ``poro sweep``: parsing only, as in :mod:`pipeline.cli`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli import completion
from pipeline.cli.options import Settings
from pipeline.exit_codes import ExitCode, Fault
from pipeline.terminal import show


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the case; the file is NAME.yaml.")],
    like: Annotated[
        str, typer.Option("--like", help="Case whose values it takes.", autocompletion=completion.cases)
    ] = "case14",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="The file, if not NAME.yaml here.")] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help="Also write case.schema.json beside it, by which editors check it.")
    ] = False,
    settings: Settings = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the names of the files as JSON.")] = False,
) -> None:
    """Write a commented case file with every key."""
    from pipeline.case.writer import write_new
    from pipeline.results.json_output import result_json

    files = write_new(name, like, output, force=force, schema=schema, settings=settings or ())
    show(result_json("new", {}, files) if as_json else "\n".join(map(str, files)))


def _show_workflow(wanted: bool) -> None:
    if wanted:
        from pipeline.study.command import WORKFLOW

        typer.echo(WORKFLOW)
        raise typer.Exit


def sweep(
    study: Annotated[
        Path,
        typer.Argument(metavar="STUDY", help="Study file (.yaml).", autocompletion=completion.studies),
    ],
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", min=1, help="Cases at once. Default: cores over threads.")
    ] = None,
    threads: Annotated[int, typer.Option("--threads", min=1, help="Threads of every case.")] = 1,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the results. Default: outputs/, else here.")
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Run this case and write no table; may be repeated.")
    ] = None,
    collect: Annotated[bool, typer.Option("--collect", help="Run nothing; table and plot of what there is.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Write the case files; say which would run.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
    workflow_path: Annotated[
        bool,
        typer.Option(
            "--workflow-path",
            help="Print the path of the Snakemake workflow.",
            callback=_show_workflow,
            is_eager=True,
        ),
    ] = False,
) -> None:
    """Run a case with varied keys: one process per case, restartable, a table and a plot."""
    from pipeline.study import command as commands

    if collect and only:
        raise Fault(ExitCode.USAGE, "--collect and --only exclude each other; leave out one of them.")
    sweep = commands.open_sweep(study, output, threads)
    variants = sweep.chosen(only or [])
    sweep.prepare(variants)
    if dry_run:
        show(commands.planned(sweep, variants, as_json=as_json))
        return
    if not collect:
        commands.run(sweep, variants, jobs)
    if only:
        show(commands.planned(sweep, variants, as_json=as_json))
        commands.refuse_ended(sweep, variants)
        return
    text, table = commands.told(sweep, as_json=as_json)
    show(text)
    commands.refuse(table)


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command()(new)
    app.command()(sweep)

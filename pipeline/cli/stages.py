"""The commands that run stages, made from the table of stages."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from pipeline.cli.groups import STAGE_GROUP
from pipeline.cli.options import DryRun, Force, Fresh, Json, OfCase, OfUnit, Output, Settings, Source, SourceOrSolid
from pipeline.exit_codes import ExitCode, Fault
from pipeline.terminal import note, show
from stages.chain import GOAL, PART, STAGES, Option, Stage, path_to
from stages.words import Unit

if TYPE_CHECKING:
    from pipeline.runs.job import Job
    from pipeline.runs.plan import Step

Command = Callable[..., None]


def register(app: typer.Typer) -> None:
    """Add a command for every stage that is registered now, ``run`` and ``status``."""
    for row in STAGES.values():
        app.command(row.name, help=row.help, rich_help_panel=STAGE_GROUP)(stage_command(row))
    app.command("run")(run_command())
    app.command("status")(status)


def stage_command(row: Stage) -> Command:
    """The command that runs a stage, and those before it that are missing or stale."""

    def command(
        case: Path,
        output: Path | None,
        force: bool,
        dry_run: bool,
        as_json: bool,
        settings: list[str] | None,
        fresh: bool = False,
        of_case: Path | None = None,
        unit: Unit | None = None,
        **options: Any,
    ) -> None:
        from pipeline.runs import perform as commands

        if row.takes_part:
            commands.refuse_other(case)
        job = commands.open_job(case, output, _changes(row.options, options), of_case, settings or (), unit)
        steps = commands.plan(job, last=row.name, forced=row.name if force else None)
        if dry_run:
            _show_plan(job, steps, row.name, as_json=as_json, reasons=False)
            return
        _tell(*commands.perform(job, steps, command=row.name, fresh=fresh, as_json=as_json))

    part = [_parameter("of_case", OfCase, None), _parameter("unit", OfUnit, None)] if row.takes_part else []
    fresh = [_parameter("fresh", Fresh, False)] if row.extent else []
    return _with_parameters(
        command,
        _parameter("case", SourceOrSolid if row.takes_part else Source),
        *part,
        *_of_table(row.options),
        _parameter("settings", Settings, None),
        _parameter("output", Output, None),
        _parameter("force", Force, False),
        *fresh,
        _parameter("dry_run", DryRun, False),
        _parameter("as_json", Json, False),
    )


def run_command() -> Command:
    """The command that runs all stages up to one."""
    options = STAGES[path_to(GOAL)[0]].options

    def run(
        case: Path,
        first: str | None,
        last: str | None,
        output: Path | None,
        force: bool,
        fresh: bool,
        no_inflate: bool,
        dry_run: bool,
        explain: bool,
        as_json: bool,
        settings: list[str] | None,
        **given: Any,
    ) -> None:
        """Run all stages that are missing or stale."""
        from pipeline.runs import perform as commands
        from pipeline.runs import plan_text

        if no_inflate and last:
            raise Fault(ExitCode.USAGE, f"--no-inflate and --until {last} both say where to stop; leave one out.")
        job = commands.open_job(case, output, _changes(options, given), settings=settings or ())
        last = PART if no_inflate else last
        forced = (first or path_to(GOAL)[0]) if force else None
        steps = commands.plan(job, first=first, last=last, forced=forced)
        if dry_run:
            _show_plan(job, steps, "run", as_json=as_json, reasons=explain)
            return
        if explain:
            note(plan_text.as_text(steps, reasons=True))
        _tell(*commands.perform(job, steps, command="run", fresh=fresh, as_json=as_json))

    names: Any = Literal[*STAGES]
    no_inflate = typer.Option("--no-inflate", help=f"Stop after {PART}, without what the part does under pressure.")
    explain = typer.Option("--explain", help="Say for every stage why it runs or not.")
    return _with_parameters(
        run,
        _parameter("case", Source),
        _option("first", names, "--from", "Take the stages before this one as they are."),
        _option("last", names, "--until", f"Stop after this stage. Default: {GOAL}."),
        _parameter("no_inflate", Annotated[bool, no_inflate], False),
        *_of_table(options),
        _parameter("settings", Settings, None),
        _parameter("output", Output, None),
        _parameter("force", Force, False),
        _parameter("fresh", Fresh, False),
        _parameter("dry_run", DryRun, False),
        _parameter("explain", Annotated[bool, explain], False),
        _parameter("as_json", Json, False),
    )


def status(
    case: Source, settings: Settings = None, output: Output = None, unit: OfUnit = None, as_json: Json = False
) -> None:
    """Say which stages are up to date, why others are not, and how far an optimisation is that has not ended.

    What was made with an option, such as --max-load, is up to date until the case file says something else of its key.
    The commands that run stages go by the case file and their own options: without the option they make it again.
    """
    from pipeline.runs import perform as commands

    job = commands.open_job(case, output, settings=settings or (), unit=unit, under_way=True)
    _show_plan(job, commands.status(job), "status", as_json=as_json, reasons=True)


def _show_plan(job: Job, steps: list[Step], command: str, *, as_json: bool, reasons: bool) -> None:
    """Print a plan, and on standard error what is to be said of the case."""
    from pipeline.case.remarks import remarks
    from pipeline.runs import plan_text
    from pipeline.runs.earlier import another_problem
    from pipeline.runs.under_way import under_way

    warnings = remarks(job.case)
    now = under_way(job) if command == "status" else None
    show(plan_text.told(steps, command, warnings, now, reasons=reasons, as_json=as_json))
    for sentence in warnings:
        note(f"warning: {sentence}")
    if command != "status" and (differences := another_problem(job, steps)):
        note(f"{job.files.folder} holds the results of another problem ({', '.join(differences)}); they would be kept.")


def _tell(text: str, fault: Fault | None) -> None:
    """Print a summary, and raise what is wrong with what it says."""
    show(text)
    if fault:
        raise fault


def _changes(options: Iterable[Option], given: dict[str, Any]) -> dict[Option, Any]:
    return {option: given[option.name] for option in options}


def _of_table(options: Iterable[Option]) -> list[inspect.Parameter]:
    return [
        _option(
            option.name,
            option.kind if option.choices is None else Literal[*option.choices],
            option.flag,
            option.help,
        )
        for option in options
    ]


def _option(name: str, kind: Any, flag: str, help: str) -> inspect.Parameter:
    """An option that may be left out."""
    return _parameter(name, Annotated[kind | None, typer.Option(flag, help=help)], None)


def _parameter(name: str, annotation: Any, default: Any = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _with_parameters(command: Command, *parameters: inspect.Parameter) -> Command:
    """A command that typer takes to have these parameters."""
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return command

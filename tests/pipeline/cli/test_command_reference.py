"""The reference of the commands is the program's, whatever commands it has."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.app import program
from pipeline.cli.reference import RENEWAL, main, reference

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "commands.md"


def test_committed_page_is_what_the_program_says() -> None:
    committed = PAGE.read_text(encoding="utf-8")
    assert committed == reference(program(), "poro"), f"docs/reference/commands.md is out of date; renew it: {RENEWAL}"


def test_page_has_every_command() -> None:
    text = reference(program(), "poro")
    for command in program().registered_commands:
        assert command.callback is not None
        name = command.name or command.callback.__name__.replace("_", "-")
        assert f"\n## poro {name}\n" in text
        assert f"(#poro-{name})" in text


def test_new_commands_and_groups_are_taken_up(tmp_path: Path) -> None:
    other = typer.Typer(rich_markup_mode=None)
    group = typer.Typer(help="Several cases at once.")

    @group.command()
    def start(
        size: Annotated[int, typer.Argument(metavar="SIZE", help="How many.")],
        kind: Annotated[str, typer.Option("--kind", help="This or | that.")] = "this",
        secret: Annotated[bool, typer.Option("--secret", hidden=True)] = False,
    ) -> None:
        """Start them."""

    @group.command(hidden=True)
    def inside() -> None:
        """Not for users."""

    other.add_typer(group, name="many")
    other.command("one")(lambda: None)
    text = reference(other, "tool")
    assert re.findall(r"^## (.*)$", text, flags=re.MULTILINE) == ["tool", "tool one", "tool many", "tool many start"]
    assert "\n| `SIZE <int>` | How many. | required |\n" in text
    assert "\n| `--kind <str>` | This or \\| that. | this |\n" in text
    assert "secret" not in text
    assert "inside" not in text


def test_the_module_writes_the_page(tmp_path: Path) -> None:
    main(tmp_path / "page.md")
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == reference(program(), "poro")

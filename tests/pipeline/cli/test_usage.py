"""How the program explains itself, and what it says of a command line that it does not understand."""

from __future__ import annotations

import re
import shlex

import pytest
from command_line import Poro

from pipeline.cli.app import program
from pipeline.cli.groups import GROUPS, name_of
from pipeline.exit_codes import ExitCode

COMMANDS = [name_of(command) for command in program().registered_commands]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_brief_help_and_an_example_whose_options_it_has(command: str, poro: Poro) -> None:
    ended = poro(command, "-h")
    assert ended.code == ExitCode.OK
    assert ended.out == poro(command, "--help").out
    example = ended.out.partition("\nExample:\n")[2].strip()
    words = shlex.split(example)
    assert words[:2] == ["poro", command]
    for word in words:
        if word.startswith("-"):
            assert re.search(rf"^  (-., )?{re.escape(word)}\b", ended.out, flags=re.MULTILINE), word
    for option in ("-q, --quiet", "-v, --verbose", "--color", "-h, --help"):
        assert option in ended.out


def test_commands_stand_in_groups(poro: Poro) -> None:
    out = poro("-h").out
    headings = re.findall(r"^(.*):$", out, flags=re.MULTILINE)
    assert headings == ["Options", *GROUPS]
    places = [out.index(f"\n  {name} ") for commands in GROUPS.values() for name in commands]
    assert places == sorted(places)
    # Whole sentences, however long.
    assert "one process per case, restartable, a table and a plot." in " ".join(out.split())
    assert "..." not in out.partition("Options:")[2]


def test_version(poro: Poro) -> None:
    assert poro("-V").out == poro("--version").out
    assert re.fullmatch(r"poro \d+\.\d+\.\d+\n", poro("-V").out)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("run quick.yaml --updtes 3", "No such option: --updtes. Did you mean --updates? See `poro run --help`."),
        ("run quick.yaml --blocked", "No such option: --blocked; `poro inflate` has it. See `poro run --help`."),
        ("run quick.yaml --xyzw", "No such option: --xyzw. See `poro run --help`."),
        ("exprot quick.yaml", "No such command 'exprot'. Did you mean `poro export`? See `poro --help`."),
        ("quick.yaml", "No such command 'quick.yaml'. Did you mean `poro run quick.yaml`? See `poro --help`."),
        ("export", "Missing argument 'CASE'. See `poro export --help`."),
        ("run quick.yaml --updates", "Option '--updates' requires an argument. See `poro run --help`."),
        ("run quick.yaml again", "Got unexpected extra argument(s) (again). See `poro run --help`."),
        (
            "export quick.yaml --format slt",
            "Invalid value for '--format': 'slt' is not one of 'stl', '3mf'. Did you mean stl? "
            "See `poro export --help`.",
        ),
        (
            "-q run quick.yaml -v",
            "Invalid value for '--verbose' / '-v': --quiet and --verbose exclude each other; leave one out. "
            "See `poro run --help`.",
        ),
    ],
)
def test_a_mistake_points_to_the_help_of_its_command_and_to_what_was_meant(line: str, said: str, poro: Poro) -> None:
    ended = poro(*line.split())
    assert ended.code == ExitCode.USAGE
    assert ended.err == f"poro: {said}\n"


@pytest.mark.parametrize("columns", [50, 60])
def test_help_breaks_no_word(columns: int, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    def words(text: str) -> set[str]:
        return set(re.split(r"\s+|(?<=\|)", text))  # choices may be parted at their bars

    for command in ("", "run", "check", "compare"):
        monkeypatch.setenv("COLUMNS", "80")
        wide = poro(*command.split(), "-h").out
        monkeypatch.setenv("COLUMNS", str(columns))
        narrow = poro(*command.split(), "-h").out
        assert max(map(len, narrow.partition("\nExample:\n")[0].splitlines())) <= columns, command
        assert words(narrow) == words(wide), command

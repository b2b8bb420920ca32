"""How much is said, in colours or not, and no line broken inside a word: on a terminal, in a pipe, as asked."""

from __future__ import annotations

import os
import re
import subprocess
from io import StringIO
from pathlib import Path

import pytest
from command_line import PROGRAM, Poro, environment

from pipeline.exit_codes import ExitCode
from pipeline.parts.checking import CheckReport
from pipeline.terminal import Verdict, broken, coloured, own_manner
from stages import check
from stages.check.findings import Check, Finding

HERE = ("--output", ".")


def on_terminal(folder: Path, columns: int, *arguments: str, **variables: str) -> str:
    """What a command shows on a terminal that is so many columns wide."""
    pty = pytest.importorskip("pty", reason="terminals of POSIX")
    outer, inner = pty.openpty()
    plain = {name: value for name, value in environment().items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    command = subprocess.Popen(
        [*PROGRAM, *arguments],
        cwd=folder,
        env=plain | {"TERM": "xterm", "COLUMNS": str(columns)} | variables,
        stdin=inner,
        stdout=inner,
        stderr=inner,
    )
    os.close(inner)
    shown = b""
    while True:
        try:
            more = os.read(outer, 65536)
        except OSError:  # Linux: the other end is closed
            break
        if not more:
            break
        shown += more
    os.close(outer)
    command.wait()
    return shown.decode().replace("\r\n", "\n")


def test_quiet_leaves_faults_and_names_of_files(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.solid.h5").unlink()
    ended = poro("-q", "mirror", "tiny.yaml", *HERE)
    assert (ended.code, ended.out, ended.err) == (ExitCode.OK, "tiny/details/tiny.solid.h5\n", "")
    assert "mirror: missing" in (folder / "tiny/details/tiny.log").read_text(encoding="utf-8")
    assert poro("mirror", "tiny.yaml", *HERE, "-q").out == "tiny/details/tiny.solid.h5\n"
    wrong = poro("mirror", "-q", "other.yaml", *HERE)
    assert (wrong.code, wrong.out) == (ExitCode.USAGE, "")
    assert wrong.err.startswith("poro: other.yaml: ")


def test_verbose_shows_what_goes_into_the_log(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.solid.h5").unlink()
    for arguments in (("-v", "mirror", "tiny.yaml"), ("mirror", "tiny.yaml", "--verbose", "--force")):
        said = poro(*arguments, *HERE).err
        assert re.search(r"^poro \d.*: tiny.yaml$", said, flags=re.MULTILINE)
        written = r"^mirror: tiny/details/tiny.solid.h5 written, [\d.]+ kB, after [\d.]+ s$"
        assert re.search(written, said, flags=re.MULTILINE)
        assert said.count("triangles") == 1  # what all are told is not told twice
    assert "written" not in poro("mirror", "tiny.yaml", "--force", *HERE).err
    assert "written" in (folder / "tiny/details/tiny.log").read_text(encoding="utf-8")


def test_a_stage_s_command_tells_that_stage_and_points_to_the_design(folder: Path, poro: Poro) -> None:
    out = poro("export", "tiny.yaml", *HERE).out
    assert re.search(r"^  watertight +yes$", out, flags=re.MULTILINE)
    assert re.search(r"^  design +tiny/tiny.h5, told by `poro optimize`$", out, flags=re.MULTILINE)
    assert not re.search(r"^  (C0|work|stationarity) ", out, flags=re.MULTILINE)
    assert re.search(r"^  seconds +export [\d.]+$", out, flags=re.MULTILINE)
    for command in (["optimize", "tiny.yaml"], ["run", "tiny.yaml", "--until", "export"]):
        whole = poro(*command, *HERE).out
        assert re.search(r"^  C0 ", whole, flags=re.MULTILINE)
        assert "told by" not in whole


def test_verdicts_are_coloured_on_terminals_that_have_colours(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.solid.h5").unlink()
    status = ("status", "tiny.yaml", *HERE)
    shown = on_terminal(folder, 80, *status)
    assert "\x1b[32mup to date" in shown
    assert "\x1b[33mrun" in shown
    assert "\x1b" not in poro(*status).out
    assert "\x1b[32mup to date" in poro("--color", "always", *status).out
    assert "\x1b" not in poro(*status, "--json", "--color", "always").out


class Terminal(StringIO):
    """A stream that is one."""

    def isatty(self) -> bool:
        return True


def test_colours_are_for_terminals_that_have_them_unless_the_user_does_not_want_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("NO_COLOR", "TERM"):
        monkeypatch.delenv(name, raising=False)
    assert coloured(Terminal())
    assert not coloured(StringIO())
    for name, value in (("NO_COLOR", "1"), ("TERM", "dumb")):
        with monkeypatch.context() as context:
            context.setenv(name, value)
            assert not coloured(Terminal())
    with own_manner() as manner:
        manner.colour = "never"
        assert not coloured(Terminal())


def test_findings_of_a_check_are_coloured(tmp_path: Path) -> None:
    verdicts: tuple[Verdict, ...] = ("pass", "warn", "fail")
    findings = tuple(Finding(Check.WALLS, verdict, f"is {verdict}.") for verdict in verdicts)
    result = check.Result(findings, triangles=12, size=(1.0, 1.0, 1.0))
    report = CheckReport(tmp_path / "part.stl", "", None, check.Settings(), result)
    with own_manner() as manner:
        manner.colour = "always"
        coloured = report.as_text()
    for colour, verdict in ((32, "pass"), (33, "warn"), (31, "fail")):
        assert f"\x1b[{colour}m{verdict} " in coloured
    assert re.sub(r"\x1b\[\d*m", "", coloured) == report.as_text()


def test_lines_are_broken_between_words_on_a_terminal_and_nowhere_else(folder: Path, poro: Poro) -> None:
    asked = ("run", "tiny.yaml", "--until", "nowhere")
    whole = poro(*asked).err
    assert whole.count("\n") == 1
    shown = on_terminal(folder, 60, *asked)
    assert shown.startswith("\x1b[31mporo:\x1b[0m ")
    shown = re.sub(r"\x1b\[\d*m", "", shown)
    assert max(map(len, shown.splitlines())) <= 60
    assert shown.split() == whole.split()


@pytest.mark.parametrize(
    ("line", "width", "lines"),
    [
        ("  as printed      travel 8 mm, 0.49 % more", 42, ["  as printed      travel 8 mm, 0.49 % more"]),
        (
            "  as printed      travel 8 mm, 0.49 % more",
            41,
            ["  as printed      travel 8 mm, 0.49 %", " " * 18 + "more"],
        ),
        ("  as printed      travel 8 mm, 0.49 % more", 34, ["  as printed      travel 8 mm,", "    0.49 % more"]),
        ("see /a/path/that/is/longer", 12, ["see", "    /a/path/that/is/longer"]),
        ("| a | row of Markdown |", 10, ["| a | row of Markdown |"]),
        ("\x1b[31mporo:\x1b[0m wrong", 11, ["\x1b[31mporo:\x1b[0m wrong"]),
    ],
)
def test_a_line_is_broken_below_its_last_column(line: str, width: int, lines: list[str]) -> None:
    assert broken(line, width).splitlines() == lines

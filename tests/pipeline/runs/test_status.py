"""What `poro status` calls up to date: also what was made with an option of the command line, while the case agrees."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import TINY, TO_PART, Poro

from pipeline.exit_codes import ExitCode

HERE = ("--output", ".")
#: A simulation in few steps.
BRIEF = "simulate: {max_load: 0.3, states: [0.2]}\n"


def lines(poro: Poro) -> dict[str, str]:
    """What is said of every stage."""
    ended = poro("status", "tiny.yaml", *HERE)
    assert ended.code == ExitCode.OK, ended.err
    return {line.split()[0]: " ".join(line.split()[1:]) for line in ended.out.splitlines()}


def test_simulation_made_with_an_option_is_not_stale_and_is_made_again_without_it(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + BRIEF)
    assert poro("simulate", "tiny.yaml", *HERE, "--max-load", 0.2, "--threads", 1).code == ExitCode.OK
    assert lines(poro)["simulate"] == "up to date tiny/details/tiny.simulation.h5 (made with simulate.max_load 0.2)"
    steps = json.loads(poro("status", "tiny.yaml", *HERE, "--json").out)["steps"]
    assert {step["stage"]: step["made_with"] for step in steps}["simulate"] == ["simulate.max_load 0.2"]
    # With the same option there is nothing to do; without it the case's own value is due.
    assert "simulate: up to date" in poro("simulate", "tiny.yaml", *HERE, "--max-load", 0.2).err
    again = poro("simulate", "tiny.yaml", *HERE, "--threads", 1)
    assert "simulate: settings changed: simulate.max_load 0.2 → 0.3" in again.err
    assert lines(poro)["simulate"] == "up to date tiny/details/tiny.simulation.h5"


def test_result_made_with_an_option_is_stale_once_the_case_says_something_else(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + BRIEF)
    assert poro("simulate", "tiny.yaml", *HERE, "--max-load", 0.2, "--threads", 1).code == ExitCode.OK
    (folder / "tiny.yaml").write_text(TINY + BRIEF.replace("0.3", "0.4"))
    assert lines(poro)["simulate"] == "run settings changed: simulate.max_load 0.2 → 0.4"
    (folder / "tiny.yaml").write_text(TINY + BRIEF.replace("[0.2]", "[0.1]"))
    assert "simulate.states" in lines(poro)["simulate"]
    assert "simulate.max_load" not in lines(poro)["simulate"]


@pytest.mark.usefixtures("undrawn")
def test_all_that_follows_a_result_made_with_an_option_is_up_to_date_too(folder: Path, poro: Poro) -> None:
    assert poro("run", "tiny.yaml", *HERE, *TO_PART, "--updates", 2, "--threads", 1).code == ExitCode.OK
    found = lines(poro)
    assert found["optimize"] == "up to date tiny/tiny.h5 (made with optimizer.max_updates 2)"
    assert found.pop("inflate") == "run missing"
    assert all(said.startswith("up to date") for said in found.values()), found
    # The command itself goes by the case, which asks for fewer updates than there are.
    assert poro("run", "tiny.yaml", *HERE).code == ExitCode.USAGE
    assert "optimizer.max_updates 2 → 1" in poro("run", "tiny.yaml", *HERE, "--dry-run", "--explain").out


def test_threads_are_nothing_that_a_result_is_made_with(folder: Path, poro: Poro) -> None:
    assert all("made with" not in said for said in lines(poro).values())


def test_run_serves_the_simulation_as_any_stage(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + BRIEF)
    ended = poro("run", "tiny.yaml", *HERE, "--until", "simulate", "--dry-run", "--explain")
    assert [line.split() for line in ended.out.splitlines()] == [
        ["optimize", "up", "to", "date", "tiny/tiny.h5"],
        ["simulate", "run", "missing"],
    ]
    ended = poro("run", "tiny.yaml", *HERE, "--from", "simulate", "--dry-run")
    assert ended.out.split()[-1] == "tiny/details/tiny.simulation.h5"
    ended = poro("run", "tiny.yaml", *HERE, "--until", "simulate", "--threads", 1)
    assert ended.code == ExitCode.OK, ended.err
    for name in ("tiny.simulation.h5", "tiny.simulation.csv", "tiny.simulation.png"):
        assert (folder / "tiny/details" / name).is_file()
        assert name in ended.out
    assert "simulate" not in poro("run", "tiny.yaml", *HERE, "--dry-run").out
    (folder / "tiny.yaml").write_text(TINY + BRIEF.replace("max_load: 0.3", "max_points: 2"))
    ended = poro("run", "tiny.yaml", *HERE, "--until", "simulate", "--threads", 1)
    assert ended.code == ExitCode.NOT_CONVERGED
    assert "The path has more than 2 points" in ended.err


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--from", "export", "--until", "refine"), "--from export comes after --until refine; exchange them."),
        (
            ("--from", "mirror", "--until", "simulate"),
            "--from mirror: 'simulate' does not need it; choose one of optimize, simulate.",
        ),
    ],
)
def test_first_stage_must_be_on_the_way_to_the_last(options: tuple[str, ...], sentence: str, poro: Poro) -> None:
    Path("tiny.yaml").write_text(TINY)
    ended = poro("run", "tiny.yaml", *options)
    assert ended.code == ExitCode.USAGE
    assert ended.err == f"poro: {sentence}\n"

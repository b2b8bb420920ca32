"""The law in the case file: spelling, mistakes, what it makes stale, and an optimisation with another law."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import TINY, Poro

from actuator.material.laws.mooney_rivlin import MooneyRivlin
from actuator.material.laws.neo_hooke import NeoHooke
from actuator.material.laws.ogden import Ogden
from actuator.material.laws.yeoh import Yeoh
from actuator.parameters import Law
from pipeline.case.model import Case, parse_case
from pipeline.exit_codes import ExitCode
from pipeline.runs import keys
from pipeline.store import artifact

OGDEN = "material:\n  law: {name: ogden, mu: [0.7, 0.3], alpha: [1.3, 4.0]}\n"


def case_of(law: str) -> Case:
    return parse_case(f"material:\n  law: {law}\n".encode(), "case.yaml", "case")


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ("neo-hooke", NeoHooke()),
        ("{name: neo-hooke}", NeoHooke()),
        ("{name: mooney-rivlin, c01: 0.2}", MooneyRivlin(0.2)),
        ("{name: yeoh, c2: -0.01, c3: 0.001}", Yeoh(-0.01, 0.001)),
        ("{name: ogden, mu: [1.0], alpha: [3]}", Ogden.of([1.0], [3.0])),
        ("{name: ogden, mu: [0.7, 0.2, 0.1], alpha: [1.3, 5.0, -2.0]}", Ogden.of([0.7, 0.2, 0.1], [1.3, 5.0, -2.0])),
    ],
)
def test_law_of_a_case(text: str, law: Law) -> None:
    found = case_of(text).parameters()[0].law
    assert type(found) is type(law)
    assert list(found) == pytest.approx(list(law), rel=1e-15)


MISTAKES = {
    "unknown law": ("yoeh", 2, ["material.law.name", "'yoeh'", "'mooney-rivlin'"]),
    "no name": ("{c01: 0.1}", 2, ["material.law.name", "is missing"]),
    "no section": ("3", 2, ["material.law", "section of keys"]),
    "missing coefficient": ("\n    name: yeoh\n    c2: 0.1", 2, ["material.law.c3", "is missing"]),
    "another law's coefficient": ("\n    name: mooney-rivlin\n    c01: 0.1\n    c2: 0.1", 5, ["law.c2", "unknown key"]),
    "misspelt coefficient": ("\n    name: mooney-rivlin\n    c01: 0.1\n    c-01: 0.1", 5, ["law.c-01", "'c01'"]),
    "text for a number": ("\n    name: yeoh\n    c2: soft\n    c3: 0.1", 4, ["law.c2", "must be a number"]),
    "sum": ("\n    name: ogden\n    mu: [0.5, 0.4]\n    alpha: [2.0, 3.0]", 2, ["add up to 0.9, not 1", "divide"]),
    "lengths": ("\n    name: ogden\n    mu: [0.5, 0.5]\n    alpha: [2.0]", 2, ["mu has 2 and alpha 1"]),
    "exponent": ("\n    name: ogden\n    mu: [1.0]\n    alpha: [0.0]", 2, ["alpha", "away from zero"]),
    "no list": ("\n    name: ogden\n    mu: 1.0\n    alpha: [2.0]", 4, ["law.mu", "must be a list"]),
    "entry": ("\n    name: ogden\n    mu: [0.5, x]\n    alpha: [2.0, 3.0]", 4, ["law.mu.1", "must be a number"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_give_one_sentence_with_line_key_and_remedy(mistake: str, poro: Poro) -> None:
    law, line, parts = MISTAKES[mistake]
    Path("case.yaml").write_text(f"material:\n  law: {law}\n")
    ended = poro("optimize", "case.yaml")
    assert ended.code == ExitCode.USAGE
    assert ended.err.startswith(f"poro: case.yaml:{line}: ")
    assert ended.err.rstrip("\n").count("\n") == 0
    assert all(part in ended.err for part in parts), ended.err


def test_schema_has_every_law(poro: Poro) -> None:
    schema = json.loads(poro("schema").out)
    kinds = schema["$defs"]["MaterialSettings"]["properties"]["law"]["anyOf"][1]["discriminator"]["mapping"]
    assert set(kinds) == {"neo-hooke", "mooney-rivlin", "yeoh", "ogden"}


def test_key_of_a_case_with_the_default_law_is_that_of_one_without() -> None:
    without, short, long = (
        keys.plain(case)
        for case in (parse_case(b"name: case", "case.yaml", "case"), case_of("neo-hooke"), case_of("{name: neo-hooke}"))
    )
    assert without == short == long
    assert without["material"]["law"] == {"name": "neo-hooke"}
    assert keys.plain(case_of("{name: yeoh, c2: 0.1, c3: 0.1}"))["material"]["law"]["name"] == "yeoh"


def test_changed_law_is_a_reason_to_optimise_again(folder: Path, poro: Poro) -> None:
    for text, first in ((TINY + "material: {law: neo-hooke}\n", []), (TINY + OGDEN, ["optimize"])):
        (folder / "tiny.yaml").write_text(text)
        ended = poro("run", "tiny.yaml", "--output", ".", "--no-inflate", "--dry-run", "--json")
        steps = {step["stage"]: step["reasons"] for step in json.loads(ended.out)["steps"]}
        assert [stage for stage, reasons in steps.items() if reasons][:1] == first
    assert "material.law.name neo-hooke → ogden" in "; ".join(steps["optimize"])


@pytest.mark.slow
def test_two_updates_and_a_simulation_with_the_ogden_law(tmp_path: Path, poro: Poro) -> None:
    case = TINY.replace("max_updates: 1", "max_updates: 2") + OGDEN
    case += "simulate: {max_load: 1.0, states: [1.0]}\n"
    (tmp_path / "soft.yaml").write_text(case)
    ended = poro("optimize", "soft.yaml", "--threads", 1, "--json")
    assert ended.code == ExitCode.OK, ended.err
    history = artifact.read_group(Path("soft.h5"), "optimize", "history")
    assert len(history["C"]) == 3
    assert (np.diff(history["C"]) < 0.0).all()
    stored = artifact.read_header(Path("soft.h5")).case_resolved["material"]["law"]
    assert stored == {"name": "ogden", "mu": [0.7, 0.3], "alpha": [1.3, 4.0]}
    # The artifact is enough to go on from, and the law is no reason to compute again.
    assert "up to date" in poro("status", "soft.yaml", "--output", ".").out.splitlines()[0]
    simulated = json.loads(poro("simulate", "soft.yaml", "--output", ".", "--threads", 1, "--json").out)
    assert simulated["simulate"]["reached"] is True

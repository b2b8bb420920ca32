"""Every equation that the code and the documents cite is in docs/explain/theory.md, and is the one that is meant."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
THEORY = (ROOT / "docs" / "explain" / "theory.md").read_text(encoding="utf-8")
NUMBER = r"\(?([1-9]\d*)\)?"
CITATION = re.compile(rf"\b(?:Eqs?\.|equations?) {NUMBER}(?: (to|and) {NUMBER})?")

FOLDERS = ["actuator", "stages", "pipeline", "tests", "docs"]


def texts(folder: str) -> Iterator[tuple[str, int, str]]:
    """Path, line number and text of all lines of a folder."""
    for path in sorted((ROOT / folder).rglob("*")):
        if path.suffix in (".py", ".md") and path != Path(__file__):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                yield str(path.relative_to(ROOT)), number, line


def tags() -> list[str]:
    """Number of each equation."""
    return re.findall(r"\\tag\{([^}]+)\}", THEORY)


def cited(line: str) -> list[str]:
    """The equations that a line cites, ranges written out."""
    found: list[str] = []
    for first, word, last in CITATION.findall(line):
        if word == "to":
            assert first.isdigit(), line
            assert last.isdigit(), line
            found += [str(number) for number in range(int(first), int(last) + 1)]
        else:
            found += [first, last] if word else [first]
    return found


def quantities() -> dict[str, str]:
    """Equation of each quantity that the list of equations names."""
    rows = re.findall(r"^\| \((\d+)\)[^|]*\| ([^|]*) \|", THEORY, flags=re.MULTILINE)
    return {name: number for number, what in rows for name in re.findall(r"`([^`]+)`", what)}


def test_equations_are_numbered_as_in_the_paper() -> None:
    """22 of them in a row: 17 in the text, 5 in the appendices."""
    numbers = tags()
    assert numbers == [str(number) for number in range(1, 23)]
    assert re.findall(r"^\| \((\d+)\)", THEORY, flags=re.MULTILINE) == numbers


@pytest.mark.parametrize("folder", FOLDERS)
def test_cited_equations_exist(folder: str) -> None:
    known = set(tags())
    wrong = [f"{path}:{number}: {line.strip()}" for path, number, line in texts(folder) if set(cited(line)) - known]
    assert wrong == [], "write these equations in docs/explain/theory.md with \\tag{n}, or cite others"


def test_citations_are_found() -> None:
    """So that the test above cannot pass by seeing none."""
    assert cited("Eqs. (6) to (8), Eq. (18), Eqs. 5 and 6 (Eq. 14)") == ["6", "7", "8", "18", "5", "6", "14"]
    assert {"1", "2", "3", "4", "5", "6", "8"} <= {each for *_, line in texts("actuator") for each in cited(line)}


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_quantity_cited_with_its_equation_has_that_number(folder: str) -> None:
    """Such as C_Ψ of Eq. (14) or the adjoint (Eq. 16)."""
    named = quantities()
    wrong = []
    for path, number, line in texts(folder):
        for name, due in named.items():
            for found in re.findall(rf"{re.escape(name)},?(?: of| is 4 / L_i)? \(?Eq\. {NUMBER}", line):
                if found != due:
                    wrong.append(f"{path}:{number}: {name} is Eq. ({due}), not ({found})")
    assert wrong == []


def test_formulas_survive_markdown() -> None:
    """A line of a formula that begins like a list, a heading or a quotation would end it."""
    blocks = re.findall(r"^\$\$\n(.*?)\n\$\$$", THEORY, flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) == 22
    assert THEORY.count("$") == 4 * len(blocks)
    lines = [line for block in blocks for line in block.splitlines()]
    assert [line for line in lines if not line.strip() or re.match(r"\s*([-+*] |=|#|>|\d+[.)] )", line)] == []
    for block in blocks:
        assert block.count("{") == block.count("}")
        assert block.count(r"\left") - block.count(r"\leftarrow") == block.count(r"\right")

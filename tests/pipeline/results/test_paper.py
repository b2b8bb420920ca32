"""The paper's designs, recognised by the problem and not by a name."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from pipeline.case.changes import changed
from pipeline.case.model import Case, find_case, read_case
from pipeline.results.paper import REFERENCES, on_the_papers_mesh, reading, reference_of


def shipped(name: str) -> Case:
    return read_case(find_case(Path(name)))[0]


@pytest.mark.parametrize(
    ("name", "elongation", "own_mesh"), [("case14", 15.327, True), ("case11", 12.376, True), ("quick", 15.327, False)]
)
def test_shipped_cases_are_the_papers(name: str, elongation: float, own_mesh: bool) -> None:
    case = shipped(f"{name}.yaml").model_copy(update={"name": "another"})
    reference = reference_of(case)
    assert reference is not None
    assert reference.elongation == elongation
    assert on_the_papers_mesh(case.domain) == own_mesh


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("domain", "length", 16.0),
        ("material", "poisson_ratio", 0.49),
        ("load", "pressure_ratio", 0.021),
        ("objective", "strain_limit", 0.12),
        ("objective", "area_weight", 0.0),
        ("objective", "length_unit", 2.0),
        ("material", "law", {"name": "yeoh", "c2": 0.1, "c3": 0.0}),
    ],
)
def test_another_problem_is_not_the_papers(section: str, key: str, value: Any) -> None:
    assert reference_of(changed(shipped("case14.yaml"), {f"{section}.{key}": value})) is None


def test_reading_names_what_the_paper_leaves_open() -> None:
    read, printed = (reading(shipped(f"{name}.yaml").optimize) for name in ("case14", "case14-eq14-shift"))
    assert read.startswith("the shift of χ 0 where Eq. (14) has 4/L_i, c_r = 1e-06 L² K_s, ")
    assert "4/L_i in mm as Eq. (14) prints it" in printed
    plain = changed(shipped("case14.yaml"), {"elements.pressure": "plain"})
    assert reading(plain.optimize).endswith("elements of p plain")


@pytest.mark.parametrize("name", ["case14.yaml", "case11.yaml"])
def test_numbers_agree_with_each_other(name: str) -> None:
    """Elongation and C0 = -elongation / L_arm follow from T3 and θ2, as printed."""
    case = shipped(name)
    reference = reference_of(case)
    assert reference
    arm = case.load.arm_ratio * case.domain.radius
    elongation = arm * math.sin(reference.theta2) - reference.T3
    assert elongation == pytest.approx(reference.elongation, abs=2e-3)
    published = reference.C0
    assert published == pytest.approx(-elongation / arm, abs=2e-5)


def test_readme_shows_the_same_numbers() -> None:
    """And the readings of the paper, in every table that has them."""
    root = Path(__file__).parents[3]
    for page in (root / "README.md", root / "docs" / "explain" / "readings.md"):
        lines = page.read_text(encoding="utf-8").splitlines()
        rows = [
            [cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| the paper, ")
        ]
        assert [row[0] for row in rows] == [f"the paper, {100 * each.strain_limit:g} %" for each in REFERENCES], page
        for row, reference in zip(rows, REFERENCES, strict=True):
            assert row[2:6] == [
                f"{reference.C0:.4f}",
                f"{reference.T3:.3f} mm",
                f"{math.degrees(reference.theta2):.3f}°",
                f"{reference.elongation:.3f} mm",
            ]

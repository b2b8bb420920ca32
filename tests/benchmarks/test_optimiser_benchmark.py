"""The benchmark of the optimiser: its search by gradients, its change of mesh, and its race."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from physics import half_cylinder
from small_case import small_objective, start_of

from benchmarks import optimiser, tables
from benchmarks.gradient_descent import GradientDescent
from benchmarks.optimiser import Race, prolonged, reached, read, variants, write
from stages.domains import HalfCylinderSettings
from stages.optimize import Settings


def test_gradients_alone_lower_the_objective() -> None:
    """And what is learnt from them changes the search."""
    found = []
    for learns in (False, True):
        objective = small_objective()
        search = GradientDescent(objective, start_of(objective.domain), learns=learns)
        values = [search.at.value]
        for _ in range(2):
            search.update()
            values.append(search.at.value)
        assert (np.diff(values) < 0.0).all()
        assert search.updates == 2
        assert search.evaluations >= 3
        # What it holds is the objective of its design.
        assert objective.evaluate(search.at.chi).value == pytest.approx(search.at.value, rel=1e-6)
        found.append(search.at.chi)
    assert np.abs(found[0] - found[1]).max() > 1e-6


def test_a_linear_field_keeps_its_values_on_another_mesh() -> None:
    coarse, fine = half_cylinder(2, 1, 3), half_cylinder(3, 2, 4)

    def linear(points: np.ndarray) -> np.ndarray:
        return 1.0 + points @ [0.3, -0.2, 0.1]

    # Between the coarse facets and the wall the value below counts: 2 % of R further inside.
    inside = np.hypot(fine.points[:, 1], fine.points[:, 2]) < 0.98 * fine.radius
    assert inside.sum() > 40
    found = prolonged(coarse, linear(coarse.points), fine)
    np.testing.assert_allclose(found[inside], linear(fine.points)[inside], atol=1e-9)
    assert np.abs(found - linear(fine.points)).max() < 0.02 * fine.radius * np.hypot(0.2, 0.1)


def test_last_design_within_a_limit() -> None:
    curve = [
        {"cpu_s": 1.0, "C": 3.0, "mesh": "coarse"},
        {"cpu_s": 2.0, "C": 2.0, "mesh": ""},
        {"cpu_s": 4.0, "C": 1.0, "mesh": ""},
    ]
    assert reached(curve, "cpu_s", 0.5) is None
    assert reached(curve, "cpu_s", 1.5) is None
    assert reached(curve, "cpu_s", 3.0) is curve[1]
    assert reached(curve, "cpu_s", 4.0) is curve[2]


def test_all_variants_get_the_same_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (optimiser, tables):
        monkeypatch.setattr(module, "RESULTS", tmp_path)
    monkeypatch.setattr(optimiser, "COARSE", (2, 2, 3))
    monkeypatch.setattr(optimiser, "COARSE_UPDATES", 1)
    settings = Settings(domain=HalfCylinderSettings(radius=15.0, length=15.0, core_cells=3, rings=2, layers=4))
    every = variants(settings)
    assert len(every) == 6
    race = Race(settings, {name: every[name] for name in every if "at most" not in name})
    race.run(0.5, lambda: None)
    assert len(race.curves) == 3
    for name, curve in race.curves.items():
        assert race.seconds[name] >= 0.5, name
        assert curve[-2]["cpu_s"] < 0.5, name
        assert curve[-1]["C"] < curve[0]["C"], name
    text = write(race.curves).read_text(encoding="utf-8")
    assert all(name in text for name in race.curves)
    assert write(read()).read_text(encoding="utf-8") == text
    assert (tmp_path / "optimiser.png").exists()

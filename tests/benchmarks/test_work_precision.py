"""The benchmark of run time against error: designs carried between meshes, its judgement, and a run on few cells."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from physics import LENGTH, RADIUS, Floats, half_cylinder

from actuator.domains.half_cylinder import HalfCylinder
from benchmarks import tables, tolerances, work_precision, work_precision_report
from benchmarks.designs import carried, directions

COARSE, FINE = half_cylinder(4, 2, 5), HalfCylinder(RADIUS, LENGTH, 7, 3, 8)


def test_a_field_carried_to_its_own_mesh_is_the_field() -> None:
    chi = np.random.default_rng(1).normal(size=len(COARSE.points))
    assert np.abs(carried(chi, COARSE, COARSE.points) - chi).max() < 1e-12


def test_linear_fields_are_carried_exactly_but_for_the_gap_at_the_wall() -> None:
    slope = np.array([0.3, -0.7, 1.1])
    found = carried(COARSE.points @ slope, COARSE, FINE.points) - FINE.points @ slope
    chord = RADIUS * np.cos(np.pi / (8 * COARSE.core_cells))
    inside = np.hypot(*FINE.points[:, 1:].T) < chord
    assert np.abs(found[inside]).max() < 1e-11
    assert np.abs(found).max() < 2.0 * (RADIUS - chord)
    assert inside.sum() > 0.5 * len(inside)


def test_carried_fields_stay_within_their_bounds() -> None:
    chi = np.random.default_rng(2).uniform(-3.0, 5.0, size=len(COARSE.points))
    found = carried(chi, COARSE, FINE.points)
    assert chi.min() <= found.min() < -1.0
    assert 3.0 < found.max() <= chi.max()


def test_directions_are_of_size_one_and_independent() -> None:
    d = directions(FINE)
    assert d.shape == (6, len(FINE.points))
    assert np.abs(d).max(axis=1) == pytest.approx(1.0, abs=0.1)
    assert np.linalg.cond(d) < 10.0


def test_front_holds_what_nothing_else_beats() -> None:
    seconds, error = np.array([1.0, 2.0, 3.0, 2.0, 0.5]), np.array([0.3, 0.2, 0.2, 0.1, 0.9])
    assert work_precision_report.front(seconds, error).tolist() == [True, False, False, True, True]


@pytest.mark.parametrize(
    ("ratio", "factor", "expected"),
    [(0.79, 1.0, True), (0.81, 0.5, False), (0.5, 1.02, False), (0.5, [1, 1, 1, 1.1], False)],
)
def test_the_default_is_beaten_by_a_fifth_of_the_time_at_no_larger_error(
    ratio: float, factor: float | list[float], expected: bool
) -> None:
    default = np.array([0.1, 0.2, 0.1, 0.3])
    assert work_precision_report.beats(ratio, np.array(factor) * default, default) is expected


def test_richardson_finds_order_and_limit() -> None:
    h = np.array([1.0, 0.7, 0.4])
    order, limit = work_precision_report.richardson(h, 2.0 - 0.3 * h**1.7)
    assert order == pytest.approx(1.7, abs=2e-3)
    assert limit == pytest.approx(2.0, abs=1e-3)
    assert np.isnan(work_precision_report.richardson(h, np.array([1.0, 1.1, 1.05]))).all()


def test_richardson_does_not_believe_a_high_order() -> None:
    h = np.array([1.0, 0.7, 0.4])
    order, limit = work_precision_report.richardson(h, 2.0 - 0.3 * h**4)
    assert order == pytest.approx(4.0, abs=2e-3)
    assert limit == pytest.approx(2.0 - 0.3 * 0.4**4 + 0.3 * (0.7**4 - 0.4**4) / (0.7**2 / 0.4**2 - 1.0), abs=1e-6)


def test_benchmark_measures_once_and_writes_table_and_plot(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for module in (tables, work_precision, work_precision_report):
        monkeypatch.setattr(module, "RESULTS", tmp_path)
    words = "--designs initial --meshes 2,1,3 --finest 4,2,6 --coarser 2,1,3 3,1,4 --repeats 1"
    names = ["default", "tight tolerances", "hex8", "Newton 1e-4"]
    monkeypatch.setattr(sys, "argv", ["work_precision", *words.split(), "--variants", *names])
    work_precision.main()
    rows = {(row["mesh"], row["variant"]): row for row in tables.read_csv("work_precision")}
    assert set(rows) == {
        *(("2 x 1 x 3", name) for name in names),
        *((mesh, "reference") for mesh in ("2 x 1 x 3", "3 x 1 x 4", "4 x 2 x 6")),
    }
    default, hex8 = rows["2 x 1 x 3", "default"], rows["2 x 1 x 3", "hex8"]
    assert float(default["ratio"]) == 1.0
    assert float(hex8["seconds"]) > 0.0
    assert abs(float(hex8["T3"])) < 0.9 * abs(float(default["T3"]))

    def error(name: str) -> Floats:
        return work_precision_report.errors(rows["2 x 1 x 3", name], rows["4 x 2 x 6", "reference"])

    assert np.all(error("default") < 0.9)
    assert np.abs(error("tight tolerances") - error("default")).max() < 1e-6
    text = (tmp_path / "work_precision.md").read_text()
    assert "## Initial design" in text
    assert "Beats the default:" in text
    assert (tmp_path / "work_precision.png").stat().st_size > 10_000

    before = (tmp_path / "work_precision.csv").read_text()
    work_precision.main()
    assert (tmp_path / "work_precision.csv").read_text() == before


def test_tolerances_of_a_stored_design(finished: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tables, "RESULTS", tmp_path)
    monkeypatch.setattr(sys, "argv", ["tolerances", "--design", str(finished / "tiny/tiny.h5")])
    tolerances.main()
    head, _, *rows = (tmp_path / "tolerances.md").read_text().splitlines()[4:]
    columns = [name.strip() for name in head.split("|")[1:-1]]
    table = [dict(zip(columns, map(str.strip, row.split("|")[1:-1]), strict=True)) for row in rows]
    assert [float(row["state"]) for row in table] == [1e-11, 1e-2, 1e-4, 1e-6, 1e-8, 1e-8]
    errors = [float(row["relative error of dC/dχ"]) for row in table]
    assert errors[0] == 0.0
    # On so coarse a mesh the leak makes the adjoint's load, and with it what its tolerance leaves, large.
    assert errors[4] < 2e-4
    assert errors[4] < errors[1]

"""The benchmark of the way from a design to a part: what its distances and fronts are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from physics import half_cylinder
from small_case import start_of

from actuator.geometry.zero_set import Surface
from benchmarks import export_precision, tables
from benchmarks.export_precision import DEFAULT, Part, better, front, measure, spread, thin_walls


def box(length: float) -> Surface:
    """A box of 2 x 2 about the axis, symmetric about X2 = 0, from X1 = 0."""
    corners = np.array([(x, y, z) for x in (0.0, length) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Surface(corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def part(seconds: float, limit: float, variant: tuple[int, float, float] = (3, 0.1, 0.0)) -> Part:
    return Part(variant, seconds, 1, 1, 0.0, 0.0, 0.0, limit, limit, 0.0)


def test_spread_of_two_boxes() -> None:
    """One end lies 0.5 further: that far at most, and on one of all areas in the mean."""
    assert spread(box(4.0), box(4.0)) == (0.0, 0.0)
    largest, rms = spread(box(4.0), box(4.5))
    assert largest == pytest.approx(0.5)
    # The longer box's end of area 4, of 4 + 4 + 4·2·4.5, is 0.5 off, and its sides near that end somewhat.
    assert 0.5 * np.sqrt(4.0 / 44.0) <= rms < 0.5


def test_front_and_what_beats_the_default() -> None:
    default = part(1.0, 0.1, DEFAULT)
    faster, nearer, slower, little = part(0.5, 0.1), part(1.0, 0.05), part(2.0, 0.2), part(0.9, 0.1)
    parts = [slower, little, nearer, default, faster]

    def of(p: Part) -> float:
        return p.limit

    assert front(parts, of) == [faster, nearer]
    assert better(parts, of) == [nearer, faster]


def test_variants_of_a_tube(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_precision, "FINEST", (4, 0.1))
    monkeypatch.setattr(export_precision, "RESULTS", tmp_path)
    monkeypatch.setattr(tables, "RESULTS", tmp_path)
    domain = half_cylinder(3, 2, 4)
    parts, finest = measure(domain, start_of(domain), 1, ((1, 0.1, 0.0), DEFAULT, (2, 0.1, 0.05)))
    coarse, default, decimated = parts
    assert default.seconds == 1.0
    assert finest.maximum < default.own
    assert default.limit < coarse.limit
    assert default.limit_rms < coarse.limit_rms
    assert default.own < coarse.own
    assert abs(default.volume) < abs(coarse.volume)
    assert decimated.triangles < default.triangles
    assert decimated.size < default.size
    assert 0.0 < decimated.moved <= 0.05
    assert default.moved == 0.0
    text = export_precision.write(parts, finest, "precision", "A tube")
    assert text.count("\n| ") == 5
    assert (tmp_path / "precision.csv").exists()
    assert (tmp_path / "precision.png").exists()


def test_the_walls_by_formula_are_one_body_on_their_mesh() -> None:
    domain, chi = thin_walls()
    assert domain.mesh.nelements == 1080
    # Air inside and outside, and solid on the middle of the wall.
    r = np.hypot(domain.points[:, 1], domain.points[:, 2])
    assert chi[r > 0.95 * domain.radius].max() < 0.0
    assert chi[(r < 0.4 * domain.radius) & (np.abs(domain.points[:, 2] - 4.0) > 2.0)].max() < 0.0
    assert chi.max() > 0.0

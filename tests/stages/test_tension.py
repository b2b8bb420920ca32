"""What `poro fit` does with rows that are no loading curve: each kind is made of neo-Hooke's, whose E is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from stages import fit

SHEAR = 0.2
STRAIN = np.arange(0.0, 2.001, 0.05)
SETTINGS = fit.Settings(law="neo-hooke")
Rows = tuple[np.ndarray, np.ndarray]


def curve(strain: np.ndarray) -> np.ndarray:
    """Neo-Hooke's engineering stress, N/mm²."""
    return SHEAR * ((1.0 + strain) - (1.0 + strain) ** -2)


def changed(changes: dict[int, float], column: int = 1) -> Rows:
    rows = STRAIN.copy(), curve(STRAIN)
    for row, value in changes.items():
        rows[column][row] = value
    return rows


def cycles(amplitudes: list[float], first: float = 0.0) -> Rows:
    """Loading and unloading; softer where it has been before, as Mullins found."""
    strain, stress, farthest = [], [], first
    for amplitude in amplitudes:
        way = np.linspace(0.0, amplitude, 30)
        strain += [way, way[::-1]]
        stress += [np.where(way < farthest, 0.75, 1.0) * curve(way), 0.7 * curve(way[::-1])]
        farthest = max(farthest, amplitude)
    return np.concatenate(strain), np.concatenate(stress)


def broken() -> Rows:
    return STRAIN, np.where(STRAIN > 1.72, 0.002, curve(STRAIN))


def slack(length: float) -> Rows:
    strain = np.arange(0.0, 1.0, 0.02)
    return strain, curve(np.maximum(strain - length, 0.0) / (1.0 + length))


def later_cycle() -> Rows:
    strain = np.arange(0.0, 1.0, 0.02)
    return 0.1 + 1.1 * strain, curve(strain)


def shuffled() -> Rows:
    order = np.random.default_rng(1).permutation(len(STRAIN))
    return STRAIN[order], curve(STRAIN)[order]


def compressed() -> Rows:
    strain = np.arange(-0.3, 1.0, 0.05)
    return strain, curve(strain)


#: Rows, and what is said of them: part of the only warning, or nothing.
KINDS: dict[str, tuple[Callable[[], Rows], str]] = {
    "one spike": (lambda: changed({20: 99.0}), "row 21, a stress of 99 N/mm² at a stretch of 2, lies far off"),
    "spikes beside each other": (lambda: changed({10: 99.0, 11: 98.0, 30: -50.0}), "rows 11, 12, 31 lie far off"),
    "first row": (lambda: changed({0: 99.0}), "row 1, a stress of 99"),
    "last row": (lambda: changed({40: 99.0}), "row 41, a stress of 99"),
    "lost stresses": (lambda: changed({2: 0.0, 15: 0.0, 16: 0.0, 17: 0.0}), "rows 3, 16, 17, 18 lie far off"),
    "lost strain": (lambda: changed({20: 9999.0}, 0), "row 21, a stress of 0.35 N/mm² at a stretch of 1e+04"),
    "unloading": (lambda: cycles([2.0]), "The strain goes back at row 31"),
    "growing cycles": (lambda: cycles([0.2, 0.5, 1.0, 2.0]), "only the rows of first loading are used, 162 of 240"),
    "equal cycles": (lambda: cycles([1.0] * 4), "The strain goes back at row 31"),
    "small cycles first": (
        lambda: tuple(np.concatenate(both) for both in zip(cycles([0.1] * 3), (STRAIN, curve(STRAIN)), strict=True)),
        "The strain goes back at row 31",
    ),
    "two specimens": (lambda: (np.tile(STRAIN, 2), np.tile(curve(STRAIN), 2)), "another specimen"),
    "break": (broken, "The stress falls by 100 % beyond a stretch of 2.7 (row 35), as after a break"),
    "break at the end": (lambda: changed({40: 0.0}), "beyond a stretch of 2.95 (row 40)"),
    "slack": (lambda: slack(0.05), "The stress rises only from a stretch of 1.05 on"),
    "more slack": (lambda: slack(0.12), "The stress rises only from a stretch of 1.12 on"),
    "later cycle": (later_cycle, "The stress rises only from a stretch of 1.1 on"),
    "load cell": (lambda: (STRAIN, curve(STRAIN) + 0.05), "The stress at rest is 0.05 N/mm², not near zero"),
    "load cell below": (lambda: (STRAIN, curve(STRAIN) - 0.05), "The stress at rest is -0.05 N/mm²"),
    "backwards": (lambda: (STRAIN[::-1], curve(STRAIN)[::-1]), "written backwards"),
    "in no order": (shuffled, ""),
    "compression too": (compressed, ""),
    "clean": (lambda: (STRAIN, curve(STRAIN)), ""),
    "five rows": (lambda: (STRAIN[::10], curve(STRAIN[::10])), "No row but at rest is within the strain limit"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_modulus_is_found_and_said_what_was_done(kind: str) -> None:
    make, said = KINDS[kind]
    strain, stress = make()
    found = fit.run(1.0 + strain, stress, SETTINGS)
    assert found.best is not None
    assert found.best.youngs_modulus == pytest.approx(3.0 * SHEAR, rel=0.01)
    assert len(found.warnings) == bool(said)
    assert said in "".join(found.warnings)
    assert len(found.stretch) + len(found.excluded) == len(strain)


def test_lines_of_a_file_are_named() -> None:
    strain, stress = changed({20: 99.0})
    found = fit.run(1.0 + strain, stress, SETTINGS, list(range(4, 4 + len(strain))))
    assert "line 24, " in found.warnings[0]


@pytest.mark.parametrize("rows", [41, 2000])
def test_noise_is_no_fault_of_single_rows(rows: int) -> None:
    """One percent of the largest stress, and jitter of the strain: all rows stay, and E is as good as they are."""
    strain = np.linspace(0.0, 2.0, rows)
    noise = np.random.default_rng(2).normal(size=(2, rows))
    found = fit.run(1.0 + strain + 0.002 * noise[0], curve(strain) + 0.006 * noise[1], SETTINGS)
    assert len(found.excluded) == 0
    assert found.best is not None
    assert found.best.youngs_modulus == pytest.approx(3.0 * SHEAR, rel=0.05)
    assert found.start is not None
    assert abs(found.start.slope - 3.0 * SHEAR) < 3.0 * found.start.uncertainty


def test_little_slack_is_pointed_out_with_what_it_does_to_the_modulus() -> None:
    """Between two rows it cannot be seen, but the rows beyond do not lead to rest."""
    strain = np.maximum(STRAIN - 0.02, 0.0) / 1.02
    found = fit.run(1.0 + STRAIN, curve(strain), SETTINGS)
    (said,) = (sentence for sentence in found.warnings if "slack" in sentence)
    assert float(said.split("E would be near ")[1].split()[0]) == pytest.approx(3.0 * SHEAR, rel=0.05)


@pytest.mark.parametrize("exponent", [1.3, 3.0, 6.0, 8.0])
def test_a_stiffening_curve_is_no_slack_and_no_spike(exponent: float) -> None:
    stretch = np.linspace(1.0, 3.0, 41)
    stress = 2.0 * SHEAR / exponent * (stretch ** (exponent - 1.0) - stretch ** (-exponent / 2.0 - 1.0))
    found = fit.run(stretch, stress, SETTINGS)
    assert len(found.stretch) == len(stretch)
    assert not any("rise" in sentence for sentence in found.warnings)

"""Stage refine: finer mesh, filter, and what it skips and refuses."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from actuator.domains.half_cylinder import HalfCylinder
from actuator.failure import InvalidField
from stages import refine
from stages.events import Event, Message

DOMAIN = HalfCylinder(15.0, 15.0, 3, 2, 4)
SMOOTH = np.cos(0.2 * DOMAIN.points[:, 0]) + 0.1 * DOMAIN.points[:, 2]


def test_defaults_are_the_papers() -> None:
    assert refine.Settings() == refine.Settings(factor=2, filter_radius=0.1)


def test_field_belongs_to_the_finer_mesh_and_stays_close() -> None:
    result = refine.run(DOMAIN, SMOOTH, refine.Settings())
    assert result.domain == DOMAIN.refined(2)
    assert result.chi.shape == (result.domain.mesh.nvertices,)
    x = result.domain.points
    np.testing.assert_allclose(result.chi, np.cos(0.2 * x[:, 0]) + 0.1 * x[:, 2], atol=0.1)


def test_filter_smooths_noise() -> None:
    noise = np.random.default_rng(0).normal(size=DOMAIN.mesh.nvertices)
    spreads = [refine.run(DOMAIN, noise, refine.Settings(factor=1, filter_radius=r)).chi.std() for r in (0.1, 1.0, 5.0)]
    assert spreads[0] > 1.5 * spreads[1] > 3.0 * spreads[2] > 0.0


def test_nothing_to_do_returns_the_same_objects() -> None:
    result = refine.run(DOMAIN, SMOOTH, refine.Settings(factor=1, filter_radius=0.0))
    assert result.domain is DOMAIN
    assert result.chi is SMOOTH


def test_without_filter_the_old_vertices_keep_their_values() -> None:
    result = refine.run(DOMAIN, SMOOTH, refine.Settings(factor=2, filter_radius=0.0))
    for point in (0, 17, DOMAIN.mesh.nvertices - 1):
        same = np.argmin(np.linalg.norm(result.domain.points - DOMAIN.points[point], axis=1))
        assert result.chi[same] == pytest.approx(SMOOTH[point], abs=1e-14)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_refuses_values_that_are_not_finite(bad: float) -> None:
    chi = SMOOTH.copy()
    chi[[3, 5]] = bad
    with pytest.raises(InvalidField, match="not finite at 2 of"):
        refine.run(DOMAIN, chi, refine.Settings())


def test_refuses_a_field_of_another_mesh() -> None:
    with pytest.raises(InvalidField, match="shape"):
        refine.run(DOMAIN, SMOOTH[:-1], refine.Settings())


@pytest.mark.parametrize("settings", [{"factor": 0}, {"factor": 9}, {"filter_radius": -0.1}, {"radius": 1.0}])
def test_settings_are_checked(settings: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        refine.Settings.model_validate(settings)


def test_observer_hears_of_it() -> None:
    heard: list[Event] = []
    refine.run(DOMAIN, SMOOTH, refine.Settings(), heard.append)
    assert [type(event) for event in heard] == [Message]

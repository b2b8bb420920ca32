"""``import poro``: quick, complete, and the same results as the command line's."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import TINY
from documents import ROOT
from matplotlib import pyplot
from matplotlib.figure import Figure
from synthetic import EXAMPLE
from treloar import STRESS, STRETCH

import poro
from pipeline.results.simulation import Simulation
from pipeline.store import contents
from stages.compare import Recording

HEAVY = {"numpy", "pydantic", "numba", "scipy", "skfem", "h5py", "pyvista", "matplotlib", "trimesh", "yaml"}


def modules_after(code: str) -> set[str]:
    """Packages that a program loads, in a process of its own."""
    shown = f"{code}\nimport sys\nprint(sorted({{name.partition('.')[0] for name in sys.modules}}))"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    ended = subprocess.run([sys.executable, "-c", shown], env=environment, capture_output=True, text=True, check=True)
    return set(ast.literal_eval(ended.stdout))


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> poro.Case:
    path = tmp_path_factory.mktemp("case") / "tiny.yaml"
    path.write_text(TINY)
    return poro.read_case(path)


@pytest.fixture(scope="module")
def design(finished: Path) -> poro.OptimisedDesign:
    found = poro.load(finished / "tiny/tiny.h5")
    assert isinstance(found, poro.OptimisedDesign)
    return found


# ------------------------------------------------------------------------------------------------ the module


def test_import_loads_nothing_heavy() -> None:
    assert not modules_after("import poro\nprint(end='')") & (HEAVY | {"actuator", "stages", "pipeline"})


def test_a_case_is_read_without_numerics() -> None:
    found = modules_after("import poro; poro.read_case('case14.yaml')")
    assert "pydantic" in found
    assert not found & (HEAVY - {"numpy", "pydantic", "yaml"})


def test_every_name_is_there() -> None:
    assert set(poro.__all__) <= set(dir(poro))
    assert all(getattr(poro, name) is not None for name in poro.__all__)
    assert poro.__version__ == metadata.version("poro")
    with pytest.raises(AttributeError, match="has no attribute 'optimise'"):
        poro.optimise  # type: ignore[attr-defined] # noqa: B018
    assert (Path(poro.__file__).parent / "py.typed").is_file()


# ------------------------------------------------------------------------------------------------ cases


def test_shipped_cases_are_found_and_varied(case: poro.Case) -> None:
    shipped = poro.read_case("case14.yaml")
    varied = poro.with_changes(shipped, {"load.pressure_ratio": 0.01, "name": "softer", "simulate.states": (1.0,)})
    assert (varied.name, varied.load.pressure_ratio, varied.simulate.states) == ("softer", 0.01, (1.0,))
    assert shipped.load.pressure_ratio == 0.02
    assert poro.with_changes(case, {}) == case


def test_case_is_built_from_sections(case: poro.Case) -> None:
    sections: dict[str, Any] = {
        "domain": {"core_cells": 2, "rings": 1, "layers": 3},
        "objective": {"strain_energy_shift": "4/L_i"},
        "optimizer": case.optimizer,
    }
    assert poro.make_case(name="tiny", **sections) == case


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"domain": {"layers": 0}}, "domain.layers: must be at least 1, not 0; change the value."),
        ({"domain": {"layer": 3}}, "domain.layer: unknown key; write 'layers' if that was meant, else remove it."),
        ({"name": "a.solid"}, "name: must not end in .solid; choose another name."),
        (
            {"material": {"youngs_modulus": "soft"}, "rig": {"youngs_modulus": -1.0}},
            "material.youngs_modulus: must be a number, not the text 'soft'; write a number without units or quotes.\n"
            "rig.youngs_modulus: must be greater than 0, not -1.0; change the value.",
        ),
    ],
)
def test_mistakes_have_the_sentences_of_the_case_file(sections: dict[str, Any], words: str) -> None:
    with pytest.raises(poro.Fault) as raised:
        poro.make_case(**sections)
    assert str(raised.value) == words


def test_unknown_keys_and_files_have_a_sentence(case: poro.Case) -> None:
    with pytest.raises(poro.Fault, match=r"load\.pressure_rate: unknown key; write 'pressure_ratio' if that"):
        poro.with_changes(case, {"load.pressure_rate": 0.1})
    with pytest.raises(poro.Fault, match="there is no such file"):
        poro.read_case("nowhere.yaml")
    with pytest.raises(poro.Fault, match="there is no such file; run the stage that makes it"):
        poro.load("nowhere.h5")


# ------------------------------------------------------------------------------------------------ stages


def test_stages_find_what_the_program_stores(case: poro.Case, finished: Path, design: poro.OptimisedDesign) -> None:
    events: list[object] = []
    found = poro.optimize(case, threads=1, observer=events.append)
    assert sum(isinstance(event, poro.DesignUpdate) for event in events) == 2
    for name in ("chi", "displacement", "pressure", "arm"):
        np.testing.assert_array_equal(getattr(found, name), getattr(design, name))
    assert found.case == design.case.model_copy(update={"compute": case.compute})
    assert found.summary["terms"] == design.summary["terms"]
    fine = poro.refine(case, found)
    stored = poro.load(finished / "tiny/details/tiny.refined.h5")
    np.testing.assert_array_equal(fine.chi, stored.chi)  # type: ignore[union-attr]
    solid = poro.mirror(case, fine)
    surface = poro.load(finished / "tiny/details/tiny.solid.h5")
    np.testing.assert_array_equal(solid.vertices, surface.vertices)  # type: ignore[union-attr]
    part = poro.export(case, solid)
    assert part.passed
    assert part.data == (finished / "tiny/tiny.stl").read_bytes()


def test_optimisation_goes_on_from_a_design(case: poro.Case, design: poro.OptimisedDesign) -> None:
    longer = poro.with_changes(case, {"optimizer.max_updates": 2})
    messages: list[str] = []

    def listen(event: object) -> None:
        if isinstance(event, poro.Message):
            messages.append(event.text)

    found = poro.optimize(longer, threads=1, resume=design, observer=listen)
    assert "Continuing after design update 1." in messages
    np.testing.assert_array_equal(found.history["C"][:2], design.history["C"])
    assert found.summary["updates"] == 2


def test_simulation_is_computed_loaded_compared_and_drawn(
    case: poro.Case, design: poro.OptimisedDesign, pressurised: Path
) -> None:
    short = poro.with_changes(
        case,
        {"simulate.max_load": 1.2, "simulate.states": (0.5, 1.0), "rig.youngs_modulus": 1.0},
    )
    found = poro.simulate(short, design, threads=1)
    stored = poro.load(pressurised / "tiny/details/tiny.simulation.h5")
    assert isinstance(stored, Simulation)
    assert found.curves.keys() == stored.curves.keys()
    for name, values in found.curves.items():
        np.testing.assert_array_equal(values, stored.curves[name])
    pressure = np.concatenate([np.zeros(50), np.linspace(0.0, 22.0, 300), np.linspace(22.0, 0.0, 300), np.zeros(50)])
    recording = Recording(pressure, 0.5 * pressure)
    one, other = (poro.compare(short, recording, given, target=10.0) for given in (found, stored))  # type: ignore[arg-type]
    np.testing.assert_array_equal(one.predicted, other.predicted)
    assert one.target.mean == pytest.approx(5.0, rel=1e-3)
    assert isinstance(poro.figures.response(found), Figure)


def test_recorded_test_is_compared_with_a_single_point(case: poro.Case, design: poro.OptimisedDesign) -> None:
    with pytest.raises(poro.Fault, match=r"rig\.youngs_modulus: is missing; give the initial Young's modulus"):
        poro.compare(case, EXAMPLE, design)
    part = poro.with_changes(case, {"rig.youngs_modulus": 1.0, "export.scale": 1.5})
    found = poro.compare(part, EXAMPLE, design)
    assert found.target.predicted == pytest.approx(1.5 * design.summary["spring_elongation"])
    assert found.overall is None
    rig = poro.rig(part, design)
    assert rig.spring_travel == found.target.predicted
    assert rig.pressure == pytest.approx(found.target.pressure)


def test_parts_are_checked_and_sliced(finished: Path) -> None:
    path = finished / "tiny/tiny.stl"
    part = poro.load(path)
    assert poro.check(path, wall=0.3).summary == poro.check(part, wall=0.3).summary  # type: ignore[arg-type]
    layers = poro.slice(path, thickness=0.5)
    assert layers.layered_volume == pytest.approx(layers.volume, rel=0.02)
    with pytest.raises(poro.Fault, match=r"thickness: must be greater than or equal to 0\.001, not 0\.0"):
        poro.slice(path, thickness=0.0)


def test_laws_are_fitted_to_arrays_and_files(tmp_path: Path) -> None:
    found = poro.fit((STRETCH, STRESS), law="yeoh")
    path = tmp_path / "treloar.csv"
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(STRETCH.tolist(), STRESS.tolist(), strict=True))
    path.write_text(f"stretch,stress [MPa]\n{rows}\n")
    assert poro.fit(path, law="yeoh").best.shear == found.best.shear
    with pytest.raises(poro.Failure):
        poro.fit((STRETCH[:2], STRESS[:2]), law="ogden")


# ------------------------------------------------------------------------------------------------ figures


def test_figures_are_returned_and_nothing_is_written(
    design: poro.OptimisedDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    known = pyplot.get_fignums()
    for name in ("initial", "history", "section", "arm", "views"):
        assert isinstance(poro.figures.FIGURES[name].draw(design), Figure), name
    assert pyplot.get_fignums() == known  # none of them is one of pyplot's
    assert list(tmp_path.iterdir()) == []
    poro.figures.save(poro.figures.history(design), tmp_path / "history.pdf")
    poro.figures.save(poro.figures.section(design), tmp_path / "section.svg")
    assert {path.name for path in tmp_path.iterdir()} == {"history.pdf", "section.svg"}


def test_design_that_was_not_stored_is_drawn_alike(design: poro.OptimisedDesign, finished: Path) -> None:
    unstored = replace(design, source=None)
    points, _ = contents.surface(finished / "tiny/details/tiny.solid.h5")
    np.testing.assert_array_equal(unstored.shape.vertices, points)
    assert isinstance(poro.figures.arm(unstored), Figure)

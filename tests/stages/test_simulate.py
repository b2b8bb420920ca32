"""`poro simulate`: curves, states, table, figure, reruns, and what it says when it is interrupted or must stop."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import psutil
import pytest
import pyvista
from command_line import TINY, Poro, edited
from PIL import Image
from vtkmodules.vtkIOHDF import vtkHDFReader

import stages.simulate
from actuator.failure import InvalidSettings
from pipeline.exit_codes import ExitCode, Fault
from pipeline.figures.response import response
from pipeline.results.design import read_design
from pipeline.results.simulation import RigUnits, as_csv, read_simulation
from pipeline.runs import progress
from pipeline.store import artifact, vtkhdf
from pipeline.store.contents import Stored
from stages.events import Event, LoadStep
from stages.settings import LoadSettings, ProblemSettings
from stages.simulate import optimised

#: The columns that other commands read.
CONTRACT = {
    "pressure": "N/mm^2",
    "load_factor": "1",
    "T1": "mm",
    "T3": "mm",
    "theta2": "rad",
    "elongation": "mm",
    "energy_ratio": "1",
    "leak": "1",
    "loading": "1",
    "newton": "1",
}


@pytest.fixture
def simulated(pressurised: Path, tmp_path: Path) -> Path:
    """A copy of it, to be spoilt; it is the working folder of ``poro``."""
    shutil.copytree(pressurised, tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_what_paraview_opens_is_there_again_and_only_for_what_has_a_grid(simulated: Path, poro: Poro) -> None:
    simulation = simulated / "tiny/details/tiny.simulation.h5"
    shown = simulated / "tiny/details/tiny.simulation.vtkhdf"
    shown.unlink()
    ended = poro("simulate", "tiny.yaml", "--output", ".")
    assert "up to date" in ended.out + ended.err
    assert shown.exists()
    with edited(simulation) as file:  # as of a run that stored no states
        del file[vtkhdf.GROUP]
    shown.unlink()
    assert poro("simulate", "tiny.yaml", "--output", ".").code == 0
    assert not shown.exists()


def test_curves_states_table_and_figure(simulated: Path, poro: Poro) -> None:
    path = simulated / "tiny/details/tiny.simulation.h5"
    found = read_simulation(path)
    case = json.loads(artifact.read(path, "simulate", "case_resolved")[0])
    assert found.name == "tiny"
    assert found.summary["pressure_in"] == pytest.approx(2e-2 * case["material"]["youngs_modulus"])
    curve = found.curves
    with h5py.File(path) as file:
        assert {name: file[f"curves/{name}"].attrs["units"] for name in curve} == CONTRACT
    assert len({len(column) for column in curve.values()}) == 1
    np.testing.assert_allclose(curve["pressure"], found.summary["pressure_in"] * curve["load_factor"], rtol=1e-12)
    up = curve["loading"] == 1.0
    assert (curve["load_factor"][0], curve["load_factor"][up][-1], curve["load_factor"][-1]) == (0.0, 1.2, 0.0)
    assert (np.diff(curve["load_factor"][up]) > 0.0).all()
    assert (np.diff(curve["load_factor"][~up]) < 0.0).all()
    assert np.abs(curve["T3"][-1]) < 1e-6 * np.abs(curve["T3"]).max()

    # The optimised state is the one that is reached; its summary says the same of it.
    optimised = json.loads(artifact.read(simulated / "tiny/tiny.h5", "optimize", "report/summary")[0])
    summary = found.summary
    assert summary["reached"] is True
    assert max(summary["difference"].values()) < 1e-6
    at = summary["at_target"]
    for name, stored in (("T3", "T3"), ("theta2", "theta2"), ("elongation", "spring_elongation")):
        assert at[name] == pytest.approx(optimised[stored], rel=1e-6)
    assert at["energy_ratio"] == pytest.approx(optimised["energy_ratio"], rel=1e-6)
    assert at["leak"] == pytest.approx(optimised["wall_leak"], rel=1e-6)

    table = list(csv.reader((simulated / "tiny/details/tiny.simulation.csv").read_text().splitlines()))
    assert table[0][:2] == ["load_factor [1]", "pressure [N/mm^2]"]
    assert [float(row[0]) for row in table[1:]] == pytest.approx(curve["load_factor"].tolist())
    with Image.open(simulated / "tiny/details/tiny.simulation.png") as image:
        assert (np.asarray(image.convert("L")) < 200).mean() > 0.005

    states = steps(simulated / "tiny/details/tiny.simulation.vtkhdf")
    assert list(states) == [0.5, 1.0]
    stored = artifact.read(simulated / "tiny/tiny.h5", "optimize", "nodes/displacement")[0]
    np.testing.assert_allclose(states[1.0]["displacement"], stored, atol=1e-6 * np.abs(stored).max())
    assert 0.3 < np.linalg.norm(states[0.5]["displacement"]) / np.linalg.norm(stored) < 0.7
    np.testing.assert_array_equal(states[0.5]["chi"], states[1.0]["chi"])
    assert poro("convert", path, simulated / "x.vtu").code == ExitCode.OK
    np.testing.assert_allclose(pyvista.read(simulated / "x.vtu")["displacement"], stored, atol=1e-6)


def steps(path: Path) -> dict[float, pyvista.DataSet]:
    """All time steps of a file as VTK's own reader finds them."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    found = {}
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        found[reader.GetTimeValue()] = pyvista.wrap(reader.GetOutput()).copy()
    return found


def test_reruns_and_what_is_said(simulated: Path, poro: Poro) -> None:
    again = poro("simulate", "tiny.yaml", "--output", ".")
    assert again.code == ExitCode.OK
    assert "simulate: up to date" in again.err
    assert "the optimised state is reached" in again.out
    assert "no limit point up to a load factor of 1.2" in again.out
    found = json.loads(poro("simulate", "tiny.yaml", "--output", ".", "--json").out)
    assert found["simulate"]["reached"] is True
    rows = [line.split() for line in poro("status", "tiny.yaml", "--output", ".").out.splitlines()]
    assert ["simulate", "up", "to", "date", "tiny/details/tiny.simulation.h5"] in rows
    case = simulated / "tiny.yaml"
    case.write_text(case.read_text().replace("max_load: 1.2", "max_load: 1.1"))
    assert "settings changed: simulate.max_load 1.2 → 1.1" in poro("status", "tiny.yaml", "--output", ".").out
    ended = poro("simulate", "tiny.simulation.h5")
    assert ended.code == ExitCode.ARTIFACT
    assert "this is the result of 'simulate'; give the case file it belongs to." in ended.err


def test_rig_units_in_table_and_figure(simulated: Path, poro: Poro) -> None:
    ended = poro("simulate", "tiny.yaml", "--output", ".", "--youngs", 1.0, "--scale", 1.5)
    assert ended.code == ExitCode.OK, ended.err
    rows = list(csv.DictReader((simulated / "tiny/details/tiny.simulation.csv").read_text().splitlines()))
    row = next(row for row in rows if row["load_factor [1]"] == "1")
    assert float(row["rig_pressure [kPa]"]) == pytest.approx(20.0)
    assert float(row["rig_elongation [mm]"]) == pytest.approx(1.5 * float(row["elongation [mm]"]), rel=1e-8)
    assert float(row["rig_T3 [mm]"]) == pytest.approx(1.5 * float(row["T3 [mm]"]), rel=1e-8)
    found = read_simulation(simulated / "tiny/details/tiny.simulation.h5")
    rig = RigUnits(ProblemSettings(), 1.5, 1.0)
    axes = response(found, rig).axes[0]
    pressures = np.concatenate([line.get_xdata() for line in axes.lines])
    assert pressures.max() == pytest.approx(1.2 * 20.0)
    assert "kPa" in axes.get_xlabel()
    assert "N/mm²" in response(found).axes[0].get_xlabel()
    assert as_csv(found).splitlines()[0].count("rig") == 0


def test_limit_points_are_marked_and_said(simulated: Path) -> None:
    found = read_simulation(simulated / "tiny/details/tiny.simulation.h5")
    before = len(response(found).axes[0].lines)
    found.summary["limit_points"] = [{"load_factor": 0.5, "loading": True}]
    assert len(response(found).axes[0].lines) == before + 1


def test_interrupted_curves_are_kept_and_computed_again(
    folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    class Interrupting(progress.Reporter):
        def observe(self, event: Event) -> None:
            super().observe(event)
            if isinstance(event, LoadStep):
                seen.append(event)
                if len(seen) == 3:
                    raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(progress, "Reporter", Interrupting)
        ended = poro("simulate", "tiny.h5", "--threads", 1)
    assert ended.code == ExitCode.INTERRUPTED
    assert "run the same command to compute it to the end" in ended.err
    found = read_simulation(folder / "tiny/details/tiny.simulation.h5")
    assert found.summary["finished"] is False
    assert len(found.curves["T3"]) == 3
    assert len((folder / "tiny/details/tiny.simulation.csv").read_text().splitlines()) == 4
    assert "interrupted before its end" in poro("status", "tiny.h5").out


def test_a_path_that_is_lost_is_stored_and_said(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + "simulate: {max_points: 2}\n")
    ended = poro("simulate", "tiny.yaml", "--output", ".", "--threads", 1)
    assert ended.code == ExitCode.NOT_CONVERGED
    assert "The path has more than 2 points" in ended.err
    assert "not reached; largest load factor" in ended.out
    found = read_simulation(folder / "tiny/details/tiny.simulation.h5").summary
    assert (found["reached"], found["at_target"], found["complete"]) == (False, None, False)
    assert poro("simulate", "tiny.yaml", "--output", ".").code == ExitCode.NOT_CONVERGED  # also when up to date


def test_what_cannot_be_simulated_is_refused(folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    design = optimised(Stored(folder / "tiny/tiny.h5", "optimize"))
    calm = ProblemSettings(load=LoadSettings(pressure_ratio=0.0))
    with pytest.raises(InvalidSettings, match=r"set load\.pressure_ratio above zero"):
        stages.simulate.run(design, calm, stages.simulate.Settings())
    ended = poro("simulate", "tiny.h5", "--max-load", 0)
    assert ended.code == ExitCode.USAGE
    assert "--max-load: must be greater than 0" in ended.err
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(total=2**20))
    ended = poro("simulate", "tiny.yaml", "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert "'simulate' on 48 cells needs at least" in ended.err


@pytest.mark.parametrize("key", ["fields: [density]", "sharpness: 2.0", "mesh: refined"])
def test_keys_that_went_are_refused_with_what_does_their_work(key: str, poro: Poro) -> None:
    Path("old.yaml").write_text(f"simulate:\n  {key}\n")
    ended = poro("simulate", "old.yaml")
    assert ended.code == ExitCode.USAGE
    name = key.partition(":")[0]
    sentence = "unknown key; remove it; `poro inflate` computes the part as it is printed."
    assert ended.err == f"poro: old.yaml:2: simulate.{name}: {sentence}\n"


def test_designs_of_the_time_of_those_keys_are_read_and_their_simulations_are_not(simulated: Path, poro: Poro) -> None:
    """A design of hours must not be lost over keys that it never depended on."""
    for name in ("tiny/tiny.h5", "tiny/details/tiny.simulation.h5"):
        with edited(simulated / name) as file:
            resolved = json.loads(file["case_resolved"][()])
            resolved["simulate"] |= {"fields": ["density", "thresholded"], "sharpness": 2.0, "mesh": "optimised"}
            file["case_resolved"][()] = json.dumps(resolved)
    assert poro("optimize", "tiny.yaml", "--output", ".").err.splitlines()[-1] == "optimize: up to date (tiny/tiny.h5)"
    assert poro("status", "tiny.h5").code == ExitCode.OK
    with edited(simulated / "tiny/details/tiny.simulation.h5") as file:
        file.attrs["stage_version"] = 2
    with pytest.raises(Fault, match="made by another version of 'simulate'; run `poro simulate` again"):
        read_simulation(simulated / "tiny/details/tiny.simulation.h5")
    assert read_design(simulated / "tiny/tiny.h5").simulation is None  # report and figures leave it out

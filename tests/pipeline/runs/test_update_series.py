"""The design updates as time steps: kept while an optimisation runs, found by VTK's own reader at its end."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import pyvista
from command_line import TINY, Poro
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from pipeline.case.model import case_type
from pipeline.exit_codes import ExitCode
from pipeline.runs import checkpoint, updates
from pipeline.runs.keys import content_key, path_key, plain, stage_settings
from pipeline.store import artifact, contents

FIELDS = {"chi": 1, "density": 1, "pressure": 1, "displacement": 3}


def steps(path: Path) -> dict[float, dict[str, np.ndarray[Any, Any]]]:
    """What VTK's reader finds: time -> points and fields."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    times = [information.Get(Pipeline.TIME_STEPS(), i) for i in range(information.Length(Pipeline.TIME_STEPS()))]
    assert len(times) == reader.GetNumberOfSteps()
    found = {}
    for time in times:
        reader.UpdateTimeStep(time)
        grid = reader.GetOutput()
        assert isinstance(grid, vtkUnstructuredGrid)
        data = grid.GetPointData()
        names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
        found[time] = {name: vtk_to_numpy(data.GetArray(name)).copy() for name in names}
        found[time]["points"] = vtk_to_numpy(grid.GetPoints().GetData()).copy()
    return found


def _optimize(poro: Poro, updates: int, output: str = ".", more: str = "", code: ExitCode = ExitCode.OK) -> None:
    Path("tiny.yaml").write_text(TINY + more)
    ended = poro("optimize", "tiny.yaml", "--output", output, "--updates", updates, "--threads", 1)
    assert ended.code == code, ended.err


def test_every_update_is_a_time_step_of_the_shown_mesh(folder: Path) -> None:
    found = steps(folder / "tiny/tiny.vtkhdf")
    assert list(found) == [0.0, 1.0]
    domain, chi = contents.design(folder / "tiny/tiny.h5", "optimize")
    pressure, moved = artifact.read(folder / "tiny/tiny.h5", "optimize", "vertices/pressure", "nodes/displacement")
    for fields in found.values():
        assert {name: values.size // len(domain.points) for name, values in fields.items()} == FIELDS | {"points": 3}
        np.testing.assert_array_equal(fields["points"], domain.points)
        np.testing.assert_allclose(fields["density"], 1.0 / (1.0 + np.exp(-fields["chi"])), rtol=1e-5)
    last = found[1.0]
    np.testing.assert_array_equal(last["chi"], chi.astype(np.float32))
    np.testing.assert_array_equal(last["pressure"], pressure.astype(np.float32))
    np.testing.assert_array_equal(last["displacement"], moved[: len(chi)].astype(np.float32))
    assert not np.array_equal(found[0.0]["chi"], last["chi"])
    assert not (folder / "tiny/details/tiny.updates").exists()


def test_documented_lines_read_the_last_step(folder: Path) -> None:
    document = (Path(__file__).parents[3] / "docs" / "reference" / "artifacts.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^```python\n(.*?)^```", document, flags=re.MULTILINE | re.DOTALL)
    names: dict[str, Any] = {}
    exec(lines.replace("outputs/quick/quick.vtkhdf", str(folder / "tiny/tiny.vtkhdf")), names)
    np.testing.assert_array_equal(names["last"]["chi"], steps(folder / "tiny/tiny.vtkhdf")[1.0]["chi"])


def test_steps_have_right_handed_cells_units_and_the_final_state_on_all_nodes(folder: Path) -> None:
    grid = pyvista.read(folder / "tiny/tiny.vtkhdf")
    assert set(grid.celltypes) == {pyvista.CellType.HEXAHEDRON}
    assert grid.compute_cell_sizes()["Volume"].min() > 0.0
    with h5py.File(folder / "tiny/tiny.h5") as file:
        units = {name: file[f"updates/{name}"].attrs["units"] for name in FIELDS}
    assert units == {"chi": "1", "density": "1", "pressure": "N/mm^2", "displacement": "mm"}
    full = artifact.read_grid(folder / "tiny/tiny.h5")
    assert full.cells.shape[1] == 20
    assert len(full.points) > grid.n_points


def test_interrupted_and_continued_run_has_the_updates_of_one_that_was_not(
    poro: Poro, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _optimize(poro, 3, "whole")
    observe = checkpoint.Keeper.observe

    def interrupted(keeper: checkpoint.Keeper, event: Any) -> None:
        if getattr(event, "record", {}).get("update") == 2:  # its fields are stored, its checkpoint is not
            raise KeyboardInterrupt
        observe(keeper, event)

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint.Keeper, "observe", interrupted)
        _optimize(poro, 2, "parts", code=ExitCode.INTERRUPTED)
    left = Path("parts/tiny/details/tiny.updates")
    assert [path.name for path in sorted(left.iterdir())] == ["000000.h5", "000001.h5", "000002.h5"]
    (left / "000001.h5").touch()
    (left / "000009.h5").write_bytes((left / "000002.h5").read_bytes())
    _optimize(poro, 2, "parts")
    assert list(steps(Path("parts/tiny/tiny.vtkhdf"))) == [0.0, 1.0, 2.0]
    _optimize(poro, 3, "parts")  # a finished run goes on
    whole, parts = steps(Path("whole/tiny/tiny.vtkhdf")), steps(Path("parts/tiny/tiny.vtkhdf"))
    assert list(parts) == list(whole) == [0.0, 1.0, 2.0, 3.0]
    for time, fields in whole.items():
        for name, values in fields.items():
            np.testing.assert_array_equal(parts[time][name], values, err_msg=f"{name} at {time}")


def test_every_second_update_and_the_last_are_kept(poro: Poro, finished: Path) -> None:
    _optimize(poro, 3, more="  keep_updates: 2\n")
    assert list(steps(Path("tiny/tiny.vtkhdf"))) == [0.0, 2.0, 3.0]


def test_without_kept_updates_the_final_state_is_shown(poro: Poro, finished: Path) -> None:
    _optimize(poro, 1, more="  keep_updates: 0\n")
    assert set(pyvista.read("tiny/tiny.vtkhdf").celltypes) == {pyvista.CellType.QUADRATIC_HEXAHEDRON}
    assert updates.read(Path("tiny/tiny.h5")) == {}
    assert not Path("tiny/details/tiny.updates").exists()
    # An artifact without them shows the last state; it goes on all the same.
    _optimize(poro, 2)
    assert list(steps(Path("tiny/tiny.vtkhdf"))) == [1.0, 2.0]


def test_updates_of_another_path_are_not_mixed_in(poro: Poro, folder: Path) -> None:
    text = TINY.replace("max_updates: 1", "max_updates: 1\nload: {pressure_ratio: 0.01}")
    stale = folder / "tiny/details/tiny.updates" / "000000.h5"
    stale.parent.mkdir()
    stale.write_text("no artifact")
    (folder / "tiny.yaml").write_text(text)
    assert poro("optimize", "tiny.yaml", "--output", ".", "--threads", 1).code == ExitCode.OK
    kept = updates.read(folder / "tiny/tiny.h5")
    assert [float(fields["pressure"].max()) for fields in kept.values()] == pytest.approx(2 * [0.01 * 2.736], rel=0.1)


def test_what_is_kept_is_no_reason_to_run_again(poro: Poro, folder: Path) -> None:
    (folder / "tiny.yaml").write_text(TINY + "  keep_updates: 7\n")
    lines = poro("status", "tiny.yaml", "--output", ".").out.splitlines()
    assert all("up to date" in line for line in lines if not line.startswith("inflate"))


def test_keys_are_those_of_a_case_without_the_option() -> None:
    case = plain(case_type()())
    settings = stage_settings(case, "optimize")
    assert "keep_updates" not in settings["optimizer"]
    older = {**case, "optimizer": settings["optimizer"]}
    assert content_key("optimize", 4, stage_settings(older, "optimize")) == content_key("optimize", 4, settings)
    assert path_key(older, "optimize", 4) == path_key(case, "optimize", 4)

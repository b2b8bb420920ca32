"""`poro compare` as it is called: reports, figures and tables from a file, and a sentence where that cannot be."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import Poro
from PIL import Image
from synthetic import EXAMPLE, EXAMPLE_TRUTH, Truth, recording

from pipeline.exit_codes import ExitCode
from pipeline.measured.comparison import compared
from pipeline.measured.measurement import read_measurement
from pipeline.runs.job import open_job
from pipeline.store import artifact, contents
from pipeline.store.artifact import Dataset
from stages import rig
from stages.chain import SCALE, youngs
from stages.rig import scaled
from stages.settings import ProblemSettings
from stages.simulate import VERSION
from stages.words import PredictionName

#: What the tiny case is scaled to.
PART = ("--scale", "1.5", "--youngs", "1.0")
#: At target: N/mm² and mm of the computed case that become 20 kPa and 23 mm.
PRESSURE_IN, ELONGATION = 0.02 * 2.736, 23.0 / 1.5
SUMMARY = contents.summarised({"pressure_in": PRESSURE_IN})


@pytest.fixture
def simulated(folder: Path) -> Path:
    """The finished tiny case with a simulation beside it: x^1.5 up to p_in and a quarter beyond, and back."""
    load = np.concatenate([np.linspace(0.0, 1.25, 26), np.linspace(1.2, 0.0, 25)])
    columns = {
        "pressure": PRESSURE_IN * load,
        "load_factor": load,
        "elongation": ELONGATION * load**1.5,
        "loading": (np.arange(len(load)) < 26).astype(float),
    }
    datasets = {f"curves/{name}": Dataset(values, "", "") for name, values in columns.items()}
    design = artifact.read_header(folder / "tiny/tiny.h5")
    header = replace(
        design,
        stage="simulate",
        stage_version=VERSION,
        identity="this simulation",
        upstream_identity=design.identity,
    )
    artifact.write(folder / "tiny/details/tiny.simulation.h5", header, datasets | SUMMARY)
    return folder


@pytest.fixture
def inflated(folder: Path) -> Path:
    """The finished tiny case with the curve of its part beside it: straight, 5 % short of the simulation, downwards."""
    load = np.linspace(0.0, 1.5, 7)
    columns = {"pressure": PRESSURE_IN * load, "load_factor": load, "elongation": -0.95 * ELONGATION * load}
    found = contents.summary(folder / "tiny/tiny.h5", "optimize")["spring_elongation"]
    summary = contents.summarised({"optimised": {"elongation": {"optimised": found}}})
    datasets = {f"curves/{name}": Dataset(values, "", "") for name, values in columns.items()}
    header = artifact.read_header(folder / "tiny/details/tiny.stl.h5")
    header = replace(header, stage="inflate", identity="this inflation")
    artifact.write(folder / "tiny/details/tiny.inflation.h5", header, datasets | summary)
    return folder


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    """A synthetic test without noise: 22 mm at 20 kPa."""
    return written(Truth(loop=1.0), tmp_path / "measured.csv")


def written(truth: Truth, path: Path) -> Path:
    made = recording(truth)
    assert made.time is not None
    rows = zip(made.time.tolist(), made.pressure.tolist(), made.displacement.tolist(), strict=True)
    lines = ["# SYNTHETIC", "time [s],pressure [kPa],displacement [mm]", *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines))
    return path


def test_scaled_is_the_rig_s_scaling() -> None:
    kilopascals, millimetres = scaled(np.array([PRESSURE_IN]), np.array([ELONGATION]), ProblemSettings(), 1.5, 1.0)
    np.testing.assert_allclose(kilopascals, [20.0])
    np.testing.assert_allclose(millimetres, [23.0])


def test_report_figure_and_table(simulated: Path, measured: Path, poro: Poro) -> None:
    ended = poro("compare", "tiny.h5", measured, *PART)
    assert ended.code == 0, ended.err
    assert "3 cycles compared" in ended.out
    assert "measured 22.00" in ended.out
    assert "predicted 23.00 mm: -1.00 mm (-4.3 %)" in ended.out
    assert "SYNTHETIC" in ended.out
    report = json.loads((simulated / "tiny/details/tiny.compare.json").read_text(encoding="utf-8"))
    assert report["comments"] == ["SYNTHETIC"]
    assert report["prediction"]["curve"]
    assert report["target"]["pressure_kPa"] == pytest.approx(20.0)
    assert report["target"]["deviation_mm"] == pytest.approx(-1.0, abs=0.01)
    assert report["hysteresis"]["area"] == pytest.approx(Truth(loop=1.0).area, rel=0.01)
    assert report["stiffness"]["factor"] > 0.0
    assert report["notes"] == []
    with (simulated / "tiny/details/tiny.compare.csv").open(newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    assert len(rows) == 101
    for row in rows:
        assert row["loading_mm"] == pytest.approx(1.1 * row["pressure_kPa"], abs=0.02)
        assert row["deviation_mm"] == pytest.approx(row["loading_mm"] - row["predicted_mm"], abs=1e-4)
    with Image.open(simulated / "tiny/details/tiny.compare.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert tuple(pixels[0, 0]) == (255, 255, 255)
    blue, orange, black = (
        np.abs(pixels - colour).max(axis=2) < 30 for colour in ((31, 78, 121), (197, 90, 17), (0, 0, 0))
    )
    assert min(blue.sum(), orange.sum(), black.sum()) > 300


def test_json_is_the_report_and_svg_is_vectors(simulated: Path, measured: Path, poro: Poro) -> None:
    ended = poro("compare", "tiny.yaml", measured, *PART, "--output", simulated, "--json", "--format", "svg")
    assert ended.code == 0, ended.err
    report = json.loads(ended.out)
    assert report == json.loads((simulated / "tiny/details/tiny.compare.json").read_text(encoding="utf-8"))
    assert all(Path(file).is_file() for file in report["files"])
    drawn = (simulated / "tiny/details/tiny.compare.svg").read_text()
    assert drawn.count("<path") > 10
    assert len(drawn) < 2_000_000


def test_target_and_other_options(simulated: Path, measured: Path, poro: Poro) -> None:
    ended = poro("compare", "tiny.h5", measured, *PART, "--target", 10, "--json")
    assert ended.code == 0, ended.err
    target = json.loads(ended.out)["target"]
    assert target["measured_mm"] == pytest.approx(11.0, abs=0.01)
    assert target["predicted_mm"] == pytest.approx(23.0 * 0.5**1.5, abs=0.01)
    stiffer = json.loads(poro("compare", "tiny.h5", measured, "--scale", 3, "--youngs", "0.5", "--json").out)
    assert stiffer["target"]["pressure_kPa"] == pytest.approx(10.0)
    assert stiffer["target"]["predicted_mm"] == pytest.approx(46.0, abs=0.01)
    options = ("--zero", "none", "--sensor", "falls", "--smoothing", "0.05", "--lag", "0.1")
    ended = poro("compare", "tiny.h5", measured, *PART, *options, "--json")
    found = json.loads(ended.out)
    assert found["target"]["measured_mm"] < -20.0
    assert found["alignment"]["rows"] == 0
    assert found["settings"] == {
        **{"target": None, "zero": "none", "sensor": "falls", "smoothing": 0.05, "lag": 0.1},
        "pressure_sensor": "auto",
    }


def test_without_a_simulation_the_single_point_is_compared(folder: Path, measured: Path, poro: Poro) -> None:
    ended = poro("compare", "tiny.h5", measured, *PART)
    assert ended.code == 0, ended.err
    assert "the prediction is the single point of tiny.h5 and the origin, not a curve" in ended.out
    assert "`poro inflate tiny/tiny.h5` and `poro simulate tiny/tiny.h5` give one" in ended.out
    report = json.loads((folder / "tiny/details/tiny.compare.json").read_text(encoding="utf-8"))
    elongation = contents.summary(folder / "tiny/tiny.h5", "optimize")["spring_elongation"]
    assert report["target"]["predicted_mm"] == pytest.approx(1.5 * elongation)
    assert (report["overall"], report["stiffness"], report["linearity"]["predicted"]) == (None, None, None)
    with (folder / "tiny/details/tiny.compare.csv").open(newline="") as file:
        assert {row["predicted_mm"] for row in csv.DictReader(file)} == {""}


def test_simulation_of_an_older_design_is_told(simulated: Path, measured: Path, poro: Poro) -> None:
    path = simulated / "tiny/details/tiny.simulation.h5"
    curves = artifact.read_group(path, "simulate", "curves")
    datasets = {f"curves/{name}": Dataset(values, "", "") for name, values in curves.items()}
    artifact.write(path, replace(artifact.read_header(path), upstream_identity="another"), datasets | SUMMARY)
    ended = poro("compare", "tiny.h5", measured, *PART)
    assert ended.code == 0
    assert "tiny.simulation.h5 was not made from this tiny.h5; run `poro simulate` again" in ended.out


def test_part_as_printed_goes_before_the_density_field(
    simulated: Path, inflated: Path, measured: Path, poro: Poro
) -> None:
    ended = poro("compare", "tiny.h5", measured, *PART)
    assert ended.code == 0, ended.err
    assert "prediction          as printed, tiny/details/tiny.inflation.h5, to 30 kPa\n" in ended.out
    assert "drawn beside: density field, 23.00 mm at 20 kPa\n" in ended.out
    assert "predicted 21.85 mm: +0.15 mm" in ended.out
    assert "note" not in ended.out
    report = json.loads((inflated / "tiny/details/tiny.compare.json").read_text(encoding="utf-8"))
    assert report["prediction"]["source"] == "as-printed"
    (beside,) = report["beside"]
    path = "tiny/details/tiny.simulation.h5"
    assert beside == {"source": "density", "path": path, "predicted_mm": pytest.approx(23.0)}
    assert report["linearity"]["predicted"]["r_squared"] == pytest.approx(1.0)
    found = json.loads(poro("compare", "tiny.h5", measured, *PART, "--prediction", "density", "--json").out)
    assert (found["prediction"]["source"], found["beside"][0]["source"]) == ("density", "as-printed")
    assert found["target"]["predicted_mm"] == pytest.approx(23.0)
    with (inflated / "tiny/details/tiny.compare.csv").open(newline="") as file:
        last = list(csv.DictReader(file))[-1]
    assert float(last["predicted_mm"]) == pytest.approx(23.0 * 1.25**1.5, rel=0.01)


def test_both_predictions_are_drawn_under_their_names(simulated: Path, inflated: Path, measured: Path) -> None:
    job = open_job(inflated / "tiny/tiny.h5", changes={SCALE: 1.5, youngs(): 1.0})
    wanted: tuple[PredictionName, ...] = ("as-printed", "density")
    for prediction in wanted:
        axes = compared(job, read_measurement(measured), prediction, {}).drawn().axes[0]
        curves = {str(line.get_label()): np.asarray(line.get_ydata()) for line in axes.lines}
        assert curves["predicted, as printed"][-1] == pytest.approx(0.95 * 23.0 * 1.5)
        assert curves["predicted, density field"][-1] == pytest.approx(23.0 * 1.25**1.5)


def test_part_of_another_design_is_told(inflated: Path, measured: Path, poro: Poro) -> None:
    path = inflated / "tiny/details/tiny.inflation.h5"
    curves = artifact.read_group(path, "inflate", "curves")
    datasets = {f"curves/{name}": Dataset(values, "", "") for name, values in curves.items()}
    summary = contents.summarised({"optimised": {"elongation": {"optimised": 1.0}}})
    artifact.write(path, artifact.read_header(path), datasets | summary)
    ended = poro("compare", "tiny.yaml", measured, *PART, "--output", ".")
    assert ended.code == 0, ended.err
    assert "tiny.inflation.h5 was made from another design than tiny.h5; run `poro inflate` again" in ended.out
    assert "drawn beside" not in ended.out


def test_example_of_the_documents(simulated: Path, poro: Poro) -> None:
    ended = poro("compare", "tiny.h5", EXAMPLE, *PART, "--json")
    assert ended.code == 0, ended.err
    found = json.loads(ended.out)
    assert found["cycles"] == 3
    assert found["alignment"]["turned"]
    assert found["target"]["measured_mm"] == pytest.approx(EXAMPLE_TRUTH.loading(np.array([20.0]))[0], abs=0.05)
    assert found["hysteresis"]["area"] == pytest.approx(EXAMPLE_TRUTH.area, abs=0.2)
    assert found["linearity"]["measured"]["largest"] == pytest.approx(EXAMPLE_TRUTH.off_line, abs=0.3)


def test_what_is_wrong_is_said_and_nothing_is_written(simulated: Path, measured: Path, poro: Poro) -> None:
    before = sorted(simulated.iterdir())
    wrong: list[tuple[ExitCode, str, tuple[object, ...]]] = [
        (ExitCode.USAGE, "--youngs, or as youngs_modulus below 'rig:'", ("tiny.h5", measured)),
        (ExitCode.ARTIFACT, "no.csv: there is no such file", ("tiny.h5", "no.csv", *PART)),
        (ExitCode.ARTIFACT, "nothing.h5: there is no such file", ("nothing.h5", measured, *PART)),
        (ExitCode.USAGE, "--target: must be greater than 0, not -1.0", ("tiny.h5", measured, *PART, "--target", -1)),
        (ExitCode.USAGE, "--smoothing: must be less than", ("tiny.h5", measured, *PART, "--smoothing", 1)),
        (ExitCode.USAGE, "--scale: must be greater than 0", ("tiny.h5", measured, "--scale", 0, "--youngs", 1)),
        (ExitCode.USAGE, "--pressure-sensitivity goes with", ("tiny.h5", measured, *PART, "--pressure-sensitivity", 2)),
        (ExitCode.ARTIFACT, "is never reached, the highest is 25 kPa", ("tiny.h5", measured, *PART, "--target", 26)),
    ]
    for code, sentence, arguments in wrong:
        ended = poro("compare", *arguments)
        assert ended.code == code, ended.err
        assert sentence in ended.err
        assert ended.out == ""
        assert ended.err.count("\n") == 1
    assert sorted(simulated.iterdir()) == before
    (simulated / "tiny/details/tiny.simulation.h5").unlink()
    for prediction, stage, file in (("as-printed", "inflate", "inflation"), ("density", "simulate", "simulation")):
        ended = poro("compare", "tiny.h5", measured, *PART, "--prediction", prediction)
        assert ended.code == ExitCode.USAGE
        assert f"--prediction {prediction}: there is no tiny" in ended.err
        assert f"{file}.h5; make it with `poro {stage} tiny/tiny.h5`." in ended.err
    (simulated / "tiny/details/tiny.simulation.h5").write_text("no artifact")
    ended = poro("compare", "tiny.h5", measured, *PART)
    assert ended.code == ExitCode.ARTIFACT
    assert "tiny.simulation.h5: this is no HDF5 file" in ended.err


def rows_of(path: Path) -> list[list[str]]:
    return [line.split(",") for line in path.read_text().splitlines()[2:]]


def rewritten(path: Path, header: str, rows: list[list[str]]) -> Path:
    path.write_text("\n".join([header, *(",".join(row) for row in rows), ""]))
    return path


def test_lost_sample_is_named_in_report_and_json(simulated: Path, measured: Path, poro: Poro) -> None:
    clean = json.loads(poro("compare", "tiny.h5", measured, *PART, "--json").out)
    rows = rows_of(measured)
    rows[305][2], rows[700][2] = "9999", "NaN"
    spoilt = rewritten(Path("spoilt.csv"), "time_s,pressure_kPa,displacement_mm", rows)
    ended = poro("compare", "tiny.h5", spoilt, *PART)
    assert ended.code == 0, ended.err
    assert "left out            1 row far off in 'displacement_mm', first in line 307: '9999'" in ended.out
    assert "1 row without a number in 'displacement_mm', first in line 702: 'NaN'" in ended.out
    found = json.loads((simulated / "tiny/details/tiny.compare.json").read_text())
    assert [(each["count"], each["line"], each["text"]) for each in found["left_out"]] == [
        (1, 702, "NaN"),
        (1, 307, "9999"),
    ]
    for key in ("area", "width"):
        assert found["hysteresis"][key] == pytest.approx(clean["hysteresis"][key], abs=0.02)


def test_assumed_sensitivity_is_said_and_a_reversed_sensor_turned(simulated: Path, measured: Path, poro: Poro) -> None:
    rows = [[time, str(-float(pressure) / 11.11), travel] for time, pressure, travel in rows_of(measured)]
    volts = rewritten(Path("volts.csv"), "time [s],pressure [V],displacement [mm]", rows)
    ended = poro("compare", "tiny.h5", volts, *PART)
    assert ended.code == 0, ended.err
    assert "19.17 kPa/V, of the paper's Honeywell 142PC15D, is assumed; give" in ended.out
    assert "the pressure falls from where most rows are, at rest; its sign was turned" in ended.out
    stored = json.loads((simulated / "tiny/details/tiny.compare.json").read_text())
    assert stored["assumed"] == {"pressure_sensitivity": 19.17}
    found = json.loads(poro("compare", "tiny.h5", volts, *PART, "--pressure-sensitivity", "11.11", "--json").out)
    assert found["assumed"] == {}
    assert found["alignment"]["pressure_turned"]
    assert found["target"]["measured_mm"] == pytest.approx(22.0, abs=0.01)


def test_several_files_give_mean_and_spread(simulated: Path, poro: Poro) -> None:
    files = [written(Truth(linear=linear, cycles=2), Path(f"part-{linear:g}.csv")) for linear in (27.0, 28.0)]
    ended = poro("compare", "tiny.h5", *files, *PART)
    assert ended.code == 0, ended.err
    assert "4 cycles compared" in ended.out
    assert "21.60, 22.40 mm, ± 0.57 mm between the files" in ended.out
    found = json.loads((simulated / "tiny/details/tiny.compare.json").read_text())
    assert [one["measured"] for one in found["recordings"]] == [str(file) for file in files]
    assert found["target"]["measured_mm"] == pytest.approx(22.0, abs=0.01)
    assert found["target"]["spread_recordings_mm"] == pytest.approx(0.8 / np.sqrt(2.0), abs=0.01)


def test_angle_and_force_are_compared_with_theirs(inflated: Path, measured: Path, poro: Poro) -> None:
    path = inflated / "tiny/details/tiny.inflation.h5"
    curves = artifact.read_group(path, "inflate", "curves")
    curves["theta2"] = np.radians(curves["load_factor"] * 12.0)
    datasets = {f"curves/{name}": Dataset(values, "", "") for name, values in curves.items()}
    summary = contents.summarised(contents.summary(path, "inflate"))
    artifact.write(path, artifact.read_header(path), datasets | summary)
    rows = [[t, p, u, str(0.6 * float(u)), str(0.02 * float(u))] for t, p, u in rows_of(measured)]
    header = "time [s],pressure [kPa],displacement [mm],bending angle [deg],tip force [N]"
    ended = poro("compare", "tiny.h5", rewritten(Path("all.csv"), header, rows), *PART)
    assert ended.code == 0, ended.err
    assert "measured 13.20 ± " in ended.out
    assert "predicted 12.00 deg: +1.20 deg (+10.0 %)" in ended.out
    found = json.loads((inflated / "tiny/details/tiny.compare.json").read_text())
    angle, force = found["other_answers"]
    assert (angle["answer"], force["answer"]) == ("angle", "force")
    stiffness = rig.run(ProblemSettings(), 1.5, 1.0, rig.Settings()).spring_stiffness
    assert force["target"]["predicted_N"] == pytest.approx(stiffness * 0.95 * 23.0, rel=1e-3)
    alone = rewritten(Path("angle.csv"), "time [s],pressure [kPa],theta [deg]", [[*row[:2], row[3]] for row in rows])
    found = json.loads(poro("compare", "tiny.h5", alone, *PART, "--json").out)
    assert (found["answer"], found["target"]["predicted_deg"]) == ("angle", pytest.approx(12.0))
    held = rewritten(Path("held.csv"), "time [s],pressure [kPa],force [N]", [[*row[:2], row[4]] for row in rows])
    ended = poro("compare", "tiny.h5", held, *PART)
    assert ended.code == 0, ended.err
    assert "the prediction does not say" in ended.out
    assert "`poro inflate tiny/tiny.h5 --blocked` does" in ended.out

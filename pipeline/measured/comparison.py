"""``poro compare``: a recorded test beside what was predicted for the part, as report, figure and table."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuator.arrays import Floats
from actuator.failure import Failure
from pipeline.case.model import Case
from pipeline.exit_codes import ExitCode, Fault, option_settings
from pipeline.measured.measurement import Measurement
from pipeline.results.json_output import result_json
from pipeline.results.simulation import read_simulation
from pipeline.runs.job import Job
from pipeline.store import artifact, contents
from pipeline.store.atomic import write_bytes
from pipeline.store.tables import as_csv
from stages import compare
from stages.rig import scaled


@dataclass(frozen=True)
class Source:
    """Where a prediction comes from.

    Attributes:
        kind: ``density`` for the simulated density field, ``design`` for the single point of a design.
        path: the artifact.
        notes: sentences about its limits.
    """

    kind: str
    path: Path
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Comparison:
    """A recorded test beside its prediction.

    Attributes:
        job: the case.
        measurement: the file and its recording.
        sha256: of the file's bytes.
        settings: of the comparison.
        prediction: scaled to the part.
        source: of the prediction.
        result: of the comparison.
    """

    job: Job
    measurement: Measurement
    sha256: str
    settings: compare.Settings
    prediction: compare.Prediction
    source: Source
    result: compare.Result

    @property
    def title(self) -> str:
        """Case, file, and the file's first comment, which may say that the test is none."""
        comment = self.measurement.comments[:1]
        return ", ".join([self.job.case.name, self.measurement.path.name, *(text[:80] for text in comment)])

    def files(self, format: str) -> list[Path]:
        """Figure, report and table."""
        stem = f"{self.job.case.name}.compare"
        return [self.job.files.folder / f"{stem}.{ending}" for ending in (format, "json", "csv")]

    def write(self, format: str) -> None:
        """Write figure, report and table.

        Args:
            format: of the figure, ``png`` or ``svg``.

        Raises:
            OSError: if the folder or the disk does not take a file.
        """
        # Load a drawing library.
        from pipeline.figures.comparison import comparison
        from pipeline.figures.saving import save

        figure, report, table = self.files(format)
        save(comparison(self.result, self.prediction, self.title), figure)
        write_bytes(report, f"{self.as_json(format)}\n".encode())
        write_bytes(table, self.as_csv().encode())

    def as_json(self, format: str) -> str:
        """Everything but the curves, for other programs; what ``NAME.compare.json`` holds."""
        case, result, measured = self.job.case, self.result, self.measurement
        target = result.target
        found = {
            "name": case.name,
            "measured": str(measured.path),
            "sha256": self.sha256,
            "comments": list(measured.comments),
            "scale": case.export.scale,
            "youngs_modulus": case.rig.youngs_modulus,
            "settings": self.settings.model_dump(mode="json"),
            "columns": {quantity.value: asdict(column) for quantity, column in measured.columns.items()},
            "rows": len(measured.recording.pressure),
            "cycles": len(result.cycles),
            "prediction": {
                "source": self.source.kind,
                "path": str(self.source.path),
                "curve": self.prediction.curve,
                "target_kPa": self.prediction.target,
            },
            "alignment": asdict(result.alignment),
            "target": {
                "pressure_kPa": target.pressure,
                "measured_mm": target.mean,
                "measured_cycles_mm": target.measured.tolist(),
                "spread_mm": target.spread,
                "predicted_mm": target.predicted,
                "deviation_mm": target.deviation,
                "deviation_percent": target.percent,
            },
            "overall": asdict(result.overall) if result.overall else None,
            "hysteresis": _plain(result.hysteresis),
            "linearity": {"measured": _plain(result.linearity), "predicted": _plain(result.predicted_linearity)},
            "stiffness": _plain(result.stiffness),
            "notes": [*self.source.notes, *result.notes],
        }
        return result_json("compare", found, self.files(format))

    def as_csv(self) -> str:
        """The averaged curves; cells of what is not known are empty."""
        result = self.result
        loading = result.mean_loading
        spread = result.loading.std(axis=0, ddof=1) if len(result.loading) > 1 else np.full(len(loading), np.nan)
        columns = {
            "pressure_kPa": result.pressure,
            "loading_mm": loading,
            "loading_spread_mm": spread,
            "unloading_mm": result.mean_unloading,
            "predicted_mm": result.predicted,
            "deviation_mm": loading - result.predicted,
        }
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return as_csv(columns, (["" if value != value else f"{value:.6g}" for value in row] for row in rows))


def compared(job: Job, measurement: Measurement, options: dict[str, Any]) -> Comparison:
    """Compare a recorded test with the prediction for a job's part.

    Args:
        job: the case, with scale and Young's modulus of the print.
        measurement: the test.
        options: values of :class:`stages.compare.Settings` by name; those that are None keep their default.

    Raises:
        Fault: if an option is out of range or the print's modulus is not known (USAGE), or prediction or recording
            cannot be used (ARTIFACT).
    """
    settings = option_settings(compare.Settings, options)
    prediction, source = _predicted(job)
    try:
        result = compare.run(measurement.recording, prediction, settings)
    except Failure as failure:
        raise Fault(ExitCode.ARTIFACT, f"{measurement.path}: {failure}") from None
    with measurement.path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return Comparison(job, measurement, sha256, settings, prediction, source, result)


def prediction_of(case: Case, response: Mapping[str, Floats] | float) -> compare.Prediction:
    """What was predicted, scaled to the part that a case describes.

    Args:
        case: with the size of the part and what it is printed of.
        response: columns of a pressure-displacement curve, N/mm² and mm, or the elongation of the spring at p_in, mm.

    Raises:
        ValueError: if a curve has no point with pressure on the way up.
    """
    scale, modulus = case.export.scale, case.rig.youngs_modulus
    assert modulus is not None
    pressure_in = case.optimize.parameters()[1].pressure
    if isinstance(response, float):
        pressure, length = np.array([pressure_in]), np.array([response])
    else:
        pressure, length = np.asarray(response["pressure"]), np.asarray(response["elongation"])
        rows = (np.asarray(response["loading"]) == 1) & np.isfinite(pressure) & np.isfinite(length)
        if not (pressure[rows] > 0.0).any():
            raise ValueError("it has no loading part; make it again with `poro simulate`")
        pressure, length = pressure[rows], length[rows]
    kilopascals, millimetres = scaled(pressure, length, case.optimize, scale, modulus)
    target, _ = scaled(pressure_in, 0.0, case.optimize, scale, modulus)
    return compare.Prediction(kilopascals, millimetres, target, not isinstance(response, float))


def _predicted(job: Job) -> tuple[compare.Prediction, Source]:
    """What was predicted, scaled to the part, and where it comes from."""
    case = job.case
    if case.rig.youngs_modulus is None:
        raise Fault(
            ExitCode.USAGE,
            f"{job.argument}: the stiffness of the print is not known; give its initial Young's modulus in N/mm² with "
            "--youngs, or as youngs_modulus below 'rig:' in the case.",
        )
    design = job.artifact("optimize")
    beside = dict.fromkeys((job.files.folder, design.parent))
    simulations = [folder / f"{case.name}.simulation.h5" for folder in beside]
    found = next((path for path in simulations if path.is_file()), None)
    if not found:
        note = (
            f"the prediction is the single point of {design.name} and the origin, not a curve; "
            f"`poro simulate {job.argument}` gives one"
        )
        elongation = float(contents.summary(design, "optimize")["spring_elongation"])
        return prediction_of(case, elongation), Source("design", design, (note,))
    try:
        prediction = prediction_of(case, read_simulation(found).curves)
    except ValueError as error:
        raise Fault(ExitCode.ARTIFACT, f"{found}: {error}.") from None
    notes: tuple[str, ...] = ()
    if design.is_file() and artifact.read_header(found).upstream_identity != artifact.read_header(design).identity:
        notes = (f"{found} was not made from this {design.name}; run `poro simulate` again",)
    return prediction, Source("density", found, notes)


def _plain(found: Any) -> dict[str, Any] | None:
    """Fields of a result for JSON."""
    if found is None:
        return None
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in asdict(found).items()}

"""``poro compare``: a recorded test beside what was predicted for the part, as report, figure and table."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from stages.compare import deviations
from stages.rig import scaled
from stages.words import PredictionName

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Source:
    """Where a prediction comes from.

    Attributes:
        kind: ``as-printed`` for the inflated part, ``density`` for the simulated density field, ``design`` for the
            single point of a design.
        path: the artifact.
        notes: sentences about its limits.
    """

    kind: str
    path: Path
    notes: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """What it is, for people."""
        return {"as-printed": "as printed", "density": "density field"}.get(self.kind, self.kind)


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
        others: predictions that are drawn beside it.
        result: of the comparison.
    """

    job: Job
    measurement: Measurement
    sha256: str
    settings: compare.Settings
    prediction: compare.Prediction
    source: Source
    others: tuple[tuple[compare.Prediction, Source], ...]
    result: compare.Result

    @property
    def others_at_target(self) -> list[tuple[Source, float | None]]:
        """What the other predictions say at the target pressure, mm; None where they do not reach it."""
        return [(source, predicted_at(other, self.result.target.pressure)) for other, source in self.others]

    @property
    def title(self) -> str:
        """Case, file, and the file's first comment, which may say that the test is none."""
        comment = self.measurement.comments[:1]
        return ", ".join([self.job.case.name, self.measurement.path.name, *(text[:80] for text in comment)])

    def files(self, format: str) -> list[Path]:
        """Figure, report and table."""
        stem = f"{self.job.case.name}.compare"
        return [self.job.files.folder / f"{stem}.{ending}" for ending in (format, "json", "csv")]

    def drawn(self) -> Figure:
        """Measured rows and all predictions over the pressure."""
        from pipeline.figures.comparison import comparison  # loads a drawing library

        beside = {source.words: other for other, source in self.others}
        return comparison(self.result, self.prediction, self.title, self.source.words, beside)

    def write(self, format: str) -> None:
        """Write figure, report and table.

        Args:
            format: of the figure, ``png``, ``svg`` or ``pdf``.

        Raises:
            OSError: if the folder or the disk does not take a file.
        """
        from pipeline.figures.saving import save  # loads a drawing library

        figure, report, table = self.files(format)
        save(self.drawn(), figure)
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
            "beside": [
                {"source": source.kind, "path": str(source.path), "predicted_mm": predicted}
                for source, predicted in self.others_at_target
            ],
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


def compared(job: Job, measurement: Measurement, wanted: PredictionName | None, options: dict[str, Any]) -> Comparison:
    """Compare a recorded test with the prediction for a job's part.

    Args:
        job: the case, with scale and Young's modulus of the print.
        measurement: the test.
        wanted: which curve to compare with; None for the best that there is.
        options: values of :class:`stages.compare.Settings` by name; those that are None keep their default.

    Raises:
        Fault: if an option is out of range or the print's modulus is not known (USAGE), or prediction or recording
            cannot be used (ARTIFACT).
    """
    settings = option_settings(compare.Settings, options)
    (prediction, source), *others = _predicted(job, wanted)
    try:
        result = compare.run(measurement.recording, prediction, settings)
    except Failure as failure:
        raise Fault(ExitCode.ARTIFACT, f"{measurement.path}: {failure}") from None
    with measurement.path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return Comparison(job, measurement, sha256, settings, prediction, source, tuple(others), result)


def prediction_of(case: Case, response: Mapping[str, Floats] | float) -> compare.Prediction:
    """What was predicted, scaled to the part that a case describes.

    Args:
        case: with the size of the part and what it is printed of.
        response: columns of a pressure-displacement curve, N/mm² and mm, or the elongation of the spring at p_in, mm.
            A curve without a column ``loading`` is that of an inflated part: the pressure rises along all of it, and
            what counts of the spring's end, whose way up is positive there, is how far it travels.

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
        if "loading" not in response:
            length = np.copysign(1.0, length[-1]) * length
        rows = (np.asarray(response.get("loading", 1)) == 1) & np.isfinite(pressure) & np.isfinite(length)
        if not (pressure[rows] > 0.0).any():
            raise ValueError("it has no loading part; make it again")
        pressure, length = pressure[rows], length[rows]
    kilopascals, millimetres = scaled(pressure, length, case.optimize, scale, modulus)
    target, _ = scaled(pressure_in, 0.0, case.optimize, scale, modulus)
    return compare.Prediction(kilopascals, millimetres, target, not isinstance(response, float))


def predicted_at(prediction: compare.Prediction, target: float) -> float | None:
    """Displacement that a prediction says at a pressure, kPa, in mm; None where it does not."""
    path = deviations.rising(prediction.pressure, prediction.displacement)
    return deviations.at_target(path, target, prediction.curve, prediction.target)


def _predicted(job: Job, wanted: PredictionName | None) -> list[tuple[compare.Prediction, Source]]:
    """What was predicted, scaled to the part, and where it comes from: what to compare with, then the others."""
    case = job.case
    if case.rig.youngs_modulus is None:
        raise Fault(
            ExitCode.USAGE,
            f"{job.argument}: the stiffness of the print is not known; give its initial Young's modulus in N/mm² with "
            "--youngs, or as youngs_modulus below 'rig:' in the case.",
        )
    design = job.artifact("optimize")
    sources = [source for source in (_as_printed(job, design), _density(job, design)) if source]
    sources.sort(key=lambda source: source.kind != wanted)  # else the best one stays the first
    if wanted and (not sources or sources[0].kind != wanted):
        stage = _STAGES[wanted]
        raise Fault(
            ExitCode.USAGE,
            f"--prediction {wanted}: there is no {job.artifact(stage)}; make it with `poro {stage} {job.argument}`.",
        )
    if not sources:
        note = (
            f"the prediction is the single point of {design.name} and the origin, not a curve; "
            f"`poro inflate {job.argument}` and `poro simulate {job.argument}` give one"
        )
        elongation = float(contents.summary(design, "optimize")["spring_elongation"])
        return [(prediction_of(case, elongation), Source("design", design, (note,)))]
    return [(_prediction(case, source), source) for source in sources]


#: The stage that each curve comes from.
_STAGES: dict[str, str] = {"as-printed": "inflate", "density": "simulate"}


def _prediction(case: Case, source: Source) -> compare.Prediction:
    if source.kind == "density":
        curves: Mapping[str, Floats] = read_simulation(source.path).curves
    else:
        curves = artifact.read_group(source.path, "inflate", "curves")
    try:
        return prediction_of(case, curves)
    except ValueError as error:
        raise Fault(ExitCode.ARTIFACT, f"{source.path}: {error} with `poro {_STAGES[source.kind]}`.") from None


def _found(job: Job, design: Path, *names: str) -> Path | None:
    """The first file of these names in the folder of the results or beside the design."""
    folders = dict.fromkeys((job.files.folder, design.parent))
    return next((path for folder in folders for name in names if (path := folder / name).is_file()), None)


def _density(job: Job, design: Path) -> Source | None:
    path = _found(job, design, f"{job.case.name}.simulation.h5")
    if path is None:
        return None
    if design.is_file() and artifact.read_header(path).upstream_identity != artifact.read_header(design).identity:
        return Source("density", path, (f"{path} was not made from this {design.name}; run `poro simulate` again",))
    return Source("density", path)


def _as_printed(job: Job, design: Path) -> Source | None:
    """The inflated part; its size does not matter, as the curve is that of the case."""
    path = _found(job, design, job.artifact("inflate").name, f"{job.case.name}.inflation.h5")
    if path is None:
        return None
    optimised = contents.summary(path, "inflate")["optimised"]
    if optimised and design.is_file():
        own = contents.summary(design, "optimize")["spring_elongation"]
        if optimised["elongation"]["optimised"] != own:
            note = f"{path} was made from another design than {design.name}; run `poro inflate` again"
            return Source("as-printed", path, (note,))
    return Source("as-printed", path)


def _plain(found: Any) -> dict[str, Any] | None:
    """Fields of a result for JSON."""
    if found is None:
        return None
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in asdict(found).items()}

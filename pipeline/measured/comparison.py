"""``poro compare``: recorded tests beside what was predicted for the part, as report, figure and table."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.failure import Failure
from pipeline.exit_codes import ExitCode, Fault, option_settings
from pipeline.measured.column_names import RESPONSES, Quantity
from pipeline.measured.measurement import Measurement
from pipeline.measured.predictions import Source, blocked_force, predicted_at, predictions
from pipeline.measured.rows import LeftOut
from pipeline.results.json_output import result_json
from pipeline.runs.job import Job
from pipeline.store.atomic import write_bytes
from pipeline.store.tables import as_csv
from stages import compare
from stages.words import PredictionName

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Answer:
    """What the part answered to the pressure, beside its prediction.

    Attributes:
        quantity: displacement, angle or force.
        prediction: scaled to the part.
        source: of the prediction.
        others: predictions that are drawn beside it.
        result: of the comparison.
    """

    quantity: Quantity
    prediction: compare.Prediction
    source: Source
    others: tuple[tuple[compare.Prediction, Source], ...]
    result: compare.Result

    @property
    def unit(self) -> str:
        """Of its numbers: mm, deg or N."""
        return self.quantity.kind.value

    @property
    def others_at_target(self) -> list[tuple[Source, float | None]]:
        """What the other predictions say at the target pressure; None where they do not reach it."""
        return [(source, predicted_at(other, self.result.target.pressure)) for other, source in self.others]

    def as_json(self) -> dict[str, Any]:
        """The numbers, for other programs; keys end in their unit."""
        result, target, unit = self.result, self.result.target, self.unit
        several = len(result.recordings) > 1
        return {
            "answer": self.quantity.value,
            "cycles": len(result.cycles),
            "prediction": {
                "source": self.source.kind,
                "path": str(self.source.path),
                "curve": self.prediction.curve,
                "target_kPa": self.prediction.target,
            },
            "beside": [
                {"source": source.kind, "path": str(source.path), f"predicted_{unit}": predicted}
                for source, predicted in self.others_at_target
            ],
            "target": {
                "pressure_kPa": target.pressure,
                f"measured_{unit}": target.mean,
                f"measured_cycles_{unit}": target.measured.tolist(),
                f"measured_recordings_{unit}": result.at_target.tolist(),
                f"spread_{unit}": target.spread,
                f"spread_recordings_{unit}": float(result.at_target.std(ddof=1)) if several else None,
                f"predicted_{unit}": target.predicted,
                f"deviation_{unit}": target.deviation,
                "deviation_percent": target.percent,
            },
            "overall": asdict(result.overall) if result.overall else None,
            "hysteresis": _plain(result.hysteresis),
            "linearity": {"measured": _plain(result.linearity), "predicted": _plain(result.predicted_linearity)},
            "stiffness": _plain(result.stiffness),
        }


@dataclass(frozen=True)
class Comparison:
    """Recorded tests of one part, or of specimens of it, beside the prediction.

    Attributes:
        job: the case.
        measurements: the files and their recordings.
        sha256: of each file's bytes.
        settings: of the comparison.
        answers: what was compared; the first is drawn and written as a table.
        notes: sentences about what was not compared.
    """

    job: Job
    measurements: tuple[Measurement, ...]
    sha256: tuple[str, ...]
    settings: compare.Settings
    answers: tuple[Answer, ...]
    notes: tuple[str, ...]

    @property
    def main(self) -> Answer:
        """What is drawn and written as a table."""
        return self.answers[0]

    @property
    def title(self) -> str:
        """Case, files, and the first file's first comment, which may say that the test is none."""
        comment = self.measurements[0].comments[:1]
        names = [measured.path.name for measured in self.measurements]
        return ", ".join([self.job.case.name, *names, *(text[:80] for text in comment)])

    @property
    def all_notes(self) -> list[str]:
        """Sentences about limits of the prediction, and about what was assumed or passed over."""
        several = len(self.measurements) > 1
        found: list[str] = [*(note for answer in self.answers for note in answer.source.notes), *self.notes]
        for number, measured in enumerate(self.measurements):
            own = [*measured.notes, *(note for each in self.answers for note in each.result.recordings[number].notes)]
            found += [f"{measured.path.name}: {note}" if several else note for note in own]
        return list(dict.fromkeys(found))

    def left_out(self, number: int) -> list[LeftOut]:
        """Rows of a file that were not used."""
        measured = self.measurements[number]
        found = list(measured.left_out)
        for answer in self.answers:
            for lost in answer.result.recordings[number].lost:
                quantity = Quantity(lost.signal)
                if quantity is Quantity.PRESSURE and answer is not self.main:
                    continue
                column = measured.columns[quantity]
                text = f"{lost.value / measured.factors[quantity]:.6g}"
                line = int(measured.lines[lost.rows[0]])
                found.append(LeftOut(f"{lost.why} in '{column.title}'", len(lost.rows), line, text))
        return found

    def files(self, format: str) -> list[Path]:
        """Figure, report and table."""
        stem = f"{self.job.case.name}.compare"
        return [self.job.files.details / f"{stem}.{ending}" for ending in (format, "json", "csv")]

    def drawn(self) -> Figure:
        """Measured rows and all predictions over the pressure."""
        from pipeline.figures.comparison import comparison  # loads a drawing library

        main = self.main
        beside = {source.words: other for other, source in main.others}
        return comparison(main.result, main.prediction, self.title, main.source.words, beside)

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
        case, recordings = self.job.case, [self._recording(number) for number in range(len(self.measurements))]
        found = {
            "name": case.name,
            **recordings[0],
            "recordings": recordings,
            "scale": case.export.scale,
            "youngs_modulus": case.rig.youngs_modulus,
            "settings": self.settings.model_dump(mode="json"),
            **self.main.as_json(),
            "other_answers": [answer.as_json() for answer in self.answers[1:]],
            "notes": self.all_notes,
        }
        return result_json("compare", found, self.files(format))

    def _recording(self, number: int) -> dict[str, Any]:
        """What is said of one file."""
        measured = self.measurements[number]
        return {
            "measured": str(measured.path),
            "sha256": self.sha256[number],
            "comments": list(measured.comments),
            "columns": {quantity.value: asdict(column) for quantity, column in measured.columns.items()},
            "rows": len(measured.lines),
            "left_out": [asdict(each) for each in self.left_out(number)],
            "assumed": {f"{quantity}_sensitivity": value for quantity, value in measured.assumed.items()},
            "alignment": asdict(self.main.result.recordings[number].alignment),
        }

    def as_csv(self) -> str:
        """The averaged curves; cells of what is not known are empty."""
        result, unit = self.main.result, self.main.unit
        loading = result.mean_loading
        spread = result.loading.std(axis=0, ddof=1) if len(result.loading) > 1 else np.full(len(loading), np.nan)
        columns = {
            "pressure_kPa": result.pressure,
            f"loading_{unit}": loading,
            f"loading_spread_{unit}": spread,
            f"unloading_{unit}": result.mean_unloading,
            f"predicted_{unit}": result.predicted,
            f"deviation_{unit}": loading - result.predicted,
        }
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        return as_csv(columns, (["" if value != value else f"{value:.6g}" for value in row] for row in rows))


def compared(
    job: Job, measured: Measurement | Sequence[Measurement], wanted: PredictionName | None, options: dict[str, Any]
) -> Comparison:
    """Compare recorded tests with the prediction for a job's part.

    Args:
        job: the case, with scale and Young's modulus of the print.
        measured: the test, or repetitions of it.
        wanted: which curve to compare with; None for the best that there is.
        options: values of :class:`stages.compare.Settings` by name; those that are None keep their default.

    Raises:
        Fault: if an option is out of range or the print's modulus is not known (USAGE), or prediction or recording
            cannot be used (ARTIFACT).
    """
    settings = option_settings(compare.Settings, options)
    files = (measured,) if isinstance(measured, Measurement) else tuple(measured)
    common = [each for each in RESPONSES if all(each in file.recordings for file in files)]
    if not common:
        raise Fault(ExitCode.USAGE, "The recorded tests have nothing in common but the pressure; compare them apart.")
    answers: list[Answer] = []
    notes = []
    for quantity in common:
        try:
            answers.append(_answer(job, files, quantity, wanted, settings, alone=common == [Quantity.FORCE]))
        except Fault as fault:
            if not answers:
                raise
            notes.append(f"the {quantity} is not compared: {str(fault).rstrip('.')}")
    sha256 = []
    for file in files:
        with file.path.open("rb") as stream:
            sha256.append(hashlib.file_digest(stream, "sha256").hexdigest())
    return Comparison(job, files, tuple(sha256), settings, tuple(answers), tuple(notes))


def _answer(
    job: Job,
    files: tuple[Measurement, ...],
    quantity: Quantity,
    wanted: PredictionName | None,
    settings: compare.Settings,
    *,
    alone: bool,
) -> Answer:
    """Compare one answer to the pressure; a force ``alone`` is that of a held arm."""
    (prediction, source), *others = [blocked_force(job)] if alone else predictions(job, wanted, quantity)
    # What turns the displacement's signal says nothing of another.
    main = quantity is next(each for each in RESPONSES if each in files[0].recordings)
    own = settings if main else settings.model_copy(update={"sensor": "auto"})
    target = prediction.target if settings.target is None else settings.target
    aligned = []
    for file in files:
        try:
            aligned.append(compare.aligned(file.recordings[quantity], own, target))
        except Failure as failure:
            raise Fault(ExitCode.ARTIFACT, f"{file.path}: {failure}") from None
    try:
        result = compare.run(aligned, prediction, own)
    except Failure as failure:
        raise Fault(ExitCode.ARTIFACT, f"{files[0].path}: {failure}") from None
    return Answer(quantity, prediction, source, tuple(others), result)


def _plain(found: Any) -> dict[str, Any] | None:
    """Fields of a result for JSON."""
    if found is None:
        return None
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in asdict(found).items()}

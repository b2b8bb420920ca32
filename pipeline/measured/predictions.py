"""What was predicted for a part: the curves of the artifacts that are there, scaled to the part on the rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuator.arrays import Floats
from pipeline.case.model import Case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.measured.column_names import Quantity
from pipeline.results.simulation import read_simulation
from pipeline.runs.job import Job
from pipeline.store import artifact, contents
from pipeline.store.files import detail_of
from stages import compare, rig
from stages.compare import deviations
from stages.words import PredictionName

#: Column of a curve and key of a design's summary that an answer to the pressure comes from. A force is the spring's.
_COLUMNS = {
    Quantity.DISPLACEMENT: ("elongation", "spring_elongation"),
    Quantity.ANGLE: ("theta2", "theta2"),
    Quantity.FORCE: ("elongation", "spring_elongation"),
}
#: The stage that each curve comes from.
_STAGES: dict[str, str] = {"as-printed": "inflate", "density": "simulate"}


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


def prediction_of(
    case: Case, response: Mapping[str, Floats] | float, answer: Quantity = Quantity.DISPLACEMENT
) -> compare.Prediction:
    """What was predicted, scaled to the part that a case describes.

    Args:
        case: with the size of the part and what it is printed of.
        response: columns of a pressure-displacement curve, N/mm², mm and rad, or the elongation of the spring at p_in,
            mm, or the angle, rad. A curve without a column ``loading`` is that of an inflated part: the pressure rises
            along all of it, and what counts of the spring's end, whose way up is positive there, is how far it travels.
        answer: what is compared: the displacement of the spring's end, the angle of the plate or the spring's force.

    Raises:
        ValueError: if a curve has no point with pressure on the way up.
    """
    modulus = case.rig.youngs_modulus
    assert modulus is not None
    pressure_in = case.optimize.parameters()[1].pressure
    if isinstance(response, float):
        pressure, value = np.array([pressure_in]), np.array([response])
    else:
        pressure, value = np.asarray(response["pressure"]), np.asarray(response[_COLUMNS[answer][0]])
        if "loading" not in response:
            value = np.copysign(1.0, value[-1]) * value
        rows = (np.asarray(response.get("loading", 1)) == 1) & np.isfinite(pressure) & np.isfinite(value)
        if not (pressure[rows] > 0.0).any():
            raise ValueError("it has no loading part; make it again")
        pressure, value = pressure[rows], value[rows]
    kilopascals, millimetres = rig.scaled(pressure, value, case.optimize, case.export.scale, modulus)
    target, _ = rig.scaled(pressure_in, 0.0, case.optimize, case.export.scale, modulus)
    if answer is Quantity.ANGLE:
        shown = np.degrees(value)
    elif answer is Quantity.FORCE:
        shown = rig.run(case.optimize, case.export.scale, modulus, case.rig).spring_stiffness * millimetres
    else:
        shown = millimetres
    return compare.Prediction(kilopascals, shown, target, not isinstance(response, float))


def predicted_at(prediction: compare.Prediction, target: float) -> float | None:
    """What a prediction says at a pressure, kPa, in its unit; None where it does not."""
    path = deviations.rising(prediction.pressure, prediction.displacement)
    return deviations.at_target(path, target, prediction.curve, prediction.target)


def predictions(
    job: Job, wanted: PredictionName | None, answer: Quantity = Quantity.DISPLACEMENT
) -> list[tuple[compare.Prediction, Source]]:
    """What was predicted, scaled to the part, and where it comes from: what to compare with, then the others.

    Raises:
        Fault: if the print's modulus or a curve that is wanted is missing (USAGE), or an artifact cannot be used
            (ARTIFACT).
    """
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
        found = float(contents.summary(design, "optimize")[_COLUMNS[answer][1]])
        return [(prediction_of(case, found, answer), Source("design", design, (note,)))]
    return [(_prediction(case, source, answer), source) for source in sources]


def blocked_force(job: Job) -> tuple[compare.Prediction, Source]:
    """The force at the arm's end if that is held, at p_in: a test with a force alone; NaN where nobody computed it.

    Raises:
        Fault: as :func:`predictions`.
    """
    (elsewhere, _), *_ = predictions(job, None)
    source = _as_printed(job, job.artifact("optimize"))
    force = contents.summary(source.path, "inflate").get("blocked_force") if source else None
    case, at = job.case, np.array([elsewhere.target])
    if source is None or force is None or case.rig.youngs_modulus is None:
        note = f"nothing says what force a held arm takes; `poro inflate {job.argument} --blocked` does"
        path = source.path if source else job.artifact("inflate")
        return compare.Prediction(at, np.array([np.nan]), elsewhere.target, False), Source("as-printed", path, (note,))
    # Forces scale by Ē R̄² / (E R²).
    stiffer = case.rig.youngs_modulus / case.optimize.material.youngs_modulus
    newtons = abs(float(force)) * stiffer * case.export.scale**2
    return compare.Prediction(at, np.array([newtons]), elsewhere.target, False), source


def _prediction(case: Case, source: Source, answer: Quantity) -> compare.Prediction:
    if source.kind == "density":
        curves: Mapping[str, Floats] = read_simulation(source.path).curves
    else:
        curves = artifact.read_group(source.path, "inflate", "curves")
    try:
        return prediction_of(case, curves, answer)
    except ValueError as error:
        raise Fault(ExitCode.ARTIFACT, f"{source.path}: {error} with `poro {_STAGES[source.kind]}`.") from None


def _found(job: Job, design: Path, *names: str) -> Path | None:
    """The first file of these names among the details of the results or of the design."""
    folders = dict.fromkeys((job.files.details, detail_of(design, "")))
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

"""The functions of ``import poro``: cases, the stages as functions with typed results, and finished artifacts.

They wire what the rooms below do and compute nothing themselves. Lengths are in mm, forces in N, stresses and pressures
in N/mm²; only :func:`compare` and :func:`rig`, which speak of a part on the test rig, have kPa. What is wrong with a
case, an option or a file is raised as :class:`poro.Fault`, what a stage cannot do as :class:`poro.Failure`; ``str`` of
both is a sentence that says what to change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from pydantic import BaseModel, ValidationError

import stages.check
import stages.compare
import stages.export
import stages.finish
import stages.fit
import stages.inflate
import stages.mirror
import stages.optimize
import stages.refine
import stages.rig
import stages.simulate
import stages.slices
from pipeline.case.changes import changed
from pipeline.case.model import Case, examined, find_case
from pipeline.case.model import read_case as read_case_file
from pipeline.exit_codes import ExitCode, Fault, wrong_option
from pipeline.measured.fitting import fit_test
from pipeline.measured.measurement import read_measurement
from pipeline.measured.predictions import prediction_of
from pipeline.measured.uniaxial_test import read_uniaxial_test
from pipeline.results.design import OptimisedDesign, read_design
from pipeline.results.inflation import Inflation, read_inflation
from pipeline.results.simulation import Curves, Simulation, read_simulation
from pipeline.runs import first_design
from pipeline.store import artifact, contents
from pipeline.store.solid_file import SolidFile, read_solid
from stages.events import Observer, silent
from stages.section import Section
from stages.words import Unit

if TYPE_CHECKING:
    from actuator.arrays import Floats, Ints
    from actuator.domains.interface import Domain
    from actuator.geometry.zero_set import Surface
    from stages.initial import Given

PathName = str | PathLike[str]
Settings = TypeVar("Settings", bound=Section)


@runtime_checkable
class Field(Protocol):
    """A density field on its mesh: an optimised or a refined design."""

    @property
    def domain(self) -> Domain:
        """The mesh."""

    @property
    def chi(self) -> Floats:
        """χ at its vertices, (n_vertices,)."""


class Solid(Protocol):
    """A closed surface: what :func:`mirror`, :func:`export` and :func:`load` return."""

    @property
    def vertices(self) -> Floats:
        """(n, 3), mm."""

    @property
    def triangles(self) -> Ints:
        """(m, 3), counter-clockwise seen from outside."""


# ------------------------------------------------------------------------------------------------ cases


def read_case(path: PathName) -> Case:
    """Read and check a case file, or a shipped case by its name, such as ``case14.yaml``.

    Raises:
        Fault: one sentence for every mistake.
    """
    return read_case_file(find_case(Path(path)))[0]


def make_case(**sections: Any) -> Case:
    """Build a case: ``make_case(name="mine", domain={"layers": 12}, load={"pressure_ratio": 0.01})``.

    Args:
        sections: as in a case file; those of another case may be given as they are. What is left out has its default.

    Raises:
        Fault: one sentence for every mistake.
    """
    plain = {name: value.model_dump() if isinstance(value, BaseModel) else value for name, value in sections.items()}
    return _checked(plain)


def with_changes(case: Case, changes: Mapping[str, Any]) -> Case:
    """A case with other values: ``with_changes(case, {"load.pressure": "10 kPa", "name": "softer"})``.

    Args:
        case: is not changed itself.
        changes: dotted keys of a case file, with their values.

    Raises:
        Fault: one sentence for every mistake.
    """
    return changed(case, changes)


def _checked(data: dict[str, Any]) -> Case:
    case, wrong = examined(data)
    if case is None:
        raise Fault(ExitCode.USAGE, "\n".join(f"{sentence}." for _, sentence in wrong))
    return case


def _compute(case: Case, threads: int | None) -> stages.optimize.Compute:
    return (case if threads is None else with_changes(case, {"compute.threads": threads})).compute.build()


# ------------------------------------------------------------------------------------------------ stages


def optimize(
    case: Case,
    *,
    threads: int | None = None,
    observer: Observer = silent,
    resume: stages.optimize.Result | Mapping[str, Any] | None = None,
    initial: Field | Solid | None = None,
) -> OptimisedDesign:
    """Optimise the design of a case.

    Args:
        case: the case.
        threads: instead of the case's; 0 for one per core. The result does not depend on them.
        observer: is called with every :class:`poro.DesignUpdate` and :class:`poro.Message`; what it raises ends the
            optimisation.
        resume: a design of the same problem to go on from, or the checkpoint of a design update.
        initial: a design of another problem, or a part, to begin with; by default what ``case.initial`` says.

    Raises:
        Failure: if the initial design has no state or a linear solve fails its check.
    """
    start = resume.checkpoint if isinstance(resume, stages.optimize.Result) else resume
    case, given = _first_design(case, initial)
    result = stages.optimize.run(
        case.optimize,
        compute=_compute(case, threads),
        observer=observer,
        resume=dict(start) if start else None,
        initial=given,
    )
    return OptimisedDesign(**vars(result), case=case)


def _first_design(case: Case, initial: Field | Solid | None) -> tuple[Case, Given | None]:
    """The case and what it begins with: what is given or else what its file holds."""
    from actuator.geometry.zero_set import Surface

    if initial is None:
        return case, first_design.read(Path(case.initial.file))[0] if case.initial.file else None
    if case.initial.file is None:
        case = with_changes(case, {"initial.wall": None, "initial.file": "given"})
    if isinstance(initial, Field):
        return case, (initial.domain, initial.chi)
    return case, Surface(initial.vertices, initial.triangles)


def refine(case: Case, design: Field, *, observer: Observer = silent) -> stages.refine.Result:
    """Put a design on a finer mesh and filter it; see :func:`stages.refine.run`."""
    return stages.refine.run(design.domain, design.chi, case.refine, observer)


def finish(
    case: Case, refined: Field, *, threads: int | None = None, observer: Observer = silent
) -> stages.finish.Result:
    """Move the surface of a refined design until the inflated part keeps its strain limit.

    See :func:`stages.finish.run`.

    Args:
        case: the case; its ``finish.method`` says whether anything is done.
        refined: of :func:`refine`.
        threads: instead of the case's.
        observer: is called with every :class:`poro.FinishStep`.
    """
    return stages.finish.run(
        refined.domain,
        refined.chi,
        case.optimize,
        case.finish,
        case.mirror.threshold,
        _compute(case, threads),
        observer,
    )


def mirror(case: Case, design: Field, *, observer: Observer = silent) -> stages.mirror.Result:
    """The closed surface of the whole solid of a design, refined or not; see :func:`stages.mirror.run`."""
    return stages.mirror.run(design.domain, design.chi, case.mirror, observer)


def export(case: Case, solid: Solid, *, observer: Observer = silent) -> stages.export.Result:
    """Scale a solid and prove it; ``data`` of the result are the bytes of the STL or 3MF file.

    See :func:`stages.export.run`.
    """
    return stages.export.run(solid.vertices, solid.triangles, case.export, observer, case.name)


def simulate(
    case: Case, design: stages.optimize.Result, *, threads: int | None = None, observer: Observer = silent
) -> stages.simulate.Result:
    """Follow the response of a design from zero pressure to beyond p_in and back; see :func:`stages.simulate.run`.

    Args:
        case: the case.
        design: of :func:`optimize` or :func:`load`.
        threads: instead of the case's.
        observer: is called with every :class:`poro.LoadStep`.
    """
    return stages.simulate.run(
        design.under(case.simulate.load_case),
        case.optimize,
        case.simulate,
        compute=_compute(case, threads),
        observer=observer,
    )


def inflate(
    case: Case,
    part: PathName | Solid,
    design: stages.optimize.Result | None = None,
    *,
    threads: int | None = None,
    observer: Observer = silent,
    **options: Any,
) -> stages.inflate.Result:
    """Inflate a part as it is printed, on a mesh that fits it; see :func:`stages.inflate.run`.

    Args:
        case: its material, load, arm and spring, and the settings of the section ``inflate``.
        part: STL or 3MF file of any origin, or a solid in the size of the print, such as of :func:`export`.
        design: that the part came from, to compare with.
        threads: instead of the case's.
        observer: is called with every :class:`poro.LoadStep`.
        options: fields of :class:`stages.inflate.Settings` instead of the case's, such as ``size=2.0``.

    Raises:
        Failure: if the part is no solid that holds air between plates, or the mesh too coarse for it.
    """
    case, solid = with_changes(case, {f"inflate.{name}": value for name, value in options.items()}), _solid(part)
    return stages.inflate.run(
        solid.vertices,
        solid.triangles,
        case.optimize,
        case.inflate,
        _compute(case, threads),
        observer,
        case.rig.youngs_modulus,
        design.summary if design else None,
    )


def rig(
    case: Case, design: stages.optimize.Result | None = None, inflated: stages.inflate.Result | None = None
) -> stages.rig.Result:
    """The test rig for a case's part: pressure in kPa, arm and spring.

    The travel is that of the part as printed if its inflation is given, or else of the design if that is.

    Raises:
        Fault: if the case does not say what the part is printed of, ``rig.youngs_modulus``.
    """
    at = inflated.summary["at_target"] if inflated else None
    elongation = at["elongation"] if at else float(design.summary["spring_elongation"]) if design else None
    modulus = _printed_modulus(case)
    return stages.rig.run(case.optimize, case.export.scale, modulus, case.rig, elongation, as_printed=bool(at))


def check(part: PathName | Solid, **options: Any) -> stages.check.Result:
    """Tell whether a part can be printed in silicone and inflated.

    Args:
        part: STL or 3MF file of any origin, or a solid in the size of the print.
        options: fields of :class:`stages.check.Settings`, such as ``wall=0.5``.
    """
    solid = _solid(part)
    return stages.check.run(solid.vertices, solid.triangles, _settings(stages.check.Settings, options))


def slice(part: PathName | Solid, *, observer: Observer = silent, **options: Any) -> stages.slices.Result:
    """The layers of a part as a printer will see them.

    Args:
        part: as for :func:`check`.
        observer: is told if vertices had to be merged that are not equal.
        options: fields of :class:`stages.slices.Settings`: ``thickness``, mm, and ``direction``.
    """
    solid = _solid(part)
    return stages.slices.run(solid.vertices, solid.triangles, _settings(stages.slices.Settings, options), observer)


def fit(test: PathName | tuple[Floats, Floats], *, unit: str | None = None, **options: Any) -> stages.fit.Result:
    """Fit material laws to a uniaxial tension test.

    Args:
        test: CSV with stretch (or strain) and engineering stress, or both as arrays, the stress in N/mm².
        unit: of the stress of a file whose header has none.
        options: fields of :class:`stages.fit.Settings`: ``law``, ``terms``, ``strain_limit``, ``up_to``, ``whole``.
    """
    settings = _settings(stages.fit.Settings, options)
    if isinstance(test, tuple):
        stretch, stress = (np.asarray(column, dtype=np.float64) for column in test)
        return stages.fit.run(stretch, stress, settings)
    return fit_test(read_uniaxial_test(Path(test), unit), settings)


def compare(
    case: Case,
    measured: PathName | stages.compare.Recording,
    predicted: Curves | stages.optimize.Result,
    **options: Any,
) -> stages.compare.Result:
    """Compare a recorded test of a printed part with its prediction.

    Args:
        case: says how large the part is and what it is printed of: ``export.scale`` and ``rig.youngs_modulus``.
        measured: CSV with pressure and displacement, or a recording in kPa and mm.
        predicted: a simulation, a part as printed, or a design, which is a single point.
        options: fields of :class:`stages.compare.Settings`, such as ``target``, kPa.
    """
    _printed_modulus(case)
    if isinstance(measured, stages.compare.Recording):
        recording = measured
    else:
        recording = read_measurement(Path(measured)).recording
    if isinstance(predicted, stages.optimize.Result):
        prediction = prediction_of(case, float(predicted.summary["spring_elongation"]))
    else:
        prediction = prediction_of(case, predicted.curves)
    return stages.compare.run(recording, prediction, _settings(stages.compare.Settings, options))


# ------------------------------------------------------------------------------------------------ artifacts


def load(
    path: PathName, unit: Unit | None = None
) -> OptimisedDesign | stages.refine.Result | Surface | SolidFile | Simulation | Inflation:
    """What a finished artifact or an exported part holds.

    Returns:
        Of ``NAME.h5`` the design, of ``NAME.refined.h5`` the refined one, of
        ``NAME.finished.h5`` the finished one, of ``NAME.solid.h5`` the closed surface, of
        ``NAME.simulation.h5`` the curves, of ``NAME.inflation.h5`` the curve of the part, and of an ``.stl`` or
        ``.3mf`` its triangles.

    Args:
        path: the file.
        unit: of a solid whose file does not say its own, as no STL of another program does.

    Raises:
        Fault: if the file is missing, unreadable, or none of these, or the unit of a solid is doubtful.
    """
    path = Path(path)
    if path.suffix.lower() != ".h5":
        return read_solid(path, unit)
    stage = artifact.read_header(path).stage
    if stage not in _LOADERS:
        known = ", ".join(_LOADERS)
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is the result of '{stage}'; give the one of {known}.")
    return _LOADERS[stage](path)


def _field(path: Path) -> stages.refine.Result:
    return stages.refine.Result(*contents.design(path, artifact.read_header(path).stage))


def _surface(path: Path) -> Surface:
    from actuator.geometry.zero_set import Surface

    return Surface(*contents.surface(path))


_LOADERS: dict[str, Callable[[Path], OptimisedDesign | stages.refine.Result | Surface | Simulation | Inflation]] = {
    "optimize": read_design,
    "refine": _field,
    "finish": _field,
    "mirror": _surface,
    "simulate": read_simulation,
    "inflate": read_inflation,
}


def _solid(part: PathName | Solid) -> Solid:
    return read_solid(Path(part)) if isinstance(part, str | PathLike) else part


def _printed_modulus(case: Case) -> float:
    if case.rig.youngs_modulus is None:
        sentence = "rig.youngs_modulus: is missing; give the initial Young's modulus of the print in N/mm²."
        raise Fault(ExitCode.USAGE, sentence)
    return case.rig.youngs_modulus


def _settings(kind: type[Settings], options: dict[str, Any]) -> Settings:
    try:
        return kind.model_validate(options)
    except ValidationError as error:
        raise wrong_option(".".join(map(str, error.errors()[0]["loc"])), error) from None

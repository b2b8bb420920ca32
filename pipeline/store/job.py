"""A job: a case, the files it makes, and which stages are already given."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from pipeline.case.model import Case, changed, find_case, read_case, stored_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact
from pipeline.store.artifact import Header
from pipeline.store.stage_names import STAGES
from stages.export import Settings as ExportSettings

SUFFIXES = {"optimize": ".h5", "refine": ".refined.h5", "mirror": ".solid.h5", "simulate": ".simulation.h5"}


@dataclass(frozen=True)
class Files:
    """Where a job's files lie.

    Attributes:
        folder: of all of them.
        name: of the case.
        part: file name of the exported part.
    """

    folder: Path
    name: str
    part: str

    def artifact(self, stage: str) -> Path:
        """The artifact of a stage; that of ``export`` is the record beside the part."""
        ending = SUFFIXES.get(stage)
        return self.folder / (f"{self.name}{ending}" if ending else f"{self.part}.h5")

    @property
    def exported(self) -> Path:
        """The part, STL or 3MF."""
        return self.folder / self.part

    @property
    def picture(self) -> Path:
        """The picture of the part."""
        return self.exported.with_suffix(".png")

    @property
    def rig(self) -> Path:
        """The sheet for the test rig."""
        return self.exported.with_suffix(".rig.md")

    @property
    def curves(self) -> Path:
        """The simulation's curves as a table."""
        return self.folder / f"{self.name}.simulation.csv"

    @property
    def curves_picture(self) -> Path:
        """The simulation's curves as a figure."""
        return self.curves.with_suffix(".png")

    @property
    def log(self) -> Path:
        """The log, to which every command appends."""
        return self.folder / f"{self.name}.log"

    @property
    def checkpoint(self) -> Path:
        """State of an optimisation under way."""
        return self.folder / f"{self.name}.checkpoint.h5"

    @property
    def updates(self) -> Path:
        """Folder with the fields of the design updates of an optimisation under way."""
        return self.folder / f"{self.name}.updates"

    @property
    def lock(self) -> Path:
        """Locked while a process works on the case."""
        return self.folder / f".{self.name}.lock"

    @property
    def holder(self) -> Path:
        """Says which process that is."""
        return self.folder / f".{self.name}.holder"

    def owns(self, name: str) -> bool:
        """Whether a command that works on the case, and no other, writes a file of this name."""
        artifacts = "|".join(re.escape(ending) for ending in (*SUFFIXES.values(), ".checkpoint.h5"))
        grids = "|".join(re.escape(ending.replace(".h5", ".vtkhdf")) for ending in SUFFIXES.values())
        parts = r"(\.scale-[^/]+)?\.(stl|3mf|stl\.h5|3mf\.h5|png|rig\.md)"
        curves = r"\.simulation\.(csv|png|thresholded\.vtkhdf)"
        return re.fullmatch(f"{re.escape(self.name)}({artifacts}|{grids}|{parts}|{curves})", name) is not None


@dataclass(frozen=True)
class Job:
    """A case and where it is worked on.

    Attributes:
        argument: the case or artifact as the user named it.
        case: with the command line's changes.
        case_text: as the user wrote it.
        own_export: the case's section ``export`` without the command line's changes.
        files: where the results lie.
        given: header of the artifact the user named instead of a case: its stage and those before are not run.
    """

    argument: Path
    case: Case
    case_text: str
    own_export: ExportSettings
    files: Files
    given: Header | None = None

    def artifact(self, stage: str) -> Path:
        """The artifact of a stage."""
        return self.argument if self.given and self.given.stage == stage else self.files.artifact(stage)

    @property
    def simulation(self) -> Path | None:
        """The artifact of ``poro simulate``, if it lies beside the optimisation's."""
        path = self.artifact("optimize").with_name(f"{self.case.name}.simulation.h5")
        return path if path.is_file() else None

    def recorded(self, stage: str) -> Case:
        """The case as a stage's artifact records it; another scale or format of one part is not the case's."""
        return self.case if stage == "export" else self.case.model_copy(update={"export": self.own_export})


def _refuse_impossible(folder: Path) -> None:
    """Refuse a path that the system will not even look up; whether it can be made a folder shows when it is made."""
    try:
        folder.exists()
    except OSError as error:
        sentence = f"{str(folder)[:60]}…: cannot be a folder ({error.strerror}); choose another --output."
        raise Fault(ExitCode.USAGE, sentence) from None


@dataclass(frozen=True)
class Changes:
    """What the command line says instead of the case; None where it says nothing."""

    updates: int | None = None
    threads: int | None = None
    scale: float | None = None
    format: str | None = None
    youngs: float | None = None
    max_load: float | None = None

    def applied(self, case: Case) -> Case:
        """The changed case.

        Raises:
            Fault: if a value is out of range (USAGE).
        """
        for option, value, section, key in (
            ("--updates", self.updates, "optimizer", "max_updates"),
            ("--threads", self.threads, "compute", "threads"),
            ("--scale", self.scale, "export", "scale"),
            ("--format", self.format, "export", "format"),
            ("--youngs", self.youngs, "rig", "youngs_modulus"),
            ("--max-load", self.max_load, "simulate", "max_load"),
        ):
            if value is not None:
                case = changed(case, option, section, key, value)
        return case


def open_job(argument: Path, output: Path | None = None, changes: Changes | None = None) -> Job:
    """The job that a command line describes.

    Args:
        argument: a case file, or an artifact of a case.
        output: folder of the results; by default an artifact's own folder, or for a case
            ``outputs`` in the working folder if there is one, else the working folder.
        changes: what the command line says instead of the case.

    Raises:
        Fault: if the case is not usable (USAGE), or the artifact is not (ARTIFACT).
    """
    given: Header | None = None
    if argument.suffix == ".h5":
        given = artifact.read_header(argument)
        if given.stage not in STAGES:
            kind = "a checkpoint" if given.stage == "checkpoint" else f"the result of '{given.stage}'"
            raise Fault(ExitCode.ARTIFACT, f"{argument}: this is {kind}; give the case file it belongs to.")
        case, text = stored_case(given.case_resolved, argument), given.case_text
        default = argument.parent
    else:
        case, text = read_case(find_case(argument))
        default = default_folder()
    own_export = case.export
    case = changes.applied(case) if changes else case
    tag = f".scale-{case.export.scale:g}" if changes and changes.scale is not None else ""
    _refuse_impossible(output or default)
    files = Files(output or default, case.name, f"{case.name}{tag}.{case.export.format}")
    return Job(argument, case, text, own_export, files, given)


def default_folder() -> Path:
    """Where results go unless a command says otherwise: ``outputs`` if there is one here, else here."""
    return Path("outputs") if Path("outputs").is_dir() else Path()

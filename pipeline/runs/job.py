"""A job: a case, the files it makes, and which stages are already given."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline.case import text as case_text
from pipeline.case.changes import SET, changed, parsed
from pipeline.case.mesh_file import of_artifact, with_mesh
from pipeline.case.model import Case, find_case, read_case, stored_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.adopted import adopted, exported, is_solid
from pipeline.runs.first_design import known_by_content
from pipeline.runs.keys import plain
from pipeline.store import artifact
from pipeline.store.artifact import Header
from pipeline.store.files import OUTPUTS, Files, folder_of, part_of
from stages.chain import GOAL, STAGES, Option, followers, path_to, renaming
from stages.formats import FORMATS
from stages.words import Unit


@dataclass(frozen=True)
class Job:
    """A case and where it is worked on.

    Attributes:
        argument: the case, artifact or solid that is worked on.
        case: with the command line's changes.
        case_text: as the user wrote it.
        own: the case without the command line's changes.
        files: where the results lie.
        given: header of the artifact the user named instead of a case, or of a solid that was adopted: its stage and
            those before are not run.
        changes: what the command line says instead of the case, by dotted key.
        unit: of a solid whose file does not say its own, if the user said it.
    """

    argument: Path
    case: Case
    case_text: str
    own: Case
    files: Files
    given: Header | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)
    unit: Unit | None = None

    def artifact(self, stage: str) -> Path:
        """The artifact of a stage."""
        return self.argument if self.given and self.given.stage == stage else self.files.artifact(stage)

    @property
    def part(self) -> Path:
        """The part that is there or will be."""
        if not self.given or not STAGES[self.given.stage].makes_part:
            return self.files.exported
        return self.argument if is_solid(self.argument) else part_of(self.argument)

    def recorded(self, stage: str) -> Case:
        """The case as a stage's artifact records it.

        It has those changes of the command line that were made to the sections of the stage and of those before it, or
        to sections of no stage; what another stage was told is not the case's: another scale of one part, for instance.
        """
        path = path_to(stage)
        others = {section for name, row in STAGES.items() if name not in path for section in row.sections}
        foreign = others - {section for name in path for section in STAGES[name].sections}
        return changed(self.own, {key: value for key, value in self.changes.items() if _section(key) not in foreign})

    def replaced(self, stage: str) -> dict[str, Any]:
        """What the case itself says of the keys on which a stage depends and which the command line changed.

        Of what is nested deeper, such as ``material.law.c1``, it is all of the section's key, ``material.law``.
        A key that is not recorded while it says nothing, such as ``load.cases``, is None then.
        """
        sections, own = STAGES[stage].sections, plain(self.own)
        keys = [key.split(".")[:2] for key in self.changes if _section(key) in sections]
        return {f"{section}.{key}": own[section].get(key) for section, key in keys}

    def as_made(self, header: Header) -> dict[str, Any]:
        """The resolved case with what the command line said when an artifact was made.

        A key of which the case now says something else is the case's again.
        """
        resolved = plain(self.case)
        for name, own in header.replaced.items():
            section, _, key = name.partition(".")
            if resolved.get(section, {}).get(key) == own:
                made = header.case_resolved[section]
                resolved[section] = {k: value for k, value in resolved[section].items() if k != key}
                resolved[section] |= {key: made[key]} if key in made else {}
        return resolved


def _section(key: str) -> str:
    return key.partition(".")[0]


def open_job(
    argument: Path,
    output: Path | None = None,
    changes: Mapping[Option, Any] | None = None,
    of_case: Path | None = None,
    settings: Iterable[str] = (),
    unit: Unit | None = None,
    *,
    under_way: bool = False,
) -> Job:
    """The job that a command line describes.

    Args:
        argument: a case file, an artifact of a case, or a solid.
        output: folder in which that of the case lies; by default ``outputs`` in the working folder if there is one,
            else the working folder. What is made of an artifact or a solid goes to where that lies.
        changes: what the command line says instead of the case; None where it says nothing.
        of_case: the case that a solid is to be taken for one of, see :func:`pipeline.runs.adopted.adopted`.
        settings: what else it says instead of the case, ``key=value`` each.
        unit: of a solid whose file does not say its own.
        under_way: whether a checkpoint will do as the argument, or in place of an artifact that is not there yet.

    Raises:
        Fault: if the case is not usable (USAGE), or the artifact or solid is not (ARTIFACT).
    """
    given: Header | None = None
    if of_case and not is_solid(argument):
        raise Fault(ExitCode.USAGE, f"--case {of_case}: goes with a solid, and {argument} is none; leave it out.")
    if unit and not is_solid(argument):
        raise Fault(ExitCode.USAGE, f"--unit {unit}: goes with a solid, and {argument} is none; leave it out.")
    if is_solid(argument):
        argument = (None if of_case or unit else exported(argument)) or argument
    if is_solid(argument):
        given, own, text = adopted(argument, of_case, unit)
        here: Path | None = folder_of(argument)
    elif argument.suffix == ".h5":
        argument = or_checkpoint(argument) if under_way else argument
        header = artifact.read_header(argument)
        if not (under_way and header.stage == artifact.CHECKPOINT):
            _refuse_dead_end(argument, header.stage)
            given = header
        own, text = stored_case(header.case_resolved, argument), header.case_text
        own = of_artifact(own, argument, header.stage)
        here = folder_of(argument)
    else:
        own, text = read_case(find_case(argument))
        here = None
    said = {option: value for option, value in (changes or {}).items() if value is not None}
    replaced, flags = _said(said, parsed(settings))
    elsewhere = (output or default_folder()) / str(replaced.get("name", own.name))
    folder = elsewhere if output or here is None else here
    _refuse_impossible(folder)
    return replace(make_job(argument, own, text, folder, given, replaced, flags), unit=unit)


def open_shown(
    argument: Path, output: Path | None, changes: Mapping[Option, Any] | None = None, *, under_way: bool = False
) -> tuple[Job, Path | None]:
    """The job whose results a command shows, and the folder that what it draws goes to, if the user named one.

    What belongs to an artifact lies where that does, wherever its pictures go; of a case the output is that of the
    results, too.

    Raises:
        Fault: as :func:`open_job` does.
    """
    of_artifact = argument.suffix == ".h5"
    job = open_job(argument, None if of_artifact else output, changes, under_way=under_way)
    return job, output if of_artifact else None


def _said(options: Mapping[Option, Any], settings: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """What the command line says, by dotted key, and by which of its options it says so.

    Raises:
        Fault: if it says two things of one key, or sets a whole section (USAGE).
    """
    flags = {option.dotted: option.flag for option in options}
    for key in settings:
        if key in flags:
            raise Fault(ExitCode.USAGE, f"{SET}: {key}: {flags[key]} says it too; leave one of them out.")
        if "." not in key and isinstance(settings[key], Mapping):
            raise Fault(ExitCode.USAGE, f"{SET}: {key}: is a section; set its keys one by one, {key}.KEY=VALUE.")
    # Quantities are typed as in a case file, where 1.0 is a number and 70 kPa is text.
    said = {
        option.dotted: case_text.value(value, option.flag) if isinstance(value, str) and not option.choices else value
        for option, value in options.items()
    }
    return said | dict(settings), flags


def or_checkpoint(path: Path) -> Path:
    """An artifact, or the checkpoint that stands for that of an optimisation which is not there yet."""
    left = Files(folder_of(path), path.stem, "").checkpoint
    return left if left.exists() and not path.exists() else path


def make_job(
    argument: Path,
    own: Case,
    text: str,
    folder: Path,
    given: Header | None = None,
    changes: Mapping[str, Any] | None = None,
    flags: Mapping[str, str] | None = None,
) -> Job:
    """The job of a case whose files lie in a folder.

    Args:
        argument, own, text, folder, given: see :class:`Job`.
        changes: what the command line says instead, by dotted key.
        flags: those of its options that say so, by key; ``--set`` says the rest.

    Raises:
        Fault: if a value of the command line is out of range, or the file that the case begins with is not usable.
    """
    changes = dict(changes or {})
    if given is None:
        own = known_by_content(own, argument, text, Files(folder, own.name, ""))
    bare = own
    if given is None:
        own = with_mesh(own, argument, text)
    if "initial.file" in changes:
        changes = {"initial.sha256": None, **changes}
    other_mesh = any(_section(key) == "domain" for key in changes)
    case = changed(bare if other_mesh else own, changes, flags or {}) if changes else own
    if other_mesh:
        case = with_mesh(case, argument, "")
        changes |= {f"domain.{key}": getattr(case.domain, key) for key in getattr(case.domain, "found", ())}
    if "initial.file" in changes:
        case = known_by_content(case, argument, "", Files(folder, case.name, ""))
        changes["initial.sha256"] = case.initial.sha256
    names = renaming()
    tag = "".join(f".{names[key]}-{value:g}" for key, value in changes.items() if key in names)
    part = f"{case.name}{tag}{FORMATS[case.export.format].ending}"
    job = Job(argument, case, text, own, Files(folder, case.name, part), given, changes)
    return replace(job, files=replace(job.files, part=job.part.name))


def default_folder() -> Path:
    """Where the folders of cases go unless a command says otherwise: ``outputs`` if there is one here, else here."""
    return Path(OUTPUTS) if Path(OUTPUTS).is_dir() else Path()


def _refuse_dead_end(argument: Path, stage: str) -> None:
    """Refuse an artifact with which no stage can go on."""
    if stage not in STAGES or (stage != GOAL and not followers(stage)):
        kind = f"the result of '{stage}'" if stage != artifact.CHECKPOINT else "a checkpoint"
        raise Fault(ExitCode.ARTIFACT, f"{argument}: this is {kind}; give the case file it belongs to.")


def _refuse_impossible(folder: Path) -> None:
    """Refuse a path that the system will not even look up; whether it can be made a folder shows when it is made."""
    try:
        folder.exists()
    except OSError as error:
        sentence = f"{str(folder)[:60]}…: cannot be a folder ({error.strerror}); choose another --output."
        raise Fault(ExitCode.USAGE, sentence) from None

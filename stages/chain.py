"""The table of stages: all that the program knows of a stage before it runs one.

Plans, content keys, names of files, the sections of the case file, the commands and what is said at the end are made
from it; what a stage computes is in its module, which is loaded where it is needed. A stage of another program is one
more row::

    from stages.chain import STAGES, Stage

    STAGES.register("weigh", Stage("weigh", after="mirror", module="weigh", suffix=".weigh.h5", ...))
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from actuator.registry import Registry
from stages.formats import FORMATS

if TYPE_CHECKING:  # settings and arrays: `poro --help` needs neither
    from stages.rig import RigUnits
    from stages.section import Section
    from stages.task import Need, StageModule


@dataclass(frozen=True)
class Option:
    """An option of a stage's command that stands for one key of the case file.

    Attributes:
        flag: as it is typed, ``--max-load``.
        kind: type of its value.
        section, key: which key of the case it replaces.
        help: sentence for ``--help``.
        choices: things by whose names the value is one; any value of the type if None.
        renames: whether a part made with it gets a file name of its own, ``NAME.scale-1.5.stl``.
    """

    flag: str
    kind: type
    section: str
    key: str
    help: str
    choices: Mapping[str, Any] | None = field(default=None, compare=False)
    renames: bool = False

    @property
    def name(self) -> str:
        """As a name in Python."""
        return self.flag.lstrip("-").replace("-", "_")

    @property
    def dotted(self) -> str:
        """The key as it is written outside of its section, ``export.scale``."""
        return f"{self.section}.{self.key}"


@dataclass(frozen=True)
class Beside:
    """A file for people or other programs that is written beside an artifact.

    Attributes:
        writer: name of what writes it, in the registry of the pipeline.
        ending: of its name, after that of the part or of the case.
        settings: module whose ``Settings`` are a section of the case file that is called as the writer is; none if
            empty.
        of_result: whether it shows the result itself, so that one of an older result must not stay beside a new part.
        on_top: whether it lies beside the part, not among the details.
    """

    writer: str
    ending: str
    settings: str = ""
    of_result: bool = False
    on_top: bool = False


@dataclass(frozen=True)
class Stage:
    """A row of the table.

    Attributes:
        name: of the stage, of its command, and of its own section of the case file if ``sections`` has it.
        help: sentence that says what it does.
        module: where its method is, see :class:`stages.task.StageModule`.
        suffix: end of its artifact's name; where the stage makes a file of its own, what follows that file's name.
        sections: of the case file, on which its result depends.
        after: the stage on whose artifact it works; none if empty.
        options: of its command, beside those that all have.
        recorded_only: keys of its sections that say what is kept beside the result, not what the result is.
        only_with: keys of its sections, or whole sections, that count only where another key is set, with that key.
        extent: keys that say how far a run goes, not which path it takes: longer runs continue shorter ones. Only the
            optimisation has any.
        makes_part: whether it makes a file of its own, whose format is the key ``format`` of its section.
        beside: files that are written beside its artifact.
    """

    name: str
    help: str
    module: str
    suffix: str
    sections: tuple[str, ...]
    after: str = ""
    options: tuple[Option, ...] = ()
    recorded_only: tuple[str, ...] = ()
    only_with: Mapping[str, str] = field(default_factory=dict)
    extent: tuple[str, ...] = ()
    makes_part: bool = False
    beside: tuple[Beside, ...] = ()

    def load(self) -> StageModule:
        """Its module; imports it."""
        return cast("StageModule", importlib.import_module(self.module))

    @property
    def of_part(self) -> bool:
        """Whether its files are named after the part, not after the case: it makes or takes one."""
        return self.makes_part or self.takes_part

    @property
    def takes_part(self) -> bool:
        """Whether it works on the part that the stage before it makes."""
        return bool(self.after) and STAGES[self.after].makes_part

    def verdict(self, summary: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
        """What a user reads first of all of a summary, names and values: whether the result is any good.

        Args:
            summary: of the stage.
            rig: turns numbers of the case into those of the part; a function without lengths and forces takes none.
        """
        verdict: list[tuple[str, str]] = self._call("verdict", [], summary, rig)
        return verdict

    def lines(self, summary: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
        """What a user reads of a summary besides, names and values; arguments as of :meth:`verdict`."""
        lines: list[tuple[str, str]] = self._call("lines", [], summary, rig)
        return lines

    def needs(self, case: Any) -> Need | None:
        """Least memory for a case; None if it is little."""
        need: Need | None = self._call("needs", None, case)
        return need

    def shortfall(self, summary: Mapping[str, Any], path: str) -> str:
        """What a result lacks that lies at a path, and the remedy; empty if it is whole."""
        shortfall: str = self._call("shortfall", "", summary, path)
        return shortfall

    def instability(self, summary: Mapping[str, Any], path: str) -> str:
        """Why a state in a result that lies at a path would not last, and the remedy; empty if nothing is known."""
        instability: str = self._call("instability", "", summary, path)
        return instability

    def _call(self, function: str, default: Any, *arguments: Any) -> Any:
        """The result of a function that the module may have, called with as many arguments as it takes."""
        found = getattr(self.load(), function, None)
        return found(*arguments[: len(inspect.signature(found).parameters)]) if found else default


UPDATES = Option(
    "--updates", int, "optimizer", "max_updates", "Most design updates; 0 evaluates the initial design only."
)
THREADS = Option("--threads", int, "compute", "threads", "Threads; 0 for one per core.")
SCALE = Option("--scale", float, "export", "scale", "Size of the part over size of the domain.", renames=True)
FORMAT = Option("--format", str, "export", "format", "File format.", choices=FORMATS)
MOST_REMOVED = Option(
    "--most-removed", float, "export", "most_removed", "Share of the volume that may be removed as islands."
)
SIZE = Option("--size", str, "inflate", "size", "Largest edge of the tetrahedra, in the lengths of the domain, mm.")
PART_SCALE = Option(
    "--scale", float, "inflate", "part_scale", "Size of the part over size of the domain. Default: by their lengths."
)
PRESSURE = Option(
    "--pressure", str, "inflate", "pressure", "p_in on the print of --youngs, kPa, or with a unit: '3 psi'."
)
BLOCKED = Option("--blocked", bool, "inflate", "blocked", "Also compute the force at the arm's end if that is held.")
AXIS = Option(
    "--axis", str, "inflate", "axis", "Axis between the end faces that plates are glued on.", dict.fromkeys("xyz")
)
INFLATE_TO = Option("--max-load", float, "inflate", "max_load", "Largest pressure over p_in.")
MAX_LOAD = Option("--max-load", float, "simulate", "max_load", "Largest pressure over p_in.")
LOAD_CASE = Option("--load-case", str, "simulate", "load_case", "Load case that is followed, by its name.")


def youngs(meaning: str = "") -> Option:
    """The option for the stiffness of a print; ``meaning`` is what it is good for."""
    help = f"Young's modulus of the print, N/mm², or with a unit, '70 kPa'{f': {meaning}' if meaning else ''}."
    return Option("--youngs", str, "rig", "youngs_modulus", help)


RIG = Beside("rig", ".rig.md", settings="stages.rig", on_top=True)

STAGES: Registry[Stage] = Registry("stage")

#: What `poro run` makes unless it is told otherwise, and the part without what it does under pressure.
GOAL, PART = "inflate", "export"

for _row in (
    Stage(
        "optimize",
        "Optimise the design of a case.",
        module="stages.optimize",
        suffix=".h5",
        sections=("domain", "material", "load", "objective", "elements", "initial", "optimizer"),
        options=(UPDATES, THREADS),
        # What a file holds decides, by its sha256, not where it lies.
        recorded_only=("optimizer.keep_updates", "initial.file"),
        extent=("optimizer.max_updates", "optimizer.stationarity", "optimizer.least_gain"),
    ),
    Stage(
        "refine",
        "Put the design on a finer mesh and filter it.",
        module="stages.refine",
        suffix=".refined.h5",
        sections=("refine",),
        after="optimize",
    ),
    Stage(
        "finish",
        "Move the part's surface until the inflated part keeps its strain limit, if finish.method says so.",
        module="stages.finish",
        suffix=".finished.h5",
        sections=("finish", "domain", "material", "load", "objective", "mirror"),
        after="refine",
        # Without a method the design goes through as it is.
        only_with=dict.fromkeys(("finish", "domain", "material", "load", "objective", "mirror"), "finish.method"),
        options=(THREADS,),
        beside=(Beside("finish", ".finish.csv"), Beside("finish-figure", ".finish.png")),
    ),
    Stage(
        "mirror",
        "Extract the closed surface of the whole solid.",
        module="stages.mirror",
        suffix=".solid.h5",
        sections=("mirror",),
        after="finish",
    ),
    Stage(
        "export",
        "Scale, prove and write the part as STL or 3MF, and draw it.",
        module="stages.export",
        suffix=".h5",
        sections=("export",),
        after="mirror",
        options=(SCALE, FORMAT, MOST_REMOVED, youngs("also writes the rig's sheet")),
        makes_part=True,
        beside=(Beside("part-figure", ".png", of_result=True, on_top=True), RIG),
    ),
    Stage(
        "simulate",
        "Follow the response from zero pressure to beyond p_in and back.",
        module="stages.simulate",
        suffix=".simulation.h5",
        sections=("simulate",),
        after="optimize",
        options=(MAX_LOAD, LOAD_CASE, youngs("curves in the rig's units"), SCALE, THREADS),
        beside=(Beside("curves", ".simulation.csv"), Beside("curves-figure", ".simulation.png")),
    ),
    Stage(
        "inflate",
        "Inflate the part as it is printed, on a mesh that fits it.",
        module="stages.inflate",
        suffix=".inflation.h5",
        sections=("inflate", "domain", "material", "load", "objective", "rig"),
        after="export",
        # Without a pressure of its own the print's modulus only scales what is shown.
        only_with={"rig.youngs_modulus": "inflate.pressure"},
        options=(
            SIZE,
            INFLATE_TO,
            PRESSURE,
            youngs("curve in the rig's units"),
            PART_SCALE,
            AXIS,
            BLOCKED,
            THREADS,
        ),
        beside=(
            Beside("inflation", ".inflation.csv", of_result=True),
            Beside("inflation-figure", ".inflation.png", of_result=True),
            Beside("inflated-figure", ".inflated.png", of_result=True),
            RIG,
        ),
    ),
):
    STAGES.register(_row.name, _row)


def path_to(name: str) -> tuple[str, ...]:
    """Names of the stages from the first one to this one."""
    before = STAGES[name].after
    return (*path_to(before), name) if before else (name,)


def followers(name: str) -> tuple[str, ...]:
    """Names of the stages that work on what this one makes."""
    return tuple(row.name for row in STAGES.values() if row.after == name)


def renaming() -> dict[str, str]:
    """Keys with which a part gets a file name of its own, and what they are called in it."""
    return {option.dotted: option.name for row in STAGES.values() for option in row.options if option.renames}


def goal_from(name: str) -> str:
    """What is made if no goal is given and this stage shall be part of it."""
    return GOAL if name in path_to(GOAL) else name


def sections() -> dict[str, type[Section]]:
    """Sections of the case file that stages have to themselves, in the order of the table."""
    return dict(_sections())


def _sections() -> Iterator[tuple[str, type[Section]]]:
    for row in STAGES.values():
        if row.name in row.sections:
            yield row.name, importlib.import_module(row.module).Settings
        for beside in row.beside:
            if beside.settings:
                yield beside.writer, importlib.import_module(beside.settings).Settings

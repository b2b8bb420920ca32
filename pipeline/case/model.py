"""The case file: one YAML file that holds the settings of every stage."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field, ValidationError, create_model

import stages.optimize
from actuator.solver_name import SolverName
from pipeline.case import text as case_text
from pipeline.case.messages import Messages, kind_of
from pipeline.case.names import NAME_PATTERN, refusal, reserved_endings
from pipeline.case.quantities import Mistake, as_written, taken_out, with_quantities, with_values
from pipeline.case.shipped import shipped_case, shipped_names
from pipeline.exit_codes import ExitCode, Fault, shown
from stages.chain import sections
from stages.section import Section

#: Most mistakes of a file that are spelt out.
MOST_MISTAKES = 20

#: The schema's name and that of its language.
SCHEMA_ID = "urn:poro:case"
SCHEMA_LANGUAGE = "https://json-schema.org/draft/2020-12/schema"


class ComputeSettings(Section):
    """How to compute; recorded, but no reason to compute again."""

    threads: int = Field(0, ge=0, le=1024, description="threads; 0 for one per available core [-]")
    linear_solver: SolverName = Field("auto", description="direct solver of the linear systems")

    def build(self) -> stages.optimize.Compute:
        """The optimiser's counterpart, with the number of threads decided."""
        return stages.optimize.Compute(threads=self.threads or available_cores(), linear_solver=self.linear_solver)


class Case(stages.optimize.Settings):
    """A complete case: the optimisation's settings, those of the other stages, and how to compute.

    Cases are made of :func:`case_type`, which has the sections of all stages.
    """

    name: str = Field("case", max_length=100, pattern=NAME_PATTERN, description="stem of all file names")

    if TYPE_CHECKING:
        compute: ComputeSettings

        def __getattr__(self, section: str) -> Any:
            """The section of a stage."""

    @cached_property
    def given(self) -> Mapping[str, float]:
        """Quantities that stood in place of ratios of the load, by their keys and in their units."""
        return {}

    @cached_property
    def optimize(self) -> stages.optimize.Settings:
        """The part of the case that the optimisation sees."""
        return stages.optimize.Settings(**{key: getattr(self, key) for key in stages.optimize.Settings.model_fields})


def case_type() -> type[Case]:
    """The type of complete cases: it has a section for every stage that is registered now."""
    return _case_type(tuple(sections().items()))


@cache
def _case_type(of_stages: tuple[tuple[str, type[Section]], ...]) -> type[Case]:
    fields: dict[str, Any] = {name: (section, section()) for name, section in of_stages}
    made: type[Case] = create_model("Case", __base__=Case, **fields, compute=(ComputeSettings, ComputeSettings()))
    return made


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def find_case(argument: Path) -> Path:
    """The case file meant by an argument: that path, else the shipped case of that name.

    Raises:
        Fault: if there is none (USAGE).
    """
    try:
        if argument.is_file():
            return argument
        if argument.is_dir():
            raise Fault(ExitCode.USAGE, f"{argument}: this is a folder; name a case file in it.")
    except OSError as error:
        sentence = f"{shown(argument)}: cannot be read ({error.strerror}); give the path of a case file."
        raise Fault(ExitCode.USAGE, sentence) from None
    shipped = shipped_case(argument.name)
    if shipped and argument.parent == Path():
        return shipped
    known = ", ".join(shipped_names())
    where = str(argument.parent) if argument.parent != Path() else f"the working folder {Path.cwd()}"
    raise Fault(
        ExitCode.USAGE,
        f"{argument}: there is no such file in {where}; give the path of a case file or one of the "
        f"shipped cases ({known}).",
    )


def read_case(path: Path) -> tuple[Case, str]:
    """Read and check a case file; returns the case and the text as the user wrote it.

    A file that the case names is looked for beside it, and else in the working folder; the case has its whole path.

    Raises:
        Fault: one sentence for every mistake (USAGE).
    """
    text = read_bytes(path)
    return _seen_from(path.parent, parse_case(text, str(path), path.stem)), text.decode("utf-8-sig")


def _seen_from(folder: Path, case: Case) -> Case:
    """The case with the whole paths of the files that it names: mesh, what it begins with, and shapes of regions."""

    def seen(section: Any) -> Any:
        if (named := getattr(section, "file", None)) is None:
            return section
        beside, here = folder / named, Path(named)
        whole = str((here if here.exists() and not beside.exists() else beside).absolute())
        return section.model_copy(update={"file": whole})

    return case.model_copy(
        update={
            "domain": seen(case.domain),
            "initial": seen(case.initial),
            "regions": [seen(region) for region in case.regions],
        }
    )


def read_bytes(path: Path) -> bytes:
    """What a YAML file holds, no more of it than shows that it is too large.

    Raises:
        Fault: if it cannot be read (USAGE).
    """
    try:
        with path.open("rb") as file:
            return file.read(case_text.MOST_BYTES + 1)
    except OSError as error:
        raise Fault(ExitCode.USAGE, f"{path}: cannot be read ({error.strerror}); check the file.") from None


def parse_case(text: bytes, origin: str, stem: str) -> Case:
    """Check the text of a case file.

    Args:
        text: YAML, UTF-8.
        origin: name of the file for messages.
        stem: name of the case unless the text has one.

    Raises:
        Fault: one sentence for every mistake (USAGE).
    """
    document = case_text.parse(text, origin)
    if not isinstance(document.data, dict):
        kind = kind_of(document.data)
        raise Fault(
            ExitCode.USAGE, f"{origin}:1: a case is made of 'section:' lines, not of {kind}; see `poro schema`."
        )
    # What is no UTF-8 becomes a letter that names do not have either.
    case, wrong = examined({"name": stem.encode(errors="replace").decode()} | document.data)
    if case is None:
        found = sorted((document.line(path), sentence) for path, sentence in wrong)
        sentences = [f"{origin}:{line}: {sentence}." for line, sentence in found[:MOST_MISTAKES]]
        if more := found[MOST_MISTAKES:]:
            sentences.append(f"{origin}:{more[0][0]}: {len(more)} more mistakes follow; mend the others first.")
        raise Fault(ExitCode.USAGE, "\n".join(sentences))
    return case


def examined(data: Mapping[str, Any]) -> tuple[Case | None, list[Mistake]]:
    """The case that data make, or what is wrong with their values."""
    bare, quantities, wrong = taken_out(data)
    case, more = _validated(bare)
    if case and quantities:
        case, more = _validated(bare | {"load": with_values(bare["load"], case.ratios(quantities))})
        more = [as_written(each, quantities) for each in more]
    if case is None or wrong:
        return None, wrong + more
    case.__dict__["given"] = quantities
    return case, []


def mistakes(data: Mapping[str, Any]) -> list[Mistake]:
    """What is wrong with the values of a case: path of the key, and a sentence without file, line and full stop."""
    return examined(data)[1]


def _validated(data: Mapping[str, Any]) -> tuple[Case | None, list[Mistake]]:
    messages = Messages(case_type())
    try:
        case = case_type().model_validate(data, strict=True)
    except ValidationError as error:
        return None, [(messages.section(each["loc"])[1], messages.sentence(each)) for each in error.errors()]
    if wrong := refusal(case.name):
        return None, [(("name",), f"name: {wrong}; choose another name")]
    return case, []


def case_data(case: Case) -> dict[str, Any]:
    """What a case says, as data that can be changed and examined again, with the quantities that it was given."""
    return with_quantities(case.model_dump(exclude_unset=True), case.given)


def stored_case(resolved: dict[str, Any], origin: Path) -> Case:
    """The case inside an artifact, without sections of stages that are not registered here, and without keys that went.

    Raises:
        Fault: if this version of the program does not understand it (ARTIFACT).
    """
    model = case_type()
    try:
        return model.model_validate(dict(_understood(resolved)))
    except ValidationError as error:
        raise Fault(
            ExitCode.ARTIFACT,
            f"{origin}: the case stored inside is not understood ({Messages(model).sentence(error.errors()[0])}); "
            "make the artifact again from its case file.",
        ) from None


def _understood(resolved: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    known = sections()
    for name, values in resolved.items():
        if name in known:
            yield name, {key: value for key, value in values.items() if key not in known[name].gone}
        elif name in Case.model_fields or name == "compute":
            yield name, values


def case_schema() -> str:
    """JSON Schema of the case file, for editors and other programs."""
    found = case_type().model_json_schema()
    for section, field in found["properties"].items():
        for each in (field, *field.get("oneOf", ())):
            if reference := each.get("$ref"):
                # The model's own title is the name of a Python class.
                found["$defs"][reference.rpartition("/")[2]]["title"] = f"Section {section}"
    endings = "|".join(map(re.escape, reserved_endings()))
    found["properties"]["name"]["not"] = {"pattern": f"({endings})$"}
    named = {"$schema": SCHEMA_LANGUAGE, "$id": SCHEMA_ID} | found | {"title": "Case file of poro"}
    return json.dumps(named, indent=2, ensure_ascii=False)

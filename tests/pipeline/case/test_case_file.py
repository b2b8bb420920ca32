"""The case file: what is accepted, and how mistakes are reported."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from command_line import Poro
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.case.model import case_type, find_case, parse_case, read_case
from pipeline.case.text import parse
from pipeline.exit_codes import ExitCode, Fault

MALFORMED = {
    "unknown key": ("domain:\n  radiu: 15.0\n", 2, ["domain.radiu", "unknown key", "'radius'"]),
    "unknown section": ("domian:\n  radius: 15.0\n", 1, ["domian", "'domain'"]),
    "key in the wrong section": ("\nradius: 15.0\n", 2, ["radius", "below 'domain:'"]),
    "wrong type": ("domain:\n\n  layers: nine\n", 3, ["domain.layers", "whole number", "'nine'"]),
    "section that is none": ("domain: 15.0\n", 1, ["domain", "section of keys"]),
    "duplicate key": ("domain:\n  radius: 15.0\n  radius: 16.0\n", 3, ["domain.radius", "twice", "line 2"]),
    "negative radius": ("domain:\n  radius: -15.0\n", 2, ["domain.radius", "greater than 0", "-15"]),
    "number that YAML reads as text": ("objective:\n  area_weight: 1e-3\n", 2, ["area_weight", "write 1.0e-3"]),
    "count that YAML reads as text": ("domain:\n  layers: 1e1\n", 2, ["domain.layers", "write 10"]),
    "fraction for a count": ("domain:\n  layers: 9.5\n", 2, ["domain.layers", "whole number", "9.5"]),
    "sexagesimal": ("domain:\n  radius: 1:30\n", 2, ["domain.radius", "'1:30'"]),
    "truth for a number": ("domain:\n  radius: true\n", 2, ["domain.radius", "true"]),
    "infinite": ("domain:\n  radius: 1.0e+999\n", 2, ["domain.radius", "finite"]),
    "unknown format": ("export:\n  format: obj\n", 2, ["export.format", "'stl' or '3mf'"]),
    "name that leaves the folder": ("name: ../../etc/passwd\n", 1, ["name", "letters, digits"]),
    "name of another artifact": ("name: quick.refined\n", 1, ["name", ".refined"]),
    "anchor": ("domain: &d\n  radius: 15.0\n", 1, ["domain", "anchors"]),
    "tag": ("name: !!python/object/apply:os.getcwd []\n", 1, ["name", "tag", "remove it"]),
    "second document": ("name: a\n---\nname: b\n", 2, ["second YAML document"]),
    "no YAML": ("domain:\n  radius: [15.0\n", 3, ["not valid YAML"]),
    "tabulator": ("domain:\n\tradius: 15.0\n", 2, ["not valid YAML"]),
    "list": ("- domain\n", 1, ["'section:' lines"]),
    "empty": ("", 1, ["empty"]),
    "control character": ("name: a\nexport: \x07\n", 2, ["#x0007"]),
    "key that is a list": ("? [a, b]\n: 1\n", 1, ["a key must be a word"]),
    "deep": ("domain: " + 5000 * "[", 1, ["nested"]),
}


@pytest.mark.parametrize("mistake", MALFORMED)
def test_each_mistake_gives_one_sentence_with_line_key_and_remedy(mistake: str, poro: Poro) -> None:
    text, line, parts = MALFORMED[mistake]
    Path("case.yaml").write_text(text)
    ended = poro("optimize", "case.yaml")
    assert ended.code == ExitCode.USAGE
    assert ended.out == ""
    sentence = ended.err.rstrip("\n")
    assert sentence.startswith(f"poro: case.yaml:{line}: ")
    assert sentence.endswith(".")
    assert "\n" not in sentence
    assert all(part in sentence for part in parts), sentence
    assert list(Path().iterdir()) == [Path("case.yaml")]


def test_every_mistake_of_a_file_is_reported_in_the_order_of_the_file(poro: Poro) -> None:
    Path("case.yaml").write_text("mirror:\n  threshold: x\ndomain:\n  radius: 0.0\n  layer: 3\n")
    lines = poro("optimize", "case.yaml").err.splitlines()
    assert [int(line.removeprefix("poro: ").split(":")[1]) for line in lines] == [2, 4, 5]


def test_missing_file_says_where_it_was_looked_for_and_what_is_shipped(poro: Poro) -> None:
    ended = poro("optimize", "nothing.yaml")
    assert ended.code == ExitCode.USAGE
    assert str(Path.cwd()) in ended.err
    assert "case14.yaml" in ended.err


def test_file_in_the_working_folder_comes_before_a_shipped_one(poro: Poro) -> None:
    assert find_case(Path("quick.yaml")) != Path("quick.yaml")
    Path("quick.yaml").write_text("domain: {layers: 3}\n")
    assert find_case(Path("quick.yaml")) == Path("quick.yaml")


def test_too_large_and_binary_files_are_refused(tmp_path: Path) -> None:
    for content, part in ((b"#" * 300_000, "bytes"), (b"name: \xff\xfe", "UTF-8")):
        path = tmp_path / "case.yaml"
        path.write_bytes(content)
        with pytest.raises(Fault, match=part) as caught:
            read_case(path)
        assert caught.value.code == ExitCode.USAGE


def test_shipped_cases_are_table_1() -> None:
    """Table 1 of arXiv:2605.20101, in its own units."""
    case, _ = read_case(find_case(Path("case14.yaml")))
    domain, (material, load, limits) = case.domain.build(), case.parameters()
    modulus, radius = 2.736, 15.0
    assert (domain.layers, domain.section_cells) == (18, 528)
    assert (domain.radius, domain.length, load.arm_length) == (radius, 15.0, 4.0 * radius)
    assert load.pressure == pytest.approx(2e-2 * modulus)
    assert load.spring_stiffness == pytest.approx(1.6e-2 * modulus * radius**3 / (4.0 * radius) ** 2)
    assert limits.energy_limit == pytest.approx(0.5 * 0.14**2 * modulus)
    assert (limits.area_weight, limits.slope_weight) == (1e-3, 1.0)
    assert (limits.leak_weight, limits.strain_energy_weight) == (1e6, 1e6)
    assert (limits.interface_width, limits.diffusivity_length) == (3.0, 5.0 * 3.0)
    assert material.void_permeability == pytest.approx(1000.0 * 15.0**2 / modulus)
    assert material.solid_permeability == pytest.approx(1e-6 * material.void_permeability)


def test_shipped_cases_differ_only_where_they_say_so() -> None:
    case14, case11, quick = (read_case(find_case(Path(f"{name}.yaml")))[0] for name in ("case14", "case11", "quick"))
    assert case11.objective.strain_limit == 0.11
    objective = case11.objective.model_copy(update={"strain_limit": 0.14})
    assert case11.model_copy(update={"name": "case14", "objective": objective}) == case14
    assert case14.objective.strain_energy_shift == 0.0
    for name, limits in (("case14", case14.objective), ("case11", case11.objective)):
        printed = read_case(find_case(Path(f"{name}-eq14-shift.yaml")))[0]
        objective = limits.model_copy(update={"strain_energy_shift": "4/L_i"})
        assert printed == case14.model_copy(update={"name": printed.name, "objective": objective})
    domain = quick.domain.build()
    assert domain.layers * domain.section_cells == 1080
    small = {
        "name": "case14-eq14-shift",
        "domain": case14.domain,
        "optimizer": case14.optimizer,
        "mirror": case14.mirror,
        "inflate": case14.inflate,
        "rig": case14.rig,
    }
    assert quick.model_copy(update=small) == read_case(find_case(Path("case14-eq14-shift.yaml")))[0]


def test_left_out_keys_take_the_values_of_the_paper() -> None:
    case14, _ = read_case(find_case(Path("case14.yaml")))
    defaults = case_type()(name="case14")
    assert defaults.model_copy(update={"export": case14.export, "rig": case14.rig}) == case14


def test_schema_describes_the_shipped_cases(poro: Poro) -> None:
    schema = json.loads(poro("schema").out)
    text = find_case(Path("case14.yaml")).read_text()
    assert set(yaml.safe_load(text)) <= set(schema["properties"])


def fault_of(text: bytes) -> Fault | None:
    """The fault that a text ends in, if any; other exceptions pass."""
    try:
        parse_case(text, "case.yaml", "case")
    except Fault as fault:
        return fault
    return None


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_no_text_does_more_than_fail_with_a_sentence(text: bytes) -> None:
    if fault := fault_of(text):
        assert fault.code == ExitCode.USAGE
        assert all(line.startswith("case.yaml:") for line in str(fault).splitlines())


SCALARS = st.sampled_from(["1e-3", "1_000", "0x1F", "010", "1:30", "yes", "~", ".inf", "nan", "'a'", "<<", "*a", "{}"])
NUMBERS = st.floats(allow_nan=False, allow_infinity=False).map(repr) | st.integers().map(str)


@settings(deadline=None)  # the first number with a unit loads their registry
@given(st.sampled_from(["name", "domain", "  radius", "  layers"]), SCALARS | NUMBERS)
def test_no_value_does_more_than_fail_with_a_sentence(key: str, value: str) -> None:
    text = f"domain:\n{key}: {value}\n" if key.startswith(" ") else f"{key}: {value}\n"
    if fault := fault_of(text.encode()):
        assert fault.code == ExitCode.USAGE


@given(NUMBERS)
def test_what_is_read_as_a_number_is_the_same_number_to_any_yaml_reader(text: str) -> None:
    value = parse(f"x: {text}".encode(), "case.yaml").data["x"]
    if not isinstance(value, str):
        assert value == yaml.safe_load(text)

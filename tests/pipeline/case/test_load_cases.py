"""Several load cases in a case file, and what a run says of them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import pyvista
import yaml
from command_line import Poro
from jsonschema import Draft202012Validator

from actuator.failure import InvalidSettings
from pipeline.case.model import case_schema, parse_case
from pipeline.case.remarks import remarks
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.design import read_design
from pipeline.results.paper import reference_of
from pipeline.runs.keys import plain
from pipeline.store import artifact, contents
from stages.inflate import refuse_unlike
from stages.optimize import needs

CASE = """\
domain: {core_cells: 2, rings: 1, layers: 3}
load:
  pressure_ratio: 0.01
  cases:
    - {name: free, weight: 0.7, pressure: 54.72 kPa, spring_ratio: 0.0}
    - {name: stiff, spring_stiffness: 0.2 N/mm}
optimizer: {max_updates: 2, keep_updates: 0}
"""


def test_what_a_load_case_leaves_out_is_that_of_the_section() -> None:
    case = parse_case(CASE.encode(), "case.yaml", "case")
    free, stiff = case.load_cases()
    assert (free.name, free.weight, stiff.weight) == ("free", 0.7, 1.0)
    assert free.load.pressure == pytest.approx(0.02 * 2.736)
    assert stiff.load.pressure == pytest.approx(0.01 * 2.736)
    assert free.load.spring_stiffness == 0.0
    assert stiff.load.spring_stiffness == pytest.approx(0.1)  # of half an actuator
    assert case.parameters()[1] == free.load
    Draft202012Validator(json.loads(case_schema())).validate(yaml.safe_load(CASE))


def test_a_single_load_has_the_keys_that_it_had() -> None:
    assert plain(parse_case(b"name: x", "x.yaml", "x"))["load"] == {
        "pressure_ratio": 2.0e-2,
        "arm_ratio": 4.0,
        "spring_ratio": 1.6e-2,
    }


def test_load_cases_need_memory_of_their_own_and_are_no_paper_case() -> None:
    one, two = (parse_case(text.encode(), "x.yaml", "x") for text in ("name: x", CASE))
    assert reference_of(one)
    several = one.model_copy(update={"load": two.load})
    assert reference_of(several) is None
    assert needs(several).memory > 1.7 * needs(one).memory


def test_remarks_name_the_load_case() -> None:
    text = "load: {cases: [{name: a}, {name: hard, pressure_ratio: 0.08}, {name: kPa, pressure: 0.05 kPa}]}"
    found = [each for each in remarks(parse_case(text.encode(), "x.yaml", "x")) if each.startswith("load")]
    assert [each.partition(":")[0] for each in found] == ["load.cases, hard", "load.cases, kPa"]


@pytest.mark.parametrize(
    ("cases", "sentence"),
    [
        (
            "\n    - {name: a}\n    - {name: a}",
            "3: load.cases: two load cases are called 'a'; give each a name of its own",
        ),
        ("\n    - {name: a}\n    - {weight: 1.0}", "5: load.cases.1.name: is missing; write it, see `poro schema`"),
        (
            "\n    - name: a\n      weight: 0",
            "5: load.cases.0.weight: must be greater than 0, not 0; change the value",
        ),
        (
            "\n    - name: a\n      presure: 3 kPa",
            "5: load.cases.0.presure: unknown key; write 'pressure' if that was meant, else remove it",
        ),
        (
            "\n    - name: a\n      pressure: 3 mm",
            "5: load.cases.0.pressure: must be a pressure, and '3 mm' is a length; write it as in '20 kPa', "
            "'0.2 bar' or '3 psi'",
        ),
        (
            "\n    - name: a\n      pressure: 3 kPa\n      pressure_ratio: 0.1",
            "5: load.cases.0.pressure: says the same as load.cases.0.pressure_ratio; remove one of them",
        ),
        (
            "\n    - name: a\n      pressure: -3 kPa",
            "5: load.cases.0.pressure: as pressure_ratio it must be at least 0, not -0.00109649122807; "
            "change the value",
        ),
        (
            "\n    - name: a b",
            "4: load.cases.0.name: 'a b' may only have letters, digits and . _ -; write another name",
        ),
        ("\n    - 7", "4: load.cases.0: must be a section of keys (name, weight, pressure_ratio, …), not 7"),
    ],
)
def test_a_mistake_in_a_load_case_is_told_with_its_line(cases: str, sentence: str) -> None:
    with pytest.raises(Fault) as caught:
        parse_case(f"load:\n  arm_ratio: 4.0\n  cases:{cases}\n".encode(), "x.yaml", "x")
    assert caught.value.code == ExitCode.USAGE
    assert str(caught.value).startswith(f"x.yaml:{sentence}")


def test_a_run_tells_of_every_load_case(tmp_path: Path, poro: Poro) -> None:
    Path("two.yaml").write_text(CASE)
    ended = poro("optimize", "two.yaml", "--threads", "1", "--output", ".", "--json")
    assert ended.code == ExitCode.OK, ended.err
    told = json.loads(ended.out)
    cases = told["load_cases"]
    assert list(cases) == ["free", "stiff"]
    assert told["terms"]["C0"] == pytest.approx(0.7 * cases["free"]["C0"] + cases["stiff"]["C0"])
    assert told["T3"] == cases["free"]["T3"] != cases["stiff"]["T3"]
    assert told["wall_leak"] == max(each["wall_leak"] for each in cases.values())
    assert told["energy_ratio"] == max(each["energy_ratio"] for each in cases.values())
    history = artifact.read_group(Path("two/two.h5"), "optimize", "history")
    assert history["T3.stiff"][-1] == cases["stiff"]["T3"]
    grid = pyvista.read("two/two.vtkhdf")
    assert {"displacement-stiff", "pressure-stiff"} <= set(grid.point_data.keys())
    moved = np.asarray(grid["displacement-stiff"])
    tip = np.isclose(np.asarray(grid.points)[:, 0], 15.0)
    assert moved[tip & np.isclose(np.asarray(grid.points)[:, 2], 0.0), 2] == pytest.approx(cases["stiff"]["T3"])

    text = poro("status", "two.yaml", "--output", ".").out
    assert "optimize" in text
    lines = poro("optimize", "two.yaml", "--threads", "1", "--output", ".").out
    assert "stiff, weight 1: C0 " in lines


def test_what_is_interrupted_is_shown_and_goes_on(tmp_path: Path, poro: Poro) -> None:
    """A checkpoint has the states of all load cases; a longer run continues it."""
    Path("two.yaml").write_text(CASE)
    assert poro("optimize", "two.yaml", "--updates", "1", "--threads", "1", "--output", ".").code == ExitCode.OK
    assert poro("optimize", "two.yaml", "--updates", "2", "--threads", "1", "--output", ".").code == ExitCode.OK
    resumed = read_design(Path("two/two.h5"))
    assert poro("optimize", "two.yaml", "--fresh", "--threads", "1", "--output", ".").code == ExitCode.OK
    straight = read_design(Path("two/two.h5"))
    np.testing.assert_array_equal(resumed.chi, straight.chi)
    np.testing.assert_array_equal(resumed.displacement, straight.displacement)


def test_a_force_counts_for_the_whole_actuator() -> None:
    text = "domain: {radius: 10.0}\nload: {force_ratio: [0, 0, -1.0e-4], cases: [{name: a}, {name: b, FREE}]}"
    free = "force_ratio: [1.0e-4, 0.0, 0.0], pressure_ratio: 0.0"
    pulled, pushed = (each.load for each in parse_case(text.replace("FREE", free).encode(), "x.yaml", "x").load_cases())
    assert pulled.force == pytest.approx((0.0, 0.0, -0.5e-4 * 2.736 * 100.0))
    assert pushed.force == pytest.approx((0.5e-4 * 2.736 * 100.0, 0.0, 0.0))
    assert not pushed.none


def test_a_force_across_the_symmetry_plane_is_refused(tmp_path: Path, poro: Poro) -> None:
    Path("x.yaml").write_text("domain: {core_cells: 2, rings: 1, layers: 3}\nload: {force_ratio: [0, 1.0e-4, 0]}\n")
    ended = poro("optimize", "x.yaml", "--threads", "1", "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert "load.force_ratio: half an actuator takes no force along X2" in ended.err


def test_a_part_is_not_inflated_without_its_force() -> None:
    case = parse_case(b"load: {force_ratio: [0.0, 0.0, -1.0e-4]}", "x.yaml", "x")
    with pytest.raises(InvalidSettings, match=r"load\.force_ratio is not inflated"):
        refuse_unlike(case.optimize)


def test_any_load_case_is_followed_from_zero_pressure(tmp_path: Path, poro: Poro) -> None:
    Path("two.yaml").write_text(CASE + "simulate: {max_load: 1.0, states: [1.0]}\n")
    assert poro("optimize", "two.yaml", "--threads", "1", "--output", ".").code == ExitCode.OK
    cases = contents.summary(Path("two/two.h5"), "optimize")["load_cases"]
    for options, name in (((), "free"), (("--load-case", "stiff"), "stiff")):
        ended = poro("simulate", "two.yaml", *options, "--threads", "1", "--output", ".", "--json")
        assert ended.code == ExitCode.OK, ended.err
        found = json.loads(ended.out)["simulate"]
        assert found["reached"]
        assert found["at_target"]["theta2"] == pytest.approx(cases[name]["theta2"], rel=1e-6)
    ended = poro("simulate", "two.yaml", "--load-case", "stif", "--threads", "1", "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert "there is no load case 'stif'; there are free, stiff" in ended.err


def test_load_cases_are_set_on_the_command_line(tmp_path: Path, poro: Poro) -> None:
    """A key that is not recorded while it is empty may be there on either side of a change."""
    Path("one.yaml").write_text(CASE[: CASE.index("  cases:")] + "optimizer: {max_updates: 0}\n")
    Path("two.yaml").write_text(CASE.replace("max_updates: 2", "max_updates: 0"))
    for name, other in (("one", "load.cases=[{name: a}, {name: b}]"), ("two", "load.cases=[]")):
        ended = poro("optimize", f"{name}.yaml", "--set", other, "--threads", "1", "--output", ".")
        assert ended.code == ExitCode.OK, ended.err
        assert ("load_cases" in contents.summary(Path(f"{name}/{name}.h5"), "optimize")) == (name == "one")
        assert poro("status", f"{name}.yaml", "--output", ".").code == ExitCode.OK
        assert "up to date" in poro("optimize", f"{name}.yaml", "--set", other, "--threads", "1", "--output", ".").err


def test_cases_of_the_page_are_cases() -> None:
    page = (Path(__file__).parents[3] / "docs/use/loads.md").read_text()
    found = re.findall(r"^```yaml\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    assert [len(parse_case(text.encode(), "page", "page").load_cases()) for text in found] == [3, 2]

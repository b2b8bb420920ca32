"""The study file: the cases it makes, and how mistakes in it are reported."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command_line import TINY, Poro

from pipeline.case.model import read_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.study.study import Study, read_study

DOCS = Path(__file__).parents[3] / "docs" / "use" / "sweeps.md"


def study(folder: Path, text: str) -> Study:
    """A study of the tiny case."""
    (folder / "tiny.yaml").write_text(TINY)
    (folder / "study.yaml").write_text(text)
    return read_study(folder / "study.yaml")


def test_grid_makes_every_combination_with_readable_names(tmp_path: Path) -> None:
    found = study(
        tmp_path,
        "case: tiny.yaml\nvary:\n  load.pressure_ratio: [0.01, 0.02]\n"
        "  objective.strain_limit: {from: 0.1, to: 0.14, steps: 3}\n",
    )
    assert [variant.case.name for variant in found.variants] == [
        f"tiny.pressure_ratio-{p}.strain_limit-{e}" for p in (0.01, 0.02) for e in (0.1, 0.12, 0.14)
    ]
    assert [variant.case.load.pressure_ratio for variant in found.variants] == 3 * [0.01] + 3 * [0.02]
    assert [variant.case.objective.strain_limit for variant in found.variants] == 2 * [0.1, 0.12, 0.14]
    assert {variant.case.domain.layers for variant in found.variants} == {3}
    assert (found.until, found.grid) == ("export", True)


def test_zip_takes_the_values_side_by_side(tmp_path: Path) -> None:
    found = study(
        tmp_path,
        "case: tiny.yaml\ncombine: zip\nuntil: optimize\nvary:\n  domain.layers: {from: 3, to: 9, steps: 3}\n"
        "  objective.leak_weight: {from: 1.0, to: 1.0e+4, steps: 3, scale: log}\n",
    )
    values = [(variant.case.domain.layers, variant.case.objective.leak_weight) for variant in found.variants]
    assert values == [(3, 1.0), (6, 100.0), (9, 10000.0)]
    assert found.logarithmic == {"objective.leak_weight"}


def test_names_stay_apart_and_short(tmp_path: Path) -> None:
    same = study(
        tmp_path, "case: tiny.yaml\nvary: {domain.radius: [15.0], refine.factor: [1], rig.spring_width: [1.0]}\n"
    )
    assert same.variants[0].case.name == "tiny.radius-15.0.factor-1.spring_width-1.0"
    both = study(tmp_path, "case: tiny.yaml\nvary: {material.youngs_modulus: [2.0], rig.youngs_modulus: [1.0e+6]}\n")
    assert both.variants[0].case.name == "tiny.material.youngs_modulus-2.0.rig.youngs_modulus-1.0e6"
    keys = ("void_permeability_rate", "permeability_contrast", "hessian_regularisation", "stiffness_contrast")
    many = ", ".join(f"material.{key}: [1.0e-3, 2.0e-3]" for key in keys)
    names = [variant.case.name for variant in study(tmp_path, f"case: tiny.yaml\nvary: {{{many}}}\n").variants]
    assert len(set(names)) == 16
    assert all(re.fullmatch(r"tiny\.[0-9a-f]{12}", name) for name in names)


def test_quantities_are_varied_with_what_they_depend_on(poro: Poro) -> None:
    """Names are file names; a pressure stays what it is in a stiffer material."""
    Path("tiny.yaml").write_text(f"{TINY}load: {{pressure: 27.36 kPa}}\n")
    Path("study.yaml").write_text("case: tiny.yaml\nvary:\n  load.pressure: [10 kPa, 0.2 bar]\n")
    found = read_study(Path("study.yaml")).variants
    assert [variant.case.name for variant in found] == ["tiny.pressure-10kPa", "tiny.pressure-0.2bar"]
    assert [variant.case.load.pressure_ratio for variant in found] == pytest.approx([0.01 / 2.736, 0.02 / 2.736])
    Path("study.yaml").write_text("case: tiny.yaml\nvary:\n  material.youngs_modulus: [2.736, 1368 kPa]\n")
    found = read_study(Path("study.yaml")).variants
    assert [variant.case.load.pressure_ratio for variant in found] == [0.01, 0.02]


def test_all_mistakes_are_reported_at_once_in_their_order(poro: Poro) -> None:
    Path("tiny.yaml").write_text(TINY)
    Path("bad.yaml").write_text(
        "case: tiny.yaml\n"
        "vary:\n"
        "  load.pressure_rate: [0.01]\n"
        "  domain.layers:\n"
        "    - 1.5\n"
        "    - 3\n"
        "    - -1\n"
        "  name: [a, b]\n"
        "  objective.strain_limit: {from: 0.1, to: 0.14, stps: 2}\n"
        "  mirror.threshold: {from: 0.0, to: 1.0, steps: 3, scale: log}\n"
        "  load: [1.0]\n"
        "  refine.factor: [1, 1]\n"
        "  compute.threads: [1, 2]\n"
        "  export.format: obj\n"
        "until: print\n"
        "combin: zip\n"
    )
    ended = poro("sweep", "bad.yaml")
    assert ended.code == ExitCode.USAGE
    lines = ended.err.removeprefix("poro: ").splitlines()
    expected = [
        (3, "vary.load.pressure_rate: unknown key; write 'pressure_ratio'"),
        (5, "vary.domain.layers: must be a whole number, not 1.5"),
        (7, "vary.domain.layers: must be at least 1, not -1"),
        (8, "vary.name: cannot be varied"),
        (9, "vary.objective.strain_limit.steps: must be a whole number from 2"),
        (9, "vary.objective.strain_limit.stps: unknown key of a range"),
        (10, "vary.mirror.threshold: a range with scale log needs"),
        (11, "vary.load: must be a section of keys"),
        (12, "vary.refine.factor.1: 1 is there twice"),
        (13, "vary.compute.threads: cannot be varied"),
        (14, "vary.export.format: must be a list of values"),
        (15, "until: must be export or optimize or refine or finish or mirror or simulate or inflate, not 'print'"),
        (16, "combin: unknown key; write 'combine'"),
    ]
    assert len(lines) == len(expected)
    for line, (number, part) in zip(lines, expected, strict=True):
        assert line.startswith(f"bad.yaml:{number}: {part}"), line
        assert line.endswith(".")
    assert sorted(path.name for path in Path().iterdir()) == ["bad.yaml", "tiny.yaml"]


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("vary: {domain.layers: [3]}\n", r"study\.yaml:1: case: must be the path"),
        ("case: other.yaml\nvary: {domain.layers: [3]}\n", r"study\.yaml:1: case: there is no file .*other\.yaml"),
        ("case: wrong.yaml\nvary: {domain.layers: [3]}\n", r"wrong\.yaml:1: domain\.radiu: unknown key"),
        ("case: tiny.yaml\n", r"study\.yaml:1: vary: must be a section"),
        ("- a\n", r"study\.yaml:1: a study is made of"),
        ("case: tiny.yaml\nvary: {a: [1\n", r"study\.yaml:3: not valid YAML"),
        (
            "case: tiny.yaml\ncombine: zip\nvary: {domain.layers: [3, 4], refine.factor: [1]}\n",
            r"study\.yaml:3: vary: with combine: zip .*domain\.layers has 2, refine\.factor has 1",
        ),
        (
            "case: tiny.yaml\nvary:\n  mirror.threshold: {from: 0.0, to: 1.0, steps: 200}\n"
            "  load.pressure_ratio: {from: 0.01, to: 0.02, steps: 51}\n",
            r"study\.yaml:2: vary: makes 10200 cases, more than 10000",
        ),
    ],
)
def test_each_mistake_gives_a_sentence(text: str, part: str, tmp_path: Path) -> None:
    (tmp_path / "wrong.yaml").write_text("domain: {radiu: 1.0}\n")
    with pytest.raises(Fault, match=part) as caught:
        study(tmp_path, text)
    assert caught.value.code == ExitCode.USAGE
    assert str(caught.value).count("\n") == 0


def test_dry_run_writes_complete_case_files_and_says_which_would_run(poro: Poro, tmp_path: Path) -> None:
    made = study(tmp_path, "case: tiny.yaml\nvary: {mirror.threshold: [0.0, -0.1]}\n")
    ended = poro("sweep", "study.yaml", "--dry-run")
    assert ended.code == ExitCode.OK, ended.err
    files = [Path(line.split()[1]) for line in ended.out.splitlines()]
    assert [line.split()[0] for line in ended.out.splitlines()] == ["run", "run"]
    assert [read_case(file)[0] for file in files] == [variant.case for variant in made.variants]
    before = [file.stat().st_mtime_ns for file in files]
    poro("sweep", "study.yaml", "--dry-run")
    assert [file.stat().st_mtime_ns for file in files] == before
    assert "no such case" in poro("sweep", "study.yaml", "--only", "tiny").err


def test_studies_of_the_documentation_are_valid(tmp_path: Path) -> None:
    texts = re.findall(r"^```yaml\n(.*?)^```", DOCS.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert texts
    for text in texts:
        (tmp_path / "study.yaml").write_text(text)
        assert len(read_study(tmp_path / "study.yaml").variants) > 1


def test_workflow_comes_with_the_program(poro: Poro) -> None:
    ended = poro("sweep", "--workflow-path")
    assert ended.code == ExitCode.OK
    assert "rule case:" in Path(ended.out.strip()).read_text(encoding="utf-8")

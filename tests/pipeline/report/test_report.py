"""The report as a document: what stands in it, whatever there is of a case, and that nothing in a case can act."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import lxml.html
import numpy as np
import pytest
from command_line import TINY, Poro, edited
from lxml.html import HtmlElement
from synthetic import EXAMPLE, Truth, recording

from pipeline.figures import designs
from pipeline.figures.offscreen import CannotDraw
from pipeline.report import page as report
from pipeline.results.simulation import read_simulation
from pipeline.store import atomic
from stages import optimize

HOSTILE = """# </pre><script>window.hostile = 1</script><img src=x onerror="window.hostile = 1">
domain: {core_cells: 2, rings: 1, layers: 3}  # {{ 7 * 7 }} {% raw %} &amp; "quoted"
"""


@pytest.fixture
def written(poro: Poro, folder: Path, quickly: None) -> Callable[..., HtmlElement]:
    """Write the report of the finished run, without checks unless asked, and read it."""

    def write(*options: str, source: str = "tiny.h5") -> HtmlElement:
        ended = poro("report", folder / source, *(options or ["--no-check"]))
        assert ended.code == 0, ended.err
        return read(folder / "tiny/tiny.report.html")

    return write


def read(path: Path) -> HtmlElement:
    return lxml.html.document_fromstring(path.read_bytes())


def text_of(page: HtmlElement, identity: str) -> str:
    (found,) = page.xpath(f"//*[@id='{identity}']")
    return words_of(found)


def words_of(element: HtmlElement) -> str:
    return " ".join(" ".join(element.itertext()).split())


def section_of(page: HtmlElement, name: str) -> str:
    (found,) = page.xpath(f"//section[@aria-labelledby='{name}']")
    return words_of(found)


@pytest.mark.usefixtures("undrawn")
def test_pressure_and_travel_are_those_of_the_rigs_sheet(
    written: Callable[..., HtmlElement], folder: Path, poro: Poro
) -> None:
    """Of the part that was last exported for a print, beside those of the case."""
    assert "of the part" not in text_of(written(), "performance")
    exported = poro("export", "tiny.h5", "--scale", "1.5", "--youngs", "1 MPa", "--json")
    assert exported.code == 0, exported.err
    found = json.loads(exported.out)
    sheet = (folder / "tiny/tiny.scale-1.5.rig.md").read_text(encoding="utf-8")
    travel = f"{1.5 * abs(found['spring_elongation']):.2f} mm"
    assert "| pressure p_in | 20 kPa |" in sheet
    assert f"at p_in | {travel}," in sheet
    assert f"the case | 54.7 kPa, {abs(found['spring_elongation']):.2f} mm |" in sheet
    page = written()
    opening = text_of(page, "opening")
    assert "Under 54.7 kPa, in size and modulus of the case," in opening
    assert f"needs 20 kPa for the same angle, and moves the spring's end by {travel}." in opening
    (cell,) = page.xpath("//table[@id='performance']//tr[th[contains(., 'elongation')]]/td[3]/data/@value")
    assert float(cell) == pytest.approx(1.5 * found["spring_elongation"])
    assert "tiny.scale-1.5.stl" in section_of(page, "checks")
    assert "needs 40 kPa for" in text_of(written("--no-check", "--youngs", "2000 kPa", "--scale", "1.5"), "opening")


@pytest.fixture
def page(report: Path) -> HtmlElement:
    """The complete report."""
    return read(report)


# ------------------------------------------------------------------------------------------- the whole document


def test_file_needs_nothing_else_and_is_small(page: HtmlElement, report: Path) -> None:
    assert report.stat().st_size < 5_000_000
    addresses = [str(value) for value in page.xpath("//@src | //link/@href | //@srcset | //@data | //@poster")]
    assert len(addresses) == 7
    assert all(address.startswith("data:") for address in addresses)
    assert page.xpath("//iframe | //object | //embed | //form | //base | //meta[@http-equiv='refresh']") == []
    styles = "".join(page.xpath("//style/text()"))
    assert "url(" not in styles
    assert "@import" not in styles


def test_policy_names_just_what_the_page_holds(page: HtmlElement) -> None:
    (policy,) = page.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data:"
    scripts = page.xpath("//script[not(@type)]")
    for rule, elements in (("script-src", scripts), ("style-src", page.xpath("//style"))):
        hashes = [base64.b64encode(hashlib.sha256(each.text.encode()).digest()).decode() for each in elements]
        assert rules[rule].split() == [f"'sha256-{each}'" for each in hashes]
    # What a policy of hashes would not run.
    assert page.xpath("//@style | //@*[starts-with(name(), 'on')]") == []


def test_document_is_ordered_and_labelled(page: HtmlElement) -> None:
    assert page.get("lang") == "en"
    assert page.xpath("string(//title)").startswith("tiny")
    levels = [int(heading.tag[1]) for heading in page.xpath("//h1 | //h2 | //h3 | //h4")]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    identities = page.xpath("//@id")
    assert len(identities) == len(set(identities))
    assert {target[1:] for target in page.xpath("//a/@href") if target.startswith("#")} <= set(identities)
    assert all(len(image.get("alt")) > 20 for image in page.xpath("//img"))
    assert all(label.xpath(".//input") for label in page.xpath("//label"))
    for table in page.xpath("//table"):
        assert all(heading.get("scope") == "col" for heading in table.xpath("./thead//th"))
        assert all(row.xpath("count(./th[@scope='row'])") == 1 for row in table.xpath("./tbody/tr"))


def test_sections_are_there(page: HtmlElement) -> None:
    headings = [heading.text_content() for heading in page.xpath("//h2")]
    assert headings == [
        "Numbers", "The part in 3D", "Figures", "Part and checks", "Effort", "Stages", "Case", "What is missing",
    ]  # fmt: skip
    assert [each.get("id") for each in page.xpath("//figure")] == [
        f"figure-{kind}" for kind in ("initial", "views", "arm", "section", "history")
    ]
    assert "another mesh than the paper's: 48 cells" in text_of(page, "opening")
    assert "is read so: the shift of χ 4/L_i in mm as Eq. (14) prints it, c_r = 1e-06" in text_of(page, "opening")
    assert f"optimize given {optimize.VERSION}" in text_of(page, "stage-table")
    assert "export up to date" in text_of(page, "stage-table")
    assert "watertight pass" in text_of(page, "export-checks")
    assert "made for this report with the default settings" in text_of(page, "findings")
    assert len(page.xpath("//table[@id='findings']/tbody/tr")) == 11


def test_numbers_are_the_artifacts(page: HtmlElement, summary: dict[str, Any]) -> None:
    rows = page.xpath("//table[@id='performance']/tbody/tr")
    final = [row.xpath("./td[2]/data/@value")[0] for row in rows]
    assert final[0] == str(summary["terms"]["C0"])
    assert final[1] == str(summary["T3"])
    assert [final[4], final[5]] == [str(summary["T1"]), str(summary["C"])]
    assert rows[0].xpath("string(./td[3])") == "−0.255447"
    share = float(rows[0].xpath("string(./td[4])").split()[0])
    assert share == pytest.approx(100.0 * summary["terms"]["C0"] / -0.255447, abs=0.06)
    met = [row.xpath("./td[1]/data/@value")[0] for row in page.xpath("//table[@id='constraints']/tbody/tr")]
    keys = ("wall_leak", "wall_leak_second_order", "energy_ratio", "steepest", "passive_share")
    assert met == [str(summary[key]) for key in keys]


def test_model_is_the_part(page: HtmlElement, summary: dict[str, Any]) -> None:
    (text,) = page.xpath("//script[@id='model']/text()")
    model = json.loads(text)
    low, high = model["low"], model["high"]
    assert low[0] == pytest.approx(0.0, abs=1e-4)
    assert high[0] - low[0] >= 15.0 - 1e-3  # the length, and more where it moves
    assert len(base64.b64decode(model["rest"])) == len(base64.b64decode(model["moved"]))
    assert len(base64.b64decode(model["triangles"])) % 12 == 0


# --------------------------------------------------------------------------------------- whatever there is


def test_text_of_a_case_and_a_recorded_test_cannot_act(
    poro: Poro, written: Callable[..., HtmlElement], folder: Path
) -> None:
    recorded = EXAMPLE.read_text(encoding="utf-8")
    (folder / "measured.csv").write_text("# </dl><script>alert(1)</script>\n" + recorded, encoding="utf-8")
    assert poro("compare", folder / "tiny/tiny.h5", folder / "measured.csv", "--youngs", 1.0).code == 0
    with edited(folder / "tiny/tiny.h5") as file:
        del file["case_text"]
        file["case_text"] = HOSTILE
    page = written()
    assert page.xpath("//script") == []
    assert page.xpath("//img[@src='x'] | //@onerror") == []
    (shown,) = page.xpath("//pre[@id='case-text']")
    assert shown.text_content().strip() == HOSTILE.strip()
    assert "<script>alert(1)</script>" in section_of(page, "measured")


def test_run_alone_has_a_report_that_says_what_is_missing(poro: Poro, folder: Path, quickly: None) -> None:
    for path in folder.rglob("tiny.*"):
        if path.name not in ("tiny.h5", "tiny.yaml"):
            path.unlink()
    assert poro("report", "tiny.h5").code == 0
    page = read(folder / "tiny/tiny.report.html")
    missing = text_of(page, "missing-table")
    for command in ("poro export tiny/tiny.h5", "poro simulate tiny/tiny.h5", "poro compare tiny/tiny.h5 MEASURED.csv"):
        assert command in missing
    assert text_of(page, "stage-table").count("missing") == 5
    assert page.xpath("//table[@id='export-checks'] | //table[@id='findings']") == []


def test_stored_findings_are_taken_only_for_the_part_they_are_of(
    written: Callable[..., HtmlElement], folder: Path, poro: Poro
) -> None:
    poro("check", "tiny.stl", "--direction", "x")
    page = written()
    assert "from tiny.stl.check.json; build direction x" in text_of(page, "findings")
    stored = folder / "tiny/details/tiny.stl.check.json"
    stored.write_text(re.sub(r'"sha256": "\w+"', '"sha256": "of another part"', stored.read_text()))
    page = written()
    assert page.xpath("//table[@id='findings']") == []
    assert "poro check tiny/tiny.stl" in text_of(page, "missing-table").replace(f"{folder}/", "")


def test_stale_stages_are_named_with_the_reason(written: Callable[..., HtmlElement], folder: Path, poro: Poro) -> None:
    case = folder / "tiny.yaml"
    case.write_text(case.read_text() + "export: {scale: 2.0}\n")
    page = written("--no-check", "--output", str(folder), source="tiny.yaml")
    (alert,) = page.xpath("//div[@role='note']")
    assert "export: settings changed: export.scale 1.0 → 2.0" in alert.text_content()
    assert "export stale" in text_of(page, "stage-table")


def test_simulation_and_comparison_are_reported(
    poro: Poro, written: Callable[..., HtmlElement], folder: Path, simulation: Path
) -> None:
    shutil.copy(EXAMPLE, folder / "measured.csv")
    compared = poro("compare", folder / "tiny/tiny.h5", folder / "measured.csv", "--youngs", 1.0, "--json")
    found = json.loads(compared.out)
    page = written()
    simulated = section_of(page, "simulation")
    assert "path the optimised state is reached" in simulated
    elongation = read_simulation(simulation).summary["at_target"]["elongation"]
    assert f"travel of the arm's end at p_in {elongation:.3f} mm" in simulated
    measured = section_of(page, "measured")
    assert "SYNTHETIC, not measured" in measured
    assert f"deviation {found['target']['deviation_mm']:+.3f} mm" in measured
    assert f"hysteresis {found['hysteresis']['area']:.2f} %" in measured
    assert len(page.xpath("//figure[@id='figure-pressure'] | //figure[@id='figure-compare']")) == 2
    assert page.xpath("//table[@id='missing-table']//code")[0].text_content().startswith("poro check")


@pytest.mark.parametrize(
    ("truth", "whole", "words"),
    [
        (Truth(), True, ["3 cycles", "measured at 20 kPa 22.000 ± 0.000 mm", "% of the area under loading"]),
        (Truth(cycles=1), True, ["1 cycle ", "measured at 20 kPa 22.000 mm"]),
        (Truth(cycles=1), False, ["1 cycle ", "hysteresis not known without a whole unloading"]),
    ],
    ids=["three cycles", "one cycle", "no unloading"],
)
def test_what_a_recorded_test_does_not_tell_is_said_to_be_unknown(
    truth: Truth, whole: bool, words: list[str], poro: Poro, written: Callable[..., HtmlElement], folder: Path
) -> None:
    made = recording(truth)
    assert made.time is not None
    end = len(made.time) if whole else int(np.argmax(made.pressure))
    rows = zip(made.time.tolist()[:end], made.pressure.tolist(), made.displacement.tolist(), strict=False)
    lines = ["time [s],pressure [kPa],displacement [mm]", *(",".join(map(str, row)) for row in rows)]
    (folder / "measured.csv").write_text("\n".join(lines))
    ended = poro("compare", "tiny.h5", "measured.csv", "--youngs", 1.0)
    assert ended.code == 0, ended.err
    found = section_of(written(), "measured")
    for word in words:
        assert word in found
    ended = poro("compare", "tiny.h5", "measured.csv", "--youngs", 1.0, "--target", 15.0)
    assert "the prediction does not say" in ended.out
    found = section_of(written(), "measured")
    assert "predicted at 15 kPa the prediction does not say" in found
    assert "deviation not known" in found


def test_design_that_was_only_evaluated_is_reported(poro: Poro, tmp_path: Path, quickly: None) -> None:
    """Numbers that such a run does not know are not there."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    assert poro("optimize", "tiny.yaml", "--updates", 0, "--threads", 1).code == 0
    ended = poro("report", "tiny.yaml", "--no-check")
    assert ended.code == 0, ended.err
    assert "0 design updates and 1 evaluation were made" in text_of(read(tmp_path / "tiny/tiny.report.html"), "opening")


def test_comparison_of_another_version_is_refused(poro: Poro, folder: Path, quickly: None) -> None:
    (folder / "tiny/details/tiny.compare.json").write_text(json.dumps({"rms": 0.25}))
    ended = poro("report", folder / "tiny/tiny.h5", "--no-check")
    assert ended.code == 4
    assert "tiny.compare.json: this is not what `poro compare` of this version writes; run it again." in ended.err
    assert not (folder / "tiny/tiny.report.html").exists()


def test_simulation_is_drawn_in_the_report(folder: Path, simulation: Path) -> None:
    design = report.read_design(folder / "tiny/tiny.h5")
    format, data = designs.drawn(design, "pressure", "svg")
    assert (format, b"<path" in data) == ("svg", True)


def test_design_without_solid_is_reported(
    poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch, quickly: None
) -> None:
    from pipeline.report.view3d import displayed

    with edited(folder / "tiny/tiny.h5") as file:
        file["vertices/chi"][...] = -1.0
    (folder / "tiny/details/tiny.solid.h5").unlink()
    monkeypatch.setattr(report, "displayed", displayed)
    ended = poro("report", "tiny.h5", "--no-check")
    assert ended.code == 0, ended.err
    assert "3D view: Nothing is solid" in ended.out
    page = read(folder / "tiny/tiny.report.html")
    assert "Nothing is solid" in page.xpath("string(//div[@role='note'])")
    assert page.xpath("//script") == []


def test_what_cannot_be_drawn_is_said_in_the_report(poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def ended_badly(*_: object) -> None:
        raise CannotDraw("no facet of the mesh lies in the plane X2 = 0")

    section = replace(designs.FIGURES["section"], draw=ended_badly)
    monkeypatch.setattr(designs, "figures_of", lambda design: {"section": section})
    monkeypatch.setattr(designs, "FIGURES", {"section": section})
    monkeypatch.setattr(report, "displayed", lambda design: None)
    ended = poro("report", "tiny.h5", "--no-check")
    assert ended.code == 0, ended.err
    assert "Section: no facet" in ended.out
    assert "no facet" in section_of(read(folder / "tiny/tiny.report.html"), "figures")


# ------------------------------------------------------------------------------------------------ what goes wrong


def test_report_is_whole_or_not_there(
    written: Callable[..., HtmlElement], folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    written()
    before = (folder / "tiny/tiny.report.html").read_bytes()

    def full(path: Path) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(atomic, "_synchronise", full)
    ended = poro("report", "tiny.h5", "--no-check")
    assert ended.code == 1
    assert "No space left" in ended.err
    assert (folder / "tiny/tiny.report.html").read_bytes() == before
    assert list(folder.glob(".*.tmp")) == []


@pytest.mark.parametrize(
    ("file", "spoil", "words"),
    [
        ("tiny/tiny.h5", None, "there is no such file; run the stage that makes it"),
        ("tiny/tiny.h5", b"text", "this is no HDF5 file"),
        ("tiny/details/tiny.solid.h5", b"text", "this is no HDF5 file"),
        ("tiny/details/tiny.compare.json", b"[1, 2", "cannot be read"),
        ("tiny/details/tiny.compare.json", b"[1, 2]", "holds no report of poro"),
    ],
)
def test_bad_files_have_a_sentence(
    file: str, spoil: bytes | None, words: str, poro: Poro, folder: Path, quickly: None
) -> None:
    if spoil is None:
        (folder / file).unlink()
    else:
        (folder / file).write_bytes(spoil)
    ended = poro("report", "tiny.yaml", "--output", ".", "--no-check")
    assert ended.code == 4
    assert f"{file}: {words}" in ended.err
    assert not (folder / "tiny/tiny.report.html").exists()


def test_report_goes_where_it_is_wanted(poro: Poro, folder: Path, quickly: None) -> None:
    assert poro("report", "tiny.h5", "--no-check", "--output", "elsewhere").out == "elsewhere/tiny.report.html\n"
    # What belongs to the artifact lies beside it, not where the report goes.
    assert "export up to date" in text_of(read(folder / "elsewhere/tiny.report.html"), "stage-table")

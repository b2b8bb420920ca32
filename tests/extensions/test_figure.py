"""A figure from outside the product: registered in one place, it is drawn by ``poro plot`` and stands in the report."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import lxml.html
import numpy as np
import pytest
from command_line import Poro
from matplotlib.figure import Figure
from PIL import Image
from scipy.special import expit

from poro import OptimisedDesign, figures

BINS = 10


def histogram(design: OptimisedDesign) -> Figure:
    figure = Figure(figsize=(4.0, 3.0), dpi=100)
    axes = figure.subplots()
    axes.hist(expit(design.chi), bins=BINS)
    axes.set(xlabel="density ρ", ylabel="vertices")
    return figure


def counts(design: OptimisedDesign) -> str:
    numbers, _ = np.histogram(expit(design.chi), bins=BINS)
    return "".join(f"{number}\n" for number in numbers)


@pytest.fixture
def registered() -> Iterator[None]:
    entry = figures.DesignFigure(histogram, "Histogram", "How many vertices have which density.", "png", counts)
    with figures.FIGURES.registered("histogram", entry):
        yield


@pytest.mark.usefixtures("registered")
def test_plot_draws_it_with_its_table(poro: Poro, folder: Path) -> None:
    ended = poro("plot", "tiny.h5", "--only", "histogram")
    assert ended.code == 0, ended.err
    assert ended.out.split() == ["tiny/details/tiny.histogram.csv", "tiny/details/tiny.histogram.png"]
    with Image.open(folder / "tiny/details/tiny.histogram.png") as drawn:
        assert drawn.size == (400, 300)
        assert len(np.unique(np.asarray(drawn.convert("L")))) > 5
    assert len((folder / "tiny/details/tiny.histogram.csv").read_text().split()) == BINS


@pytest.mark.usefixtures("registered")
def test_report_shows_it_after_the_others(poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.report.page.displayed", lambda design: None)
    assert poro("report", "tiny.h5", "--no-check").code == 0
    page = lxml.html.document_fromstring((folder / "tiny/tiny.report.html").read_bytes())
    (figure,) = page.xpath("//figure[@id='figure-histogram']")
    assert figure.xpath(".//img/@src")[0].startswith("data:image/png;base64,")
    assert figure.xpath("string(./figcaption)") == "How many vertices have which density."
    assert page.xpath("//figure/@id")[-1] == "figure-histogram"
    assert "Histogram" in page.xpath("//h3/text()")


def test_without_it_the_name_is_unknown(poro: Poro, folder: Path) -> None:
    ended = poro("plot", folder / "tiny/tiny.h5", "--only", "histogram")
    assert ended.code == 2
    assert "--only histogram: there is no such figure" in ended.err

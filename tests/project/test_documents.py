"""The pages of docs/: their commands run as they stand, on a tiny case, and their links lead somewhere."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from command_line import COARSE, TINY, TO_PART, Poro
from documents import PAGES, ROOT, anchors, blocks, commands, follow, links
from synthetic import EXAMPLE

from pipeline.cli.app import call

#: Pages whose commands take long, even on the tiny case: they draw, or follow the response to pressure.
SLOW = ("films", "measuring", "regions", "report", "simulation", "sweeps", "tutorial")

#: Cases that a page shows in full, with the name of their file in the first line.
NAMED = re.compile(r"^```yaml\n# (\S+\.yaml)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)

#: Pages whose commands are run by tests of their own: test_readme.py, test_reference.py.
ELSEWHERE_RUN = ("README.md", "artifacts.md")

#: What is not for a test to run.
ELSEWHERE = re.compile(r"(^|/|&& )(pip|make|npm|npx|apt|paraview|snakemake)\b|python -m benchmarks\.")

#: The response to pressure, and what moves the surface, in as few steps as will do.
SHORT = TINY + COARSE + "simulate: {max_load: 1.0, states: [1.0]}\nfinish: {steps: 1, size: 4.0}\n"

WITH_COMMANDS = [
    pytest.param(page, id=page.stem, marks=pytest.mark.slow if page.stem in SLOW else ())
    for page in PAGES
    if page.name not in ELSEWHERE_RUN and commands(page)
]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """What the commands of the pages expect in the working folder: the checkout's own files, in small."""
    (tmp_path / "configs").mkdir()
    for name in ("quick", "case14", "case11"):
        (tmp_path / "configs" / f"{name}.yaml").write_text(TINY)
        (tmp_path / f"{name}.yaml").write_text(SHORT)
    (tmp_path / "docs" / "examples").mkdir(parents=True)
    shutil.copy(EXAMPLE, tmp_path / "docs" / "examples")
    (tmp_path / "data.csv").write_text(
        "strain,stress [MPa]\n0.0,0.0\n0.1,0.09\n0.2,0.17\n0.4,0.30\n0.8,0.52\n1.2,0.70\n"
    )
    study = re.search(
        r"^```yaml\n(.*?)^```", (ROOT / "docs" / "use" / "sweeps.md").read_text(), flags=re.MULTILINE | re.DOTALL
    )
    assert study
    (tmp_path / "study.yaml").write_text(study[1])
    for name, case in NAMED.findall((ROOT / "docs" / "use" / "regions.md").read_text(encoding="utf-8")):
        (tmp_path / name).write_text(case, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the tiny case has run to the end under the name of the shipped one."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "case14.yaml").write_text(SHORT)
    assert call(["run", str(folder / "case14.yaml"), *TO_PART, "--output", str(folder), "--threads", "1"]) == 0
    return folder


@pytest.fixture
def worked(checkout: Path, results: Path) -> Path:
    """The same after that run, with its results in all places where the pages have them, and a part."""
    for folder in (checkout, checkout / "outputs", checkout / "results"):
        shutil.copytree(results, folder, dirs_exist_ok=True)
    shutil.copy(checkout / "case14/case14.stl", checkout / "part.stl")
    shutil.copy(EXAMPLE, checkout / "measured.csv")
    return checkout


@pytest.mark.parametrize("page", WITH_COMMANDS)
def test_commands_run_as_they_stand(page: Path, worked: Path, poro: Poro, request: pytest.FixtureRequest) -> None:
    """In order and in one folder."""
    if page.stem not in SLOW:  # what these draw is looked at in tests of its own
        for fixture in ("undrawn", "quickly"):
            request.getfixturevalue(fixture)
    assert follow(page, poro, worked) > 0


def test_all_pages_with_commands_are_followed() -> None:
    """And a block that is not says why."""
    followed = {param.id for param in WITH_COMMANDS}
    assert {"howto", "layers", "measuring", "report", "simulation", "sweeps", "tutorial"} <= followed
    for page in PAGES:
        for block in blocks(page):
            assert block.lines, page.name
            assert (block.reason is not None) == any(map(ELSEWHERE.search, block.lines)), (
                f"{page.name}: {block.lines[0]}"
            )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    for link in links(page):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.exists(), f"{page.name}: {link} is not there"
        if anchor:
            assert anchor in anchors(target), f"{page.name}: {link} is no heading"


def test_index_has_every_page() -> None:
    index = ROOT / "docs" / "index.md"
    listed = {link.partition("#")[0] for link in links(index)}
    pages = {str(page.relative_to(index.parent)) for page in (ROOT / "docs").glob("**/*.md")} - {"index.md"}
    # The notebook has a map of its own.
    assert {page for page in pages if not page.startswith("project/notebook/")} <= listed


def test_readme_names_the_documents() -> None:
    assert {"docs/start/tutorial.md", "docs/use/howto.md", "docs/explain/theory.md", "docs/index.md"} <= set(
        links(ROOT / "README.md")
    )


#: What has been frozen names files of its day.
FROZEN = ROOT / "docs" / "project" / "notebook"


@pytest.mark.parametrize("page", [page for page in PAGES if FROZEN not in page.parents], ids=lambda page: page.stem)
def test_files_of_the_program_that_are_named_exist(page: Path) -> None:
    """Such as `actuator/threads.py` or `stages/`, so that a page does not lead to a room that has moved."""
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"`((?:actuator|stages|pipeline|tests|benchmarks|configs|docs)/[\w./-]*)`", text)
    assert [name for name in named if "NAME" not in name and not (ROOT / name).exists()] == []

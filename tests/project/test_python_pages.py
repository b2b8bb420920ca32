"""The Python that the pages show runs as it stands: the blocks of a page in order, in one process, on a tiny case."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import TINY
from documents import PAGES, ROOT

BLOCK = re.compile(r"^```python\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)

#: Pages that show the door; other Python of the pages reads files without it.
WITH_PYTHON = [page for page in PAGES if "import poro" in "".join(BLOCK.findall(page.read_text("utf-8")))]


@pytest.fixture
def worked(tmp_path: Path, finished: Path) -> Path:
    """A folder with tiny cases of the names of shipped ones, and the results of one of them."""
    for name in ("quick", "case14"):
        (tmp_path / f"{name}.yaml").write_text(TINY)
    (tmp_path / "outputs").mkdir()
    for path in (finished / "tiny").rglob("tiny.*"):
        place = path.relative_to(finished)
        target = tmp_path / "outputs" / str(place).replace("tiny", "case14")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    return tmp_path


@pytest.mark.parametrize("page", WITH_PYTHON, ids=lambda page: page.stem)
def test_python_runs_as_it_stands(page: Path, worked: Path) -> None:
    code = "\n".join(BLOCK.findall(page.read_text("utf-8")))
    ended = subprocess.run(
        [sys.executable, "-P", "-W", "error", "-c", code], cwd=worked, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, f"{page.name}\n{ended.stderr}"
    assert "C0" in ended.stdout
    assert (worked / "part.stl").stat().st_size > 1000
    assert (worked / "section.png").stat().st_size > 1000


def test_the_page_of_the_door_is_among_them() -> None:
    """And it names every function and figure."""
    import poro
    from poro import figures

    page = ROOT / "docs" / "use" / "python.md"
    assert page in WITH_PYTHON
    text = page.read_text("utf-8")
    named = set(re.findall(r"poro\.(\w+)", text))
    assert set(poro.__all__) - named <= {"Case", "FinishStep", "LoadStep", "Message", "__version__"}
    assert all(re.search(rf"\b{name}\b", text) for name in figures.__all__)

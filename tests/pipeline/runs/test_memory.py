"""Too little memory: refused up front where it can be foreseen, a sentence and nothing lost where it cannot."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from command_line import TINY, TO_PART, Poro, environment

import stages.optimize
from pipeline.exit_codes import ExitCode

#: Runs the program with no memory left for the factorisation of matrices above a size.
SHORT = """
import resource, sys
from actuator.linear import pardiso, superlu
from pipeline.cli.app import call

def short(cls, factorise):
    def limited(self, data):
        if self.size < 2000:
            return factorise(self, data)
        size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + 2**20, resource.RLIM_INFINITY))
        try:
            return factorise(self, data)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    cls._factorise = limited

for cls in (pardiso.PardisoSolver, superlu.SuperLUSolver):
    short(cls, cls._factorise)
sys.exit(call(sys.argv[1:]))
"""

#: 384 cells, 5,500 unknowns: factors of several MiB.
MIDDLE = "domain: {core_cells: 4, rings: 2, layers: 6}\ncompute: {linear_solver: %s, threads: 1}\n"


@pytest.mark.skipif(sys.platform != "linux", reason="reads the size of the process from /proc")
@pytest.mark.parametrize("solver", ["auto", "superlu"])
def test_memory_that_ends_in_the_factorisation_loses_nothing(solver: str, poro: Poro) -> None:
    Path("middle.yaml").write_text(MIDDLE % solver)
    first = poro("optimize", "middle.yaml", "--updates", 0)
    assert first.code == ExitCode.OK, first.err
    before = Path("middle/middle.h5").read_bytes()
    ended = subprocess.run(
        [sys.executable, "-c", SHORT, "optimize", "middle.yaml", "--updates", "1"],
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == ExitCode.UNEXPECTED, ended.stderr
    last = ended.stderr.splitlines()[-1]
    assert last.startswith("poro: ")
    assert "memory" in last
    assert "coarser mesh" in last
    assert "Traceback" not in ended.stderr
    assert Path("middle/middle.h5").read_bytes() == before
    longer = poro("optimize", "middle.yaml", "--updates", 1)
    assert longer.code == ExitCode.OK
    assert "Continuing after design update 0." in longer.err


@pytest.mark.parametrize(
    ("text", "sizes"),
    [
        ("domain: {core_cells: 200, rings: 200, layers: 1000}\n", ["240,000,000 cells", "domain.core_cells"]),
        ("domain: {core_cells: 60, rings: 60, layers: 100}\n", ["2,160,000 cells", "domain.core_cells"]),
    ],
)
def test_absurd_mesh_is_refused_up_front_with_the_estimate(text: str, sizes: list[str], poro: Poro) -> None:
    Path("case.yaml").write_text(text)
    before = psutil.Process().memory_info().rss
    ended = poro("run", "case.yaml")
    assert ended.code == ExitCode.USAGE
    assert ended.err.count("\n") == 1
    assert ended.err.startswith("poro: case.yaml: 'optimize' on ")
    assert " GiB of memory and this machine has " in ended.err
    assert all(part in ended.err for part in sizes)
    assert list(Path().iterdir()) == [Path("case.yaml")]
    assert psutil.Process().memory_info().rss - before < 2**28
    assert poro("status", "case.yaml").code == ExitCode.OK


def test_absurd_refinement_is_refused_before_anything_runs(
    folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "tiny.yaml").write_text(TINY + "refine: {factor: 8}\n")
    little = psutil.virtual_memory()._replace(total=2**26)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: little)
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert "'refine' on 24,576 cells needs at least 0.21 GiB" in ended.err
    assert "lower refine.factor" in ended.err


def test_terabyte_is_what_the_estimate_says_of_a_million_cells() -> None:
    """Against benchmarks/results/scaling.md, and far beyond it."""
    for cells, measured in ((1080, 0.5645), (2912, 0.6871), (9504, 2.052), (29950, 6.988)):
        assert stages.optimize.least_memory(cells) / 2**30 == pytest.approx(measured, rel=0.25)
    assert stages.optimize.least_memory(1_700_000) > 2**40

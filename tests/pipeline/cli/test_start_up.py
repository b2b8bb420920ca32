"""Commands that compute nothing load nothing that computes: importing all of it takes seconds.

Times depend on the machine, so what is looked at is the interpreter's own list of what it imported.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import TINY

NUMERICS = {"numba", "scipy", "skfem", "trimesh", "manifold3d", "networkx", "pint"}
PICTURES = {"pyvista", "vtkmodules", "matplotlib", "PIL"}
FILES = {"h5py", "meshio"}
HEAVY = NUMERICS | PICTURES | FILES


#: What of the stages and the science the table of stages is made of.
TABLE = {"actuator", "actuator.failure", "actuator.registry", "stages", "stages.chain", "stages.formats"}
#: Words that options take.
WORDS = {
    "stages.words",
    *(f"actuator.{name}" for name in ("geometry", "geometry.printing", "geometry.printing.directions")),
}


def packages_of(folder: Path, *arguments: str) -> set[str]:
    """Packages that a command line imports; see :func:`modules_of`."""
    return {module.partition(".")[0] for module in modules_of(folder, *arguments)}


def modules_of(folder: Path, *arguments: str) -> set[str]:
    """Modules that a command line imports, in a process of its own, with ``folder`` as the working folder."""
    path = os.pathsep.join(entry for entry in sys.path if entry)
    ended = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "poro", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr[-2000:]
    assert ended.stdout
    return {line.rpartition("|")[2].strip() for line in ended.stderr.splitlines() if line.startswith("import time:")}


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"]])
def test_help_loads_neither_settings_nor_numerics(arguments: list[str], tmp_path: Path) -> None:
    modules = modules_of(tmp_path, *arguments)
    packages = {module.partition(".")[0] for module in modules}
    assert "typer" in packages
    assert not packages & (HEAVY | {"numpy", "yaml"})
    assert {module for module in modules if module.startswith(("actuator", "stages"))} == TABLE | WORDS


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "tiny.yaml", "--dry-run"],
        ["run", "tiny.yaml", "--dry-run", "--explain"],
        ["status", "tiny.yaml"],
        ["sweep", "study.yaml", "--dry-run"],
        ["new", "mine"],
    ],
)
def test_planning_loads_the_settings_but_not_the_numerics(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "tiny.yaml").write_text(TINY)
    (tmp_path / "study.yaml").write_text("case: tiny.yaml\nvary: {mirror.threshold: [0.0, 0.1]}\n")
    found = packages_of(tmp_path, *arguments)
    assert {"pydantic", "stages"} <= found
    assert not found & HEAVY


def test_schema_loads_no_numerics(tmp_path: Path) -> None:
    found = packages_of(tmp_path, "schema")
    assert {"pydantic", "stages"} <= found
    assert not found & HEAVY


def test_status_of_a_finished_case_loads_only_what_reads_artifacts(folder: Path) -> None:
    assert packages_of(folder, "status", "tiny.yaml", "--output", ".") & HEAVY == {"h5py"}


def test_parameters_of_a_case_load_no_compiler() -> None:
    """The report, the rig and the figures take the load from them."""
    code = (
        "import sys; from stages.settings import MaterialSettings, ProblemSettings\n"
        "ProblemSettings(material=MaterialSettings(law={'name': 'yeoh', 'c2': 0.1, 'c3': 0.1})).parameters()\n"
        "print('numba' in sys.modules)"
    )
    path = os.pathsep.join(entry for entry in sys.path if entry)
    environment = os.environ | {"PYTHONPATH": path}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert ended.stdout == "False\n"


def test_kernels_are_kept_elsewhere_if_the_package_cannot_be_written(tmp_path: Path) -> None:
    """Installed by an administrator: numba would refuse to compile without a folder for its cache."""
    code = (
        "import os; os.environ.pop('NUMBA_CACHE_DIR', None); os.access = lambda path, mode: False\n"
        "import actuator; print(actuator.__file__); print(os.environ['NUMBA_CACHE_DIR'])"
    )
    path = os.pathsep.join(entry for entry in sys.path if entry)
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": path}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    package, cache = map(Path, ended.stdout.splitlines())
    assert package.parent not in cache.parents
    if sys.platform == "linux":
        assert tmp_path in cache.parents

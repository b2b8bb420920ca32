"""What the stages and the program around them skip: filters, halves, stages that are up to date, imports, output."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.geometry.hausdorff import distance_to_zero_set
from actuator.geometry.tetrahedra import outer_triangles, tetrahedra
from actuator.geometry.zero_set import Surface, reflected, solid_boundary
from actuator.solve.reduced import ReducedObjective
from benchmarks.skip_rows import Skip, count_skip, time_skip
from benchmarks.small_cases import QUICK, TINY, first_design, problem, reduced_objective
from benchmarks.whole_cylinder import WholeCylinder
from pipeline.exit_codes import ExitCode
from stages import mirror, refine

REFINE, HALF, AGAIN, IMPORTS, OUTPUT = (
    "refinement 1 and r = 0",
    "symmetry",
    "stages up to date",
    "imports",
    "output nobody asked for",
)
#: So small a filter radius that it filters nothing, but that it is not zero.
HARDLY = 1e-12
#: Everything the program can import.
EVERYTHING = "import " + ", ".join(
    [
        *("stages.export", "stages.mirror", "stages.simulate", "stages.optimize", "actuator.optimiser.loop", "skfem"),
        *("pyvista", "matplotlib.pyplot", "trimesh", "manifold3d", "h5py", "meshio", "pipeline.report.page"),
    ]
)


def program_skips() -> Iterator[Skip]:
    """All rows of stages and program."""
    settings = problem(QUICK)
    domain = settings.domain.build()
    chi = first_design(domain)
    yield from _refine(domain, chi)
    yield from _halves(domain, chi)
    with tempfile.TemporaryDirectory() as folder:
        yield from _runs(Path(folder))


def _refine(domain: HalfCylinder, chi: Floats) -> Iterator[Skip]:
    same = refine.run(domain, chi, refine.Settings(factor=1, filter_radius=0.0))
    assert same.domain is domain
    assert same.chi is chi

    def filtered(factor: int, radius: float) -> Floats:
        return refine.run(domain, chi, refine.Settings(factor=factor, filter_radius=radius)).chi

    for factor, remark in ((1, "mesh and field are handed on as they are"), (2, "interpolated alone")):
        yield time_skip(
            REFINE,
            f"system of the Helmholtz filter at r = 0, factor {factor}",
            f"r = {HARDLY:g} mm",
            partial(filtered, factor, HARDLY),
            partial(filtered, factor, 0.0),
            remark=remark,
        )


def _halves(domain: HalfCylinder, chi: Floats) -> Iterator[Skip]:
    whole = WholeCylinder(domain.radius, domain.length, domain.core_cells, domain.rings, domain.layers)
    settings = problem(QUICK)
    material, load, limits = settings.parameters()
    both = replace(load, spring_stiffness=2.0 * load.spring_stiffness)  # that of the half is half the spring
    half_objective = reduced_objective(settings)
    whole_objective = ReducedObjective(whole, material, both, limits, threads=1)

    def state(objective: ReducedObjective, design: Floats) -> list[Floats]:
        at = objective.evaluate(design)
        objective.gradient(at)
        per_section = at.state.p.reshape(domain.layers + 1, -1)[:, : domain.section_points]
        return [at.state.arm, per_section.ravel()]

    yield time_skip(
        HALF,
        "other half of the cylinder: state from rest, adjoint and gradient",
        "the whole disc meshed",
        lambda: state(whole_objective, whole.extended(chi)),
        lambda: state(half_objective, chi),
        repeats=3,
        remark="T1, T3, θ2 and p; both states meet a tolerance of 1e-8",
    )
    equilibria = whole_objective.equilibrium, half_objective.equilibrium
    for unit, (needless, skipped) in {
        "unknowns": [e.kinematics.size + e.domain.mesh.nvertices for e in equilibria],
        "entries of factors": [e.mechanical_solver.statistics.factor_entries or 0 for e in equilibria],
    }.items():
        yield count_skip(HALF, "other half of the cylinder", "the whole disc meshed", unit, (needless, skipped))
    fine = refine.run(domain, chi, refine.Settings())
    tets = tetrahedra(fine.domain)
    outer = outer_triangles(fine.domain, tets)
    points = fine.domain.points
    beside = points[:, 1] != 0.0
    image = np.arange(len(points))
    image[beside] = len(points) + np.arange(np.count_nonzero(beside))
    whole_points = np.concatenate([points, points[beside] * (1.0, -1.0, 1.0)])
    whole_tets = np.concatenate([tets, image[tets[:, [0, 1, 3, 2]]]])
    whole_outer = np.concatenate([outer, image[outer[:, ::-1]]])
    whole_chi = np.concatenate([fine.chi, fine.chi[beside]])
    yield time_skip(
        HALF,
        "other half of the solid's surface, refined mesh",
        "extracted from the whole, not mirrored",
        lambda: _sorted(solid_boundary(whole_points, whole_tets, whole_outer, whole_chi)),
        lambda: _sorted(reflected(solid_boundary(points, tets, outer, fine.chi))),
        repeats=5,
        remark="vertices, sorted; sorting is part of both times",
    )

    def mirrored(*, measured: bool) -> Floats:
        if measured:
            return mirror.run(fine.domain, fine.chi, mirror.Settings()).vertices
        cells = tetrahedra(fine.domain)
        return reflected(solid_boundary(points, cells, outer_triangles(fine.domain, cells), fine.chi)).vertices

    yield time_skip(
        OUTPUT,
        "distance of the surface to the field, in the stage mirror",
        "with it, as it is",
        lambda: mirrored(measured=True),
        lambda: mirrored(measured=False),
        repeats=5,
        remark="not skipped: summary, report and `poro mirror` tell it; sampled on one half only",
    )
    assert distance_to_zero_set(fine.domain, tets, fine.chi, 0.0).maximum > 0.0


def _sorted(surface: Surface) -> Floats:
    """Vertices in an order that does not depend on their numbers."""
    return surface.vertices[np.lexsort(surface.vertices.T)]


def _runs(folder: Path) -> Iterator[Skip]:
    core, rings, layers = TINY
    case = folder / "tiny.yaml"
    case.write_text(
        f"domain: {{core_cells: {core}, rings: {rings}, layers: {layers}}}\noptimizer: {{max_updates: 1}}\n",
        encoding="utf-8",
    )
    everything = _modules(folder, "-c", EVERYTHING)
    for arguments in (("--help",), ("status", "tiny.yaml"), ("run", "tiny.yaml", "--dry-run")):
        name, command = f"`poro {' '.join(arguments)}`", ("-m", "poro", *arguments)
        counts = everything, _modules(folder, *command)
        yield count_skip(IMPORTS, f"modules of {name}", "all imported", "modules", counts)
        row = time_skip(
            IMPORTS,
            f"{name} as a process",
            "all imported",
            partial(_ended, folder, "-c", EVERYTHING),
            partial(_ended, folder, *command),
            repeats=3,
        )
        yield replace(row, difference=None)
    yield from _reruns(folder)


def _reruns(folder: Path) -> Iterator[Skip]:
    run = ("-m", "poro", "run", "tiny.yaml", "--threads", "1", "--output", ".")
    _python(folder, *run)
    first = _files(folder)

    def results() -> list[float]:
        return [float(entry == first[name]) for name, entry in _files(folder).items() if name in PARTS]

    def call(*arguments: str) -> list[float]:
        _python(folder, *run, *arguments)
        return results()

    yield time_skip(
        AGAIN,
        "`poro run` of a finished case of 48 cells",
        "--force",
        lambda: call("--force", "--fresh"),
        call,
        repeats=3,
        remark="the part's bytes; `--force` makes the same ones",
    )
    _python(folder, *run, "--fresh", "--force")
    made = set(_files(folder))
    for command in (("plot", "tiny.h5"), ("report", "tiny.h5"), ("export", "tiny.h5", "--youngs", "1.0")):
        _python(folder, "-m", "poro", *command)
    _python(folder, "-m", "poro", "check", "tiny.stl")
    asked = set(_files(folder))
    yield count_skip(
        OUTPUT,
        "figures, report, rig's sheet, check of the part",
        "asked for",
        "files",
        (len(asked), len(made)),
        remark="written by their own commands and options only",
    )

    def kept(every: int) -> float:
        text = (folder / "tiny.yaml").read_text(encoding="utf-8")
        name = f"keep{every}"
        longer = text.replace("max_updates: 1", f"max_updates: 4, keep_updates: {every}")
        (folder / f"{name}.yaml").write_text(longer, encoding="utf-8")
        arguments = ("optimize", f"{name}.yaml", "--threads", "1", "--output", ".", "--force", "--fresh", "--json")
        _python(folder, "-m", "poro", *arguments)
        return float((folder / f"{name}.h5").stat().st_size)

    yield count_skip(
        OUTPUT,
        "fields of the design updates, `keep_updates: 0`, in the artifact of 4 updates",
        "`keep_updates: 1`",
        "bytes",
        (kept(1), kept(0)),
        remark="kept by default, so that ParaView has time steps",
    )


#: What a run makes that is the same each time.
PARTS = ("tiny.stl",)


def _files(folder: Path) -> dict[str, str]:
    """Files of a folder with the hash of what they hold."""
    return {
        path.name: sha256(path.read_bytes()).hexdigest()
        for path in folder.iterdir()
        if path.is_file() and not path.name.startswith(".")
    }


def _python(folder: Path, *arguments: str) -> str:
    """What a Python process writes on standard error; it must end well."""
    root = Path(__file__).parent.parent
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(root), *filter(None, sys.path)])}
    ended = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if ended.returncode not in (ExitCode.OK, ExitCode.BAD_SOLID):  # of so coarse a mesh the part may fail its checks
        raise RuntimeError(ended.stderr[-2000:])
    return ended.stderr


def _ended(folder: Path, *arguments: str) -> float:
    """Run a Python process to its end."""
    _python(folder, *arguments)
    return 0.0


def _modules(folder: Path, *arguments: str) -> int:
    """How many modules a Python process imports."""
    return sum(line.startswith("import time:") for line in _python(folder, "-X", "importtime", *arguments).splitlines())

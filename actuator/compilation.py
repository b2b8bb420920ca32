"""Compiles the kernels in processes of their own, so that every run executes the same machine code.

What numba has compiled in the running process may differ in the last bit from the same kernel loaded from its cache,
and an optimisation amplifies the last bit: the first run after an installation would go elsewhere than all later ones.
Two processes share the work, as most machines have two cores; a third calls everything and compiles what is left.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module, metadata
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from actuator.arrays import Floats
from actuator.material.constants import kernel_constants
from actuator.material.laws import neo_hooke
from actuator.parameters import Law
from actuator.solve.state import State

if TYPE_CHECKING:
    from actuator.solve.reduced import ReducedObjective

#: What is told of the work: steps done, and all there are.
Told = Callable[[int, int], None]


def compile_kernels(law: Law = neo_hooke.EXAMPLE, told: Told | None = None) -> None:
    """Fill the cache of compiled kernels for a type of law unless that has been done; takes a minute once for each.

    The other processes import the law's file, from wherever this one has found it. Where they cannot, or cannot write
    to the cache, kernels are compiled as they are needed. If another program is compiling now, it is waited for.

    Args:
        law: parameters of the law, of the type that is meant.
        told: called as the work goes on.
    """
    stamp = _stamp(law)
    if stamp.exists():
        return
    import filelock  # only where something is compiled

    try:
        stamp.parent.mkdir(parents=True, exist_ok=True)
        with filelock.FileLock(stamp.with_name(f"{stamp.name}.lock")):
            if not stamp.exists():
                _compile(law, told)
    except OSError:  # no place for a cache
        return


def _compile(law: Law, told: Told | None) -> None:
    steps, total = count(1), sum(STEPS.values())

    def follow(share: str) -> None:
        # -P: a folder 'actuator' in the working folder is not this package.
        with subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, type(law).__module__, share],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        ) as process:
            assert process.stdout is not None
            for _ in process.stdout:
                if told is not None:
                    told(next(steps), total)

    *shares, rest = STEPS
    with ThreadPoolExecutor(len(shares)) as pool:
        list(pool.map(follow, shares))
    follow(rest)


def _stamp(law: Law) -> Path:
    version = f"{metadata.version('numba')}-{sys.implementation.cache_tag}-{kernel_constants(type(law)).__name__}"
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"compiled-{version}"


def _smallest(law: Law) -> ReducedObjective:
    from actuator.domains.half_cylinder import HalfCylinder
    from actuator.parameters import Load, Material, Objective
    from actuator.solve.reduced import ReducedObjective

    domain = HalfCylinder(radius=15.0, length=15.0, core_cells=2, rings=1, layers=3)
    # Any numbers do for which a design update succeeds; these are round ones of a soft silicone.
    material = Material(
        bulk=20.0,
        shear=1.0,
        ramp_penalty=3.0,
        stiffness_contrast=1e-6,
        void_permeability=1e5,
        solid_permeability=0.1,
        drainage=100.0,
        hessian_penalty=5e-3,
        law=law,
    )
    load = Load(pressure=0.05, arm_length=60.0, spring_stiffness=0.04)
    limits = Objective(1e-3, 1.0, 1e6, 1e6, 1e5, energy_limit=0.02, interface_width=3.0, diffusivity_length=15.0)
    return ReducedObjective(domain, material, load, limits, adjoint_tolerance=1e-8, threads=1)


def _objective(law: Law) -> Iterator[None]:
    """What gives values and gradients where a state is known."""
    import numpy as np

    objective = _smallest(law)
    chi, x = np.zeros(objective.domain.mesh.nvertices), np.zeros(objective.equilibrium.kinematics.size)
    _, _, nodal, _ = objective.equilibrium.residual(chi, x, chi)
    yield
    objective.derivatives(chi, x, chi, x, chi, nodal)
    yield
    objective.total.values(objective.design(chi), objective.fields(chi, x, chi))
    yield


def _tangent(law: Law) -> Iterator[None]:
    """What finds states and follows them."""
    import numpy as np

    from actuator.solve.sensitivity import Sensitivity

    objective = _smallest(law)
    chi, x = np.zeros(objective.domain.mesh.nvertices), np.zeros(objective.equilibrium.kinematics.size)
    objective.equilibrium.flow(chi, x)
    yield
    nodal = np.zeros((len(objective.domain.nodes), 3))
    Sensitivity(objective.equilibrium, State(chi, x, chi, nodal, nodal, x[-6:], residual=0.0, lowest_jacobian=1.0))
    yield


def _update(law: Law) -> Iterator[None]:
    """One design update, which calls every kernel with every type of number."""
    from actuator.optimiser.loop import Optimiser

    objective = _smallest(law)
    optimiser = Optimiser(objective, max_inner_steps=2)
    optimiser.run(optimiser.begin(_first(objective)), 1)
    _stamp(law).touch()
    yield


def _first(objective: ReducedObjective) -> Floats:
    limits = objective.objective
    return objective.domain.initial_design(objective.domain.points, limits.interface_width)


#: Shares of the work and how many steps each reports; the last one after all others.
STEPS = {"_objective": 3, "_tangent": 2, "_update": 1}


def _main(module: str = neo_hooke.__name__, share: str | None = None) -> None:
    law = import_module(module).EXAMPLE
    if share is None:
        compile_kernels(law)
    else:
        for _ in globals()[share](law):
            sys.stdout.write("done\n")
            sys.stdout.flush()


if __name__ == "__main__":
    _main(*sys.argv[1:])

"""Compiles the kernels in a process of their own, so that every run executes the same machine code.

What numba has compiled in the running process may differ in the last bit from the same kernel loaded from its cache,
and an optimisation amplifies the last bit: the first run after an installation would go elsewhere than all later ones.
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module, metadata
from pathlib import Path

from actuator.material.constants import kernel_constants
from actuator.material.laws import neo_hooke
from actuator.parameters import Law


def compile_kernels(law: Law = neo_hooke.EXAMPLE) -> None:
    """Fill the cache of compiled kernels for a type of law unless that has been done; takes a minute once for each.

    The other process imports the law's file, from wherever this one has found it. Where it cannot, or cannot write to
    the cache, kernels are compiled as they are needed.
    """
    if _stamp(law).exists():
        return
    # -P: a folder 'actuator' in the working folder is not this package.
    subprocess.run(
        [sys.executable, "-P", "-m", __name__, type(law).__module__],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
        check=False,
        capture_output=True,
    )


def _stamp(law: Law) -> Path:
    version = f"{metadata.version('numba')}-{sys.implementation.cache_tag}-{kernel_constants(type(law)).__name__}"
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"compiled-{version}"


def _use_everything(law: Law) -> None:
    """One design update of a smallest case calls every kernel with every type of number, for one law."""
    from actuator.domains.half_cylinder import HalfCylinder
    from actuator.optimiser.loop import Optimiser
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
    objective = ReducedObjective(domain, material, load, limits, adjoint_tolerance=1e-8, threads=1)
    optimiser = Optimiser(objective, max_products=2)
    optimiser.run(optimiser.begin(domain.initial_design(domain.points, limits.interface_width)), 1)
    _stamp(law).touch()


def _main(law: Law) -> None:
    """Compile, unless another process has done so; one that is at it now is waited for."""
    import filelock  # only where something is compiled

    stamp = _stamp(law)
    stamp.parent.mkdir(parents=True, exist_ok=True)
    with filelock.FileLock(stamp.with_name(f"{stamp.name}.lock")):
        if not stamp.exists():
            _use_everything(law)


if __name__ == "__main__":
    _main(import_module(sys.argv[1] if len(sys.argv) > 1 else neo_hooke.__name__).EXAMPLE)

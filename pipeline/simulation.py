"""A simulated response: the artifact ``NAME.simulation.h5``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import artifact, contents
from pipeline.case import stored_case


@dataclass(frozen=True)
class Simulation:
    """The response of a design while the pressure rises and falls.

    Attributes:
        name: of the case.
        pressure_in: p_in, N/mm².
        curves: by field, ``density`` or ``thresholded``; columns ``pressure`` [N/mm²], ``load_factor``, ``T1``, ``T3``
            [mm], ``theta2`` [rad], ``elongation`` [mm], ``energy_ratio``, ``leak``, ``loading`` (1 up, 0 down) and
            ``newton``, in order along the path.
        summary: of the stage.
    """

    name: str
    pressure_in: float
    curves: dict[str, dict[str, NDArray[np.float64]]]
    summary: dict[str, Any]


def read_simulation(path: Path) -> Simulation:
    """Read a simulated response.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    case = stored_case(artifact.read_header(path).case_resolved, path)
    summary = contents.summary(path, "simulate")
    curves = {name: artifact.read_group(path, "simulate", f"curves/{name}") for name in summary["fields"]}
    return Simulation(case.name, summary["pressure_in"], curves, summary)

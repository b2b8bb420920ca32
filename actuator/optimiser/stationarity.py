"""How far a design is from a stationary point, in a measure without units."""

from __future__ import annotations

from actuator.solve.reduced import Evaluation, Gradient
from actuator.terms.step import Metric


def stationarity(evaluation: Evaluation, gradient: Gradient, metric: Metric) -> float:
    """Largest relative change of the objective per unit change of the design: sqrt(|Ω| gᵀ M⁻¹ g) / Σ |C_k|.

    The unit is a step δ with δᵀ M δ = |Ω|: a uniform change of χ by one, or a rougher one that is as large in the
    norm of C_t (Eq. 15). As a dual norm it does not depend on the mesh as one of nodal values would; the sum of the
    terms' magnitudes makes it independent of units.
    """
    scale = sum(abs(value) for value in evaluation.terms.values())
    return float(metric.measure) ** 0.5 * metric.dual_norm(gradient.total) / (scale or 1.0)

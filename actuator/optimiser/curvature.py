"""A symmetric low-rank model of a Hessian that agrees with every pair (d, H d) it has been given."""

from __future__ import annotations

import numpy as np

from actuator.domain import Floats
from actuator.optimiser.metric import Metric


class Curvature:
    """Powell's symmetric update (PSB) in the metric of the design steps.

    Each new pair changes the model as little as possible in the norm that C_t defines, so that nothing is assumed
    about directions never looked at. Indefinite curvature is kept: the step term bounds the model.
    Powell 1970, doi:10.1016/B978-0-12-597050-1.50006-3.

    Args:
        metric: M of C_t.
        memory: most pairs kept; the oldest goes first.
    """

    def __init__(self, metric: Metric, memory: int = 60) -> None:
        self._metric, self._memory = metric, memory
        n = metric.size
        self._d, self._y = np.zeros((0, n)), np.zeros((0, n))
        self._rebuild()

    def learn(self, direction: Floats, product: Floats) -> None:
        """Make the model's product with ``direction`` equal ``product``; both (n,)."""
        if not np.any(direction):
            return
        self._d = np.vstack([self._d, direction])
        self._y = np.vstack([self._y, product])
        if len(self._d) > self._memory:
            self._d, self._y = self._d[1:], self._y[1:]
            self._rebuild()
        else:
            self._append(direction, product)

    def __matmul__(self, v: Floats) -> Floats:
        a, b = self._w @ v, self._r @ v
        return (a / self._s) @ self._r + (b / self._s - self._c * a / self._s**2) @ self._w

    def arrays(self) -> dict[str, Floats]:
        """The pairs, for a checkpoint."""
        return {"directions": self._d, "products": self._y}

    def restore(self, arrays: dict[str, Floats]) -> None:
        """Take up the pairs of :meth:`arrays`."""
        self._d, self._y = np.array(arrays["directions"]), np.array(arrays["products"])
        self._rebuild()

    def _rebuild(self) -> None:
        n = self._metric.size
        self._w, self._r = np.zeros((0, n)), np.zeros((0, n))
        self._s, self._c = np.zeros(0), np.zeros(0)
        for direction, product in zip(self._d, self._y, strict=True):
            self._append(direction, product)

    def _append(self, direction: Floats, product: Floats) -> None:
        w = self._metric @ direction
        missing = product - self @ direction
        self._w, self._r = np.vstack([self._w, w]), np.vstack([self._r, missing])
        self._s = np.append(self._s, direction @ w)
        self._c = np.append(self._c, missing @ direction)

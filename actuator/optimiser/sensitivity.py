"""A low-rank model of how the displacements answer to the design."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from actuator.domain import Floats


class Sensitivity:
    """Broyden's update (1965, doi:10.1090/S0025-5718-1965-0198670-6) of dx/dχ in the metric of the design steps.

    It agrees with the pair (d, dx) learnt last and changes as little as possible otherwise; a direction never looked
    at is taken to move nothing.

    Args:
        metric: M of C_t, (n, n).
        size: of x.
        memory: most pairs kept; the oldest goes first.
    """

    def __init__(self, metric: sp.csr_array, size: int, memory: int = 24) -> None:
        self._metric, self._memory = metric, memory
        self._d, self._dx = np.zeros((0, metric.shape[0])), np.zeros((0, size))
        self._rebuild()

    def learn(self, direction: Floats, dx: Floats) -> None:
        """Make the model's answer to ``direction`` (n,) equal ``dx`` (n_x,)."""
        if not np.any(direction):
            return
        self._d, self._dx = np.vstack([self._d, direction]), np.vstack([self._dx, dx])
        if len(self._d) > self._memory:
            self._d, self._dx = self._d[1:], self._dx[1:]
            self._rebuild()
        else:
            self._append(direction, dx)

    def __matmul__(self, direction: Floats) -> Floats:
        return (self._w @ direction) @ self._r

    def transposed(self, force: Floats) -> Floats:
        """Transpose of the model times a vector on x: (n,)."""
        return (self._r @ force) @ self._w

    def arrays(self) -> dict[str, Floats]:
        """The pairs, for a checkpoint."""
        return {"directions": self._d, "answers": self._dx}

    def restore(self, arrays: dict[str, Floats]) -> None:
        """Take up the pairs of :meth:`arrays`."""
        self._d, self._dx = np.array(arrays["directions"]), np.array(arrays["answers"])
        self._rebuild()

    def _rebuild(self) -> None:
        self._w, self._r = np.zeros((0, self._d.shape[1])), np.zeros((0, self._dx.shape[1]))
        for direction, dx in zip(self._d, self._dx, strict=True):
            self._append(direction, dx)

    def _append(self, direction: Floats, dx: Floats) -> None:
        w = self._metric @ direction
        missing = dx - self @ direction
        self._w = np.vstack([self._w, w / (direction @ w)])
        self._r = np.vstack([self._r, missing])

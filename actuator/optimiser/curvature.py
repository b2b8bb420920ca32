"""The curvature of the physics as gradients have shown it.

    B = f (σ N + diag(d)) + Σ y yᵀ / (sᵀ y) − Σ b bᵀ / (sᵀ b),   b = B_before s,

the limited-memory BFGS update (Nocedal & Wright 2006, ch. 7.2) of a multiple of a design norm's matrix N plus an
estimate d of the curvature at each vertex. The factor f is trust: the worse quadratics hold, the stiffer the directions
that nothing is known of. Without d, every subproblem runs into one more of the hundreds of directions
in which the leak and the strain limit are stiff. B is kept as a sparse matrix plus low rank with signs, so that it can
be added to another sparse matrix and inverted by Woodbury's formula.
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.optimiser.controls import CONTROLS, Controls
from actuator.terms.step import Metric


class Curvature:
    """Positive definite model B of the Hessian of all that depends on the state.

    Args:
        base: N.
        scale: σ.
        controls: the numbers that steer it.

    Attributes:
        scale: f σ.
        diagonal: f d, (n_vertices,).
        columns: (n_vertices, r) of the low-rank part.
        signs: ±1 for each of them, (r,).
    """

    def __init__(self, base: Metric, scale: float, controls: Controls = CONTROLS) -> None:
        self._base, self._first, self.scale, self._damping = base, scale, scale, controls.curvature_damping
        # The oldest pairs go first, several at a time, because B is then built up anew.
        self._memory, self._most = controls.curvature_memory, controls.curvature_memory * 4 // 3
        self.diagonal: Floats = np.zeros(base.size)
        self._pairs: list[tuple[Floats, Floats]] = []
        self._clear()

    def _clear(self) -> None:
        self._columns = np.empty((self._base.size, 2 * (self._most + 1)), order="F")
        self.signs: Floats = np.empty(0)

    @property
    def pairs(self) -> Floats:
        """All that is kept: directions and the changes of the gradient along them, (2, k, n_vertices)."""
        return np.array(self._pairs).reshape(-1, 2, self._base.size).transpose(1, 0, 2)

    def restore(self, pairs: Floats) -> None:
        """Forget all and take up stored :attr:`pairs`."""
        self._pairs = [(s, y) for s, y in zip(*pairs, strict=True)]
        self._rebuild()

    def rebase(self, diagonal: Floats, factor: float = 1.0) -> None:
        """Take up another d, (n_vertices,), not negative, and another f; the pairs stay."""
        self.scale, self.diagonal = factor * self._first, factor * diagonal
        self._rebuild()

    @property
    def columns(self) -> Floats:
        return self._columns[:, : len(self.signs)]

    def __matmul__(self, v: Floats) -> Floats:
        """B v."""
        columns = self.columns
        return self.scale * (self._base @ v) + self.diagonal * v + columns @ (self.signs * (columns.T @ v))

    def learn(self, s: Floats, y: Floats) -> None:
        """Take up a direction s and the change y of the gradient along it."""
        self._pairs.append((s, y))
        if len(self._pairs) > self._most:
            self._pairs = self._pairs[-self._memory :]
            self._rebuild()
        else:
            self._update(s, y)

    def _rebuild(self) -> None:
        self._clear()
        for s, y in self._pairs:
            self._update(s, y)

    def _update(self, s: Floats, y: Floats) -> None:
        b = self @ s
        known, seen = float(s @ b), float(s @ y)
        if seen < self._damping * known:
            share = (1.0 - self._damping) * known / (known - seen)
            y = share * y + (1.0 - share) * b
        rank = len(self.signs)
        self._columns[:, rank] = y / np.sqrt(float(s @ y))
        self._columns[:, rank + 1] = b / np.sqrt(known)
        self.signs = np.append(self.signs, (1.0, -1.0))

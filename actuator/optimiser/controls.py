"""The numbers that steer the optimiser, each once and by its role."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Controls:
    """Controls of the design updates, the inner problem and its subproblem.

    Numbers that name no publication were tuned on the small case and the paper's mesh: docs/project/notebook/fast.md,
    section "Controls", and the older pages that it names.

    "Agreement" is truth over promise of a step. Shares of a gain are of all that was gained so far in the same search.

    Attributes:
        sufficient_decrease: least agreement for a step to be taken (Nocedal & Wright 2006, ch. 4.1).
        poor_agreement, good_agreement: agreement below and above which trust falls and grows (the same). The first is
            also how far C_A and C_i may lie above their quadratic, over the linear decrease.
        backtracking: factor per trial of every search back along a step, on what a refused point may promise, and on
            Δt and reach where trust falls.
        trust_factor: on Δt where trust grows.
        least_time_step: share of the first Δt at which the optimisation gives up; its inverse bounds Δt from above.
        settled_updates: design updates over which ``optimizer.least_gain`` is measured.
        window: steps of the inner problem whose gain together decides whether it goes on.
        negligible_gain: share of the gain that is not worth going on for: of these steps; also the share by which
            displacements that drift may move the model.
        worthless_gain: share below which what a single step promises is worth nothing.
        shortest: least length of a search back along a step.
        force_drift: share of the residual forces that a correction may leave before the prediction is spent.
        stiffness_factor: on the curvature where none has been seen, where trust falls; its inverse where trust grows.
        stiffness_range: least product of these factors, and where the inner problem gives up.
        reach_range: least reach that an inner problem begins with, because its model is new, and the largest, in χ.
        first_curvature: of the physics before anything is known, per unit step in the norm of C_t over the volume.
        curvature_memory: pairs of direction and change of the gradient that are kept.
        curvature_damping: least share of sᵀBs in sᵀy (Powell 1978, doi:10.1007/BFb0067703).
        curvature_probes: random probes of the leak's curvature; their error, a quarter, matters little in an estimate.
        max_interior_steps: most steps of the interior point method, after which the best design so far serves.
        max_corrections: most Hessians ahead in one of these steps, most steps of the active set method, and most
            interior point steps beyond the end for the sake of identifying the active set.
        subproblem_gain: the interior point method ends when a step, had it been taken whole, would bring less than this
            share of the gain.
        first_barrier: over the forces at s = 0 times a change of χ by one.
        least_slack: at the start of the interior point method, in χ.
        boundary_share: of the way to the next zero of a slack or multiplier that a step may go (Nocedal & Wright 2006,
            ch. 19).
        alike: relative changes of slack and multiplier that differ by less do not tell which of the two vanishes
            (El-Bakry, Tapia & Zhang 1994, doi:10.1137/1036003).
        unclear: share of such bounds, of those taken for active, from which the set counts as not identified.
    """

    sufficient_decrease: float = 0.1
    poor_agreement: float = 0.25
    good_agreement: float = 0.75
    backtracking: float = 0.4
    trust_factor: float = 3.0
    least_time_step: float = 1e-8
    settled_updates: int = 5
    window: int = 3
    negligible_gain: float = 0.1
    worthless_gain: float = 1e-3
    shortest: float = 1e-3
    force_drift: float = 0.7
    stiffness_factor: float = 2.0
    stiffness_range: tuple[float, float] = (1e-3, 1e6)
    reach_range: tuple[float, float] = (0.1, 2.0)
    first_curvature: float = 1e-3
    curvature_memory: int = 60
    curvature_damping: float = 0.2
    curvature_probes: int = 32
    max_interior_steps: int = 20
    max_corrections: int = 6
    subproblem_gain: float = 0.2
    first_barrier: float = 0.1
    least_slack: float = 1e-4
    boundary_share: float = 0.95
    alike: float = 0.5
    unclear: float = 0.05

    def __post_init__(self) -> None:
        """Check how they are related.

        Raises:
            ValueError: if a number is not positive, or one of two that must be the smaller is not.
        """
        for each in fields(self):
            value = getattr(self, each.name)
            if not min(value if isinstance(value, tuple) else (value,)) > 0:
                raise ValueError(f"{each.name} must be positive")
        rising = (
            ("sufficient_decrease", "poor_agreement"),
            ("poor_agreement", "good_agreement"),
            ("worthless_gain", "negligible_gain"),
        )
        for low, high in rising:
            if not getattr(self, low) < getattr(self, high):
                raise ValueError(f"{low} must be below {high}")
        for name in ("stiffness_range", "reach_range"):
            if not getattr(self, name)[0] < getattr(self, name)[1]:
                raise ValueError(f"{name} must rise")
        shares = ("good_agreement", "backtracking", "shortest", "negligible_gain", "force_drift", "subproblem_gain")
        for name in (*shares, "boundary_share", "alike", "unclear", "curvature_damping"):
            if not getattr(self, name) < 1.0:
                raise ValueError(f"{name} must be below 1")
        for name in ("trust_factor", "stiffness_factor"):
            if not getattr(self, name) > 1.0:
                raise ValueError(f"{name} must be above 1")


CONTROLS = Controls()

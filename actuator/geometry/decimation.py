"""Fewer triangles for the same solid."""

from __future__ import annotations

from actuator.geometry.distance import separation
from actuator.geometry.solid import manifold_of, prove_solid, surface_of
from actuator.geometry.zero_set import Surface

#: Times that a result which lies too far off is replaced by one made to half the tolerance.
TRIALS = 6


def decimated(surface: Surface, tolerance: float) -> tuple[Surface, float]:
    """A solid with fewer triangles, on some of the vertices, and how far off it lies, mm.

    manifold3d bounds what one collapsed edge moves, not what all of them add up to; the distance is measured.

    Args:
        surface: closed, oriented 2-manifold, exact in float32.
        tolerance: mm; the surface itself is returned if nothing is gained within it.
    """
    within = tolerance
    for _ in range(TRIALS):
        simple = surface_of(manifold_of(surface).simplify(within))
        coarse = prove_solid(simple.vertices, simple.triangles).surface
        off = separation(surface, coarse)
        if off <= tolerance:
            return coarse, off
        within *= 0.5
    return surface, 0.0

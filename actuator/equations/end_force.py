"""A dead force at the arm's end: it keeps its size and direction while the arm moves, and does the work F · u.

The end lies L_arm from the glued face, so that u = (T1 + L_arm (cos θ2 - 1), T3 - L_arm sin θ2) along X1 and X3, the
second of which is the elongation of the spring there.
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.parameters import Load


def end_force(T: Floats, load: Load) -> Floats:
    """Derivative of -F · u with respect to T = [T1, T3, θ2], (3,); real or complex."""
    along, _, up = load.force
    angle, reach = T[2], load.arm_length
    moment = reach * (along * np.sin(angle) + up * np.cos(angle))
    return np.array([-along + 0.0 * angle, -up + 0.0 * angle, moment])


def end_tangent(T: Floats, load: Load) -> Floats:
    """Second derivative of -F · u with respect to T, (3, 3); real or complex."""
    along, _, up = load.force
    angle, tangent = T[2], np.zeros((3, 3), np.asarray(T).dtype)
    tangent[2, 2] = load.arm_length * (along * np.cos(angle) - up * np.sin(angle))
    return tangent

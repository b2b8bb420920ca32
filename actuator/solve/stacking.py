"""Arrays of several load cases, one after the other in one array."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np

from actuator.arrays import Floats


def stacked(parts: Sequence[Floats]) -> Floats:
    """Arrays one after the other; a single one as it is."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def split(whole: Floats, count: int) -> list[Floats]:
    """The equally long parts of an array, as views."""
    return np.split(whole, count)


def summed(parts: Sequence[Floats]) -> Floats:
    """The sum of arrays in their order; a single one as it is."""
    return reduce(np.add, parts)

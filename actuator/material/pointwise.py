"""The functions of whatever law a tuple of coefficients belongs to, in Python and in compiled code alike.

In compiled code the choice is made by type when a function is compiled and costs nothing when it runs.
"""

from __future__ import annotations

from functools import cache

from numba import njit
from numba.extending import is_jitted, overload

from actuator.material.constants import law_file


@cache
def _compiled(function):
    """A function of a law's file, compiled if it is plain Python there."""
    return function if is_jitted(function) else njit(cache=True)(function)


def energy(law, b):
    """w(b̄) of :mod:`actuator.material.laws`."""
    return _compiled(law_file(type(law)).energy)(law, b)


def stress(law, b, S):
    """Write S = 2 b̄ ∂w/∂b̄ of :mod:`actuator.material.laws`, (3, 3)."""
    _compiled(law_file(type(law)).stress)(law, b, S)


def tangent(law, b, X, dS):
    """Write the derivatives of S along X (m, 3, 3)."""
    _compiled(law_file(type(law)).tangent)(law, b, X, dS)


@overload(energy)
def _energy(law, b):
    chosen = _compiled(law_file(law.instance_class).energy)
    return lambda law, b: chosen(law, b)


@overload(stress)
def _stress(law, b, S):
    chosen = _compiled(law_file(law.instance_class).stress)
    return lambda law, b, S: chosen(law, b, S)


@overload(tangent)
def _tangent(law, b, X, dS):
    chosen = _compiled(law_file(law.instance_class).tangent)
    return lambda law, b, X, dS: chosen(law, b, X, dS)

"""The functions for the formula of a kinematics, besides + − × ÷, whole powers and abs.

Arrays and floats use NumPy; any other number type must have methods of the same names, as the numbers have
that record a formula (`feedplan.machine.expression`). `atan2` in degrees is `degrees(atan2(y, x))`: the
factor 180/π is enclosed, not rounded, where intervals are evaluated.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

# An array, a float, a recording number, or a user's type with the same methods.
Number: TypeAlias = Any


def sqrt(x: Number) -> Number:
    """Square root."""
    return x.sqrt() if hasattr(x, "sqrt") else np.sqrt(x)


def square(x: Number) -> Number:
    """x²; for intervals its bounds are tighter than those of the product x·x."""
    return x.square() if hasattr(x, "square") else np.square(x)


def sin_cos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine of an angle in radians; for recording numbers both cost as much as one."""
    if hasattr(x, "sin_cos"):
        sine, cosine = x.sin_cos()
        return sine, cosine
    return np.sin(x), np.cos(x)


def sin(x: Number) -> Number:
    """Sine of an angle in radians."""
    return sin_cos(x)[0]


def cos(x: Number) -> Number:
    """Cosine of an angle in radians."""
    return sin_cos(x)[1]


def atan2(y: Number, x: Number) -> Number:
    """The angle of the vector (x, y) in radians, as NumPy's arctan2."""
    for number in (y, x):
        if hasattr(number, "atan2"):
            return number.atan2(y, x)
    return np.arctan2(y, x)


def hypot(x: Number, y: Number) -> Number:
    """The length of the vector (x, y)."""
    if hasattr(x, "sqrt") or hasattr(y, "sqrt"):
        return sqrt(square(x) + square(y))
    return np.hypot(x, y)


def radians(x: Number) -> Number:
    """Degrees as radians."""
    return x.radians() if hasattr(x, "radians") else np.radians(x)


def degrees(x: Number) -> Number:
    """Radians as degrees."""
    return x.degrees() if hasattr(x, "degrees") else np.degrees(x)

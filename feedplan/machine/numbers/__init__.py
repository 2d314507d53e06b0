"""Numbers that one formula is evaluated on: arrays, Taylor series, intervals, series of intervals.

A formula uses + − × ÷, small whole powers and the functions here, and never branches on a value.
"""

from feedplan.machine.numbers.elementary import (
    Number,
    atan2,
    cos,
    degrees,
    hypot,
    radians,
    sin,
    sin_cos,
    sqrt,
    square,
)
from feedplan.machine.numbers.interval import Interval
from feedplan.machine.numbers.series import Series

__all__ = [
    "Interval",
    "Number",
    "Series",
    "atan2",
    "cos",
    "degrees",
    "hypot",
    "radians",
    "sin",
    "sin_cos",
    "sqrt",
    "square",
]

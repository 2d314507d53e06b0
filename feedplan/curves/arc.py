"""Arcs and circles as exact rational quadratics, and helices within a proven tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import Curve
from feedplan.curves._arrays import MAX_AXES, floats
from feedplan.curves.composite import MAX_DEGREE, CompositeCurve
from feedplan.errors import InputError


def arc(
    start: ArrayLike, centre: Sequence[float], sweep: float, plane: tuple[int, int] = (0, 1)
) -> CompositeCurve:
    """The arc from `start` (axes,) by `sweep` [rad] about `centre` (2,) in the plane of two axes.

    It turns from the first axis of the plane towards the second. Its pieces are exact rational quadratics of
    at most 90°, the width of each its length.
    """
    return _turn(start, centre, sweep, plane, None, 2, 1.0)[0]


def circle(
    centre: ArrayLike, radius: float, plane: tuple[int, int] = (0, 1), start_angle: float = 0.0
) -> CompositeCurve:
    """The full circle about `centre` (axes,) in the plane of two axes, from `start_angle` [rad]."""
    middle = floats(centre, "the centre", 1)
    if not 0 < radius < math.inf:
        raise InputError(f"the radius is {radius} mm: give a positive number")
    _check_plane(plane, len(middle))
    start = middle.copy()
    start[list(plane)] += radius * np.array([math.cos(start_angle), math.sin(start_angle)])
    return arc(start, (middle[plane[0]], middle[plane[1]]), 2 * math.pi, plane)


def helix(
    start: ArrayLike,
    centre: Sequence[float],
    sweep: float,
    travel: ArrayLike,
    plane: tuple[int, int] = (0, 1),
    degree: int = 7,
    tolerance: float = 1e-9,
) -> tuple[CompositeCurve, float]:
    """An arc on which the other axes go by `travel` (axes,) with the angle, and its error bound [mm].

    A true helix is no rational curve of any degree. The pieces, of `degree` 3 to 9, lie exactly on the circle
    of the plane; along the other axes they are off by at most the bound, which is proven and at most
    `tolerance` [mm], rounding apart. Derivatives by u are continuous (C1). A higher degree takes fewer
    pieces, odd degrees the fewest.
    """
    if not 0 < tolerance < math.inf:
        raise InputError(f"the tolerance of the helix is {tolerance} mm: give a positive number")
    if degree not in range(3, MAX_DEGREE + 1):
        raise InputError(f"the degree of the helix is {degree}: give 3 to {MAX_DEGREE}")
    rise = floats(travel, "the travel", 1)
    if len(rise) != np.size(start) or rise[list(plane)].any():
        raise InputError(
            f"the travel of the helix is {rise.tolist()}: give one number per axis, 0 for those of the plane"
        )
    return _turn(start, centre, sweep, plane, rise, degree, tolerance)


def _turn(
    start: ArrayLike,
    centre: Sequence[float],
    sweep: float,
    plane: tuple[int, int],
    travel: NDArray[np.float64] | None,
    degree: int,
    tolerance: float,
) -> tuple[CompositeCurve, float]:
    first, middle = floats(start, "the start", 1), floats(centre, "the centre", 1)
    _check_plane(plane, len(first))
    if len(middle) != 2:
        raise InputError(f"the centre is {middle.tolist()}: give its two coordinates in the plane")
    if not (math.isfinite(sweep) and 0 < abs(sweep) <= 1e6):
        raise InputError(f"the sweep is {sweep} rad: give an angle that is not 0, at most 1e6 either way")
    if (first[list(plane)] == middle).all():
        raise InputError(
            f"the arc starts at its centre {middle.tolist()}: its radius is 0; correct one of them"
        )
    native, bound = Curve.of_turn(
        first, plane, (float(middle[0]), float(middle[1])), sweep, travel, degree, tolerance
    )
    return CompositeCurve.of(native), bound


def _check_plane(plane: tuple[int, int], axes: int) -> None:
    if len(set(plane)) != 2 or not all(0 <= axis < axes for axis in plane) or axes > MAX_AXES:
        raise InputError(f"the plane {plane} of {axes} axes: name two of at most {MAX_AXES}, from 0")

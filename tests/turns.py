"""Arcs and circles as exact rational quadratics, each with at most a quarter turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan.curves.composite import CompositeCurve

QUARTER = 0.5 * math.pi


def arc(start: ArrayLike, centre: Sequence[float], sweep: float) -> CompositeCurve:
    """The arc from `start` (2,) by `sweep` [rad] about `centre`, counter-clockwise.

    The width of each piece is its length.
    """
    middle = np.asarray(centre, dtype=float)
    spoke = np.asarray(start, dtype=float) - middle
    parts = math.ceil(abs(sweep) / QUARTER - 1e-9)
    step = sweep / parts
    out = math.tan(0.5 * step)
    spokes = [_turned(spoke, step * i) for i in range(parts + 1)]
    control = [
        [middle + one, middle + one + out * np.array([-one[1], one[0]]), middle + other]
        for one, other in pairwise(spokes)
    ]
    weights = np.tile([1.0, math.cos(0.5 * step), 1.0], parts)
    width = np.full(parts, math.hypot(*spoke) * abs(step))
    return CompositeCurve(np.concatenate(control), weights, 3 * np.arange(parts + 1), width)


def circle(centre: Sequence[float], radius: float) -> CompositeCurve:
    """The full circle in X and Y; further coordinates of the centre are those of all points."""
    whole = arc([centre[0] + radius, centre[1]], centre[:2], 2.0 * math.pi)
    others = np.tile(np.asarray(centre[2:], dtype=float), (len(whole.control_points), 1))
    points = np.concatenate([whole.control_points, others], axis=1)
    return CompositeCurve(points, whole.weights, whole.offsets, whole.width)


def _turned(spoke: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """A vector turned by an angle [rad]; quarter turns are exact."""
    quarters = round(angle / QUARTER)
    if math.isclose(angle, QUARTER * quarters, abs_tol=1e-12):
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarters % 4]
    else:
        cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([cosine * spoke[0] - sine * spoke[1], sine * spoke[0] + cosine * spoke[1]])

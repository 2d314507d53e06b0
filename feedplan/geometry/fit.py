"""A chain of points as C1 quadratic B-splines within a certified tolerance (Zhang et al. 2010, section 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import fit_points as native_fit_points
from feedplan.curves._arrays import MAX_AXES
from feedplan.errors import InputError

CORNER_ANGLE = math.radians(30.0)


@dataclass(frozen=True)
class FittedCurve:
    """Quadratic pieces C_i(u), u in [0, width_i], joined end to end, that follow the chords of a chain.

    `control_points` (n, 3, axes) Bézier points [mm]; `width` (n,) parameter interval [mm: about the length];
    `chords` (n, 2) first and last chord that the piece follows, neighbours sharing at most one (chord i goes
    from point i to point i + 1); `deviation` (n,) certified bound on the distance between piece and chords,
    both ways [mm]; `spline` (n,) number of the B-spline or line that the piece belongs to.
    """

    control_points: NDArray[np.float64]
    width: NDArray[np.float64]
    chords: NDArray[np.int64]
    deviation: NDArray[np.float64]
    spline: NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.width)

    @property
    def splines(self) -> int:
        """Number of B-splines and lines."""
        return int(self.spline[-1]) + 1

    @property
    def spline_ratio(self) -> float:
        """Chords approximated by one B-spline."""
        return (int(self.chords[-1, 1]) + 1) / self.splines

    @property
    def polynomial_ratio(self) -> float:
        """Chords approximated by one polynomial."""
        return (int(self.chords[-1, 1]) + 1) / len(self)


def fit_points(
    points: ArrayLike,
    tolerance: float,
    max_chord: float = math.inf,
    max_curvature: float = math.inf,
    corner_angle: float = CORNER_ANGLE,
) -> FittedCurve:
    """Fits `points` (n, axes) [mm], n ≥ 2, neighbours distinct, by lines and C1 quadratic B-splines.

    The curve stays within `tolerance` [mm] of the polygon and the polygon within `tolerance` of the curve;
    with 0 every chord stays a line. Chords longer than `max_chord` [mm] stay lines, as do runs of colinear
    points that are no part of a smooth curve. Points of extreme curvature above `max_curvature` [1/mm]
    (Zhang eq. 2: α a_max / F²) end a B-spline; both ends of the chain and of every B-spline are interpolated
    exactly. The tangent may jump only where the points turn by more than `corner_angle` [rad], or where
    nothing smooth is within the tolerance, so that chords are kept or a tangent beside them is given up.

    Raises InputError for points that are too few, repeated or not finite.
    """
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or len(array) < 2 or not 1 <= array.shape[1] <= MAX_AXES:
        raise InputError(f"points of shape {array.shape}: give at least two points of 1 to {MAX_AXES} axes")
    bad = ~np.isfinite(array).all(axis=1)
    if bad.any():
        raise InputError(f"point {int(bad.argmax())} is not finite: correct its coordinates")
    same = (array[1:] == array[:-1]).all(axis=1)
    if same.any():
        raise InputError(
            f"points {int(same.argmax())} and {int(same.argmax()) + 1} coincide: remove one of them"
        )
    if math.isnan(tolerance):
        raise InputError("the fitting tolerance is not a number: give it in mm")
    return FittedCurve(*native_fit_points(array, tolerance, max_chord, max_curvature, corner_angle))

"""The certificate: a time that no feasible profile of a problem can beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve


def lower_bound(problem: Problem) -> float:
    """A proven lower bound [s] on the time in motion along the problem's path, dwells not counted.

    No piece is passed faster than its chord at its feed, nor faster than each joint from its place at the
    start to that at the end at its greatest velocity.
    """
    at_feed = np.linalg.norm(_steps(problem.tip_curve or problem.curve), axis=1) / problem.feed
    at_velocity = (_steps(problem.curve) / problem.max_velocity).max(axis=1, initial=0.0)
    return float(np.maximum(at_feed, at_velocity).sum())


def _steps(curve: CompositeCurve) -> NDArray[np.float64]:
    """|C(w) − C(0)| of each piece, by axis (n, axes)."""
    points = curve.control_points
    return np.asarray(np.abs(points[curve.offsets[1:] - 1] - points[curve.offsets[:-1]]))

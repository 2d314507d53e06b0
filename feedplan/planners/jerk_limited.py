"""The time-optimal profile under limits of velocity, acceleration and jerk of every axis, to an accuracy."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import PlanError, bound_jerk_limited, plan_jerk_limited
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.geometry.corners import Corners
from feedplan.planners._faults import error_of
from feedplan.planners._jerk import jerk_limits, lowered_limits
from feedplan.profile import SpeedProfile

# The profile keeps the limits of jerk, best where curvature does not jump.
LIMITS_JERK = True
CORNERS = Corners.SMOOTH
# What finer grids may gain, in accuracies.
GRID_ERROR = 2.0
# The gap of complementarity at which the interior point stops, in accuracies.
GAP = 0.01
# Accuracies the grid is made for: on finer ones smooth changes of speed drown in what keeps the matrix
# of the interior point definite.
FINEST, COARSEST = 1e-5, 0.1


def plan(problem: Problem, *, accuracy: float = 1e-4, time_limit: float | None = None) -> SpeedProfile:
    """The fastest profile, its time within about `accuracy` of the least, as a part of it.

    It is planned by the length of the tool's way (`solvers/src/jerk_limited_path.rs`). After `time_limit` [s]
    the best profile so far is taken: it keeps all limits too. Raises SolverError for an axis without a limit
    of jerk, InfeasibleError where the start or end speed cannot be had, with the speed that can.
    """
    if not FINEST <= accuracy <= COARSEST:
        raise InputError(f"the accuracy is {accuracy:g}: give {FINEST:g} to {COARSEST:g}")
    if time_limit is not None and not time_limit >= 0:
        raise InputError(f"the time limit is {time_limit:g} s: give 0 or more")
    # Errors fall with the square of the resolution, 1e-4 at 16 intervals.
    resolution = max(16.0 * (1e-4 / accuracy) ** 0.5, 6.0)
    limits = jerk_limits(problem)
    start = time.perf_counter()
    profile = _planned(problem, limits, resolution, accuracy, time_limit)
    lowered = lowered_limits(problem, limits, profile)
    if lowered is not None:
        left = None if time_limit is None else max(time_limit - (time.perf_counter() - start), 0.0)
        profile = _planned(problem, lowered, resolution, accuracy, left)
    return profile


def lower_bound(
    problem: Problem, profile: SpeedProfile, *, accuracy: float = 1e-4, time_limit: float | None = None
) -> float:
    """A bound [s] on the time of every profile, from one planned with the same options, if that is of use.

    The convex relaxation of the problem on the profile's own grid proves its bound; what finer grids may
    gain, measured to be less than twice the accuracy, is taken off.
    """
    found = bound_jerk_limited(problem, jerk_limits(problem), profile, time_limit)
    return (1.0 - GRID_ERROR * accuracy) * min(found, profile.time)


def _planned(
    problem: Problem,
    limits: NDArray[np.float64],
    resolution: float,
    accuracy: float,
    time_limit: float | None,
) -> SpeedProfile:
    try:
        columns, changes = plan_jerk_limited(problem, limits, resolution, GAP * accuracy, time_limit)
    except PlanError as fault:
        raise error_of(problem, fault) from None
    return SpeedProfile(*columns, *changes)

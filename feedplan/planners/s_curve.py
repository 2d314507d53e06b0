"""The two-pass profile of constant jerk, no acceleration where segments meet (Cheatham 2007, chapter 4).

Where the limits of an axis differ by direction, speeds and what turning takes of accelerations have those of
the directions that a segment has. Its acceleration along the path is one for speeding up and slowing down, as
in the thesis: by the lesser of both limits.
"""

from __future__ import annotations

from feedplan._solvers import PlanError, plan_s_curve
from feedplan.constraints.problem import Problem
from feedplan.geometry.corners import Corners
from feedplan.planners._faults import error_of
from feedplan.planners._jerk import jerk_limits
from feedplan.planners._runs import within_both
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener

# The profile keeps the limits of jerk, best where curvature does not jump.
LIMITS_JERK = True
CORNERS = Corners.SMOOTH
# Segments known beyond the one that the motion enters.
LOOK_AHEAD = 256
# Each stretch is cut as gives the quickest profile. A cutting is the length over which a speed has to pay, in
# lengths from rest to rest that just reach the greatest speed, and the part of them by which the speeds of
# parts may differ that are one segment.
CUTTINGS = ((4.0, 0.05), (16.0, 0.05), (64.0, 0.05), (4.0, 0.2), (16.0, 0.2))


def plan(problem: Problem, *, progress: Listener | None = None) -> SpeedProfile:
    """The profile of a controller that looks some segments ahead; not the fastest.

    Raises SolverError for an axis without a limit of jerk.
    """
    return _planned(problem, None, progress)


def plan_by_itself(problem: Problem, progress: Listener | None = None) -> SpeedProfile:
    """The same without the runs of which this method leaves a stretch to jerk-limited: they have no arcs."""
    return _planned(problem, 0.0, progress)


def _planned(problem: Problem, time_limit: float | None, progress: Listener | None) -> SpeedProfile:
    """`time_limit` [s] is for what is left to jerk-limited."""

    def solved(problem: Problem, progress: Listener | None) -> SpeedProfile:
        try:
            native = plan_s_curve(problem, jerk_limits(problem), CUTTINGS, LOOK_AHEAD, time_limit, progress)
        except PlanError as fault:
            raise error_of(problem, fault) from None
        return SpeedProfile.of(native)

    return within_both(problem, solved, progress)

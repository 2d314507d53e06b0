"""The two-pass S-curve of constant jerk, with acceleration 0 where segments meet (Cheatham 2007, chapter 4).

Where the limits of an axis differ by direction, speeds and accelerations across the path use the limits for
the segment's direction. The acceleration along the path is equal for speeding up and slowing down, as in the
thesis: the smaller limit holds.
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

# The profile keeps the jerk limits; only where the curvature of the path jumps, its acceleration may jump.
LIMITS_JERK = True
CORNERS = Corners.SMOOTH
# Number of segments that are known after the one that the motion enters.
LOOK_AHEAD = 256
# Each subrun takes the cutting that gives the fastest profile. A cutting is the least length of a segment, in
# units of the length from rest to rest that just reaches the greatest speed, and the share by which the speed
# limits of parts of one segment may differ.
CUTTINGS = ((4.0, 0.05), (16.0, 0.05), (64.0, 0.05), (4.0, 0.2), (16.0, 0.2))


def plan(problem: Problem, *, progress: Listener | None = None) -> SpeedProfile:
    """The profile of a controller that looks some segments ahead; it is not the fastest.

    Raises SolverError for an axis without a jerk limit.
    """
    return _planned(problem, None, progress)


def plan_by_itself(problem: Problem, progress: Listener | None = None) -> SpeedProfile:
    """The profile without phases on runs with a subrun that this method leaves to jerk-limited."""
    return _planned(problem, 0.0, progress)


def _planned(problem: Problem, time_limit: float | None, progress: Listener | None) -> SpeedProfile:
    """The profile; `time_limit` [s] is for the subruns that are left to jerk-limited."""

    def solved(problem: Problem, progress: Listener | None) -> SpeedProfile:
        try:
            native = plan_s_curve(problem, jerk_limits(problem), CUTTINGS, LOOK_AHEAD, time_limit, progress)
        except PlanError as fault:
            raise error_of(problem, fault) from None
        return SpeedProfile.of(native)

    return within_both(problem, solved, progress)

"""The two-pass profile of constant jerk, without acceleration where segments meet (Cheatham 2007, chapter 4).

Where the limits of an axis differ by direction, speeds and the accelerations across the path have the limits
of the segment's direction. The acceleration along the path is the same for speeding up and slowing down, as
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
# Each subrun is cut in the way that gives the fastest profile. A cutting is the least length of a segment, in
# lengths from rest to rest that just reach the greatest speed, and the share by which the speeds of parts of
# one segment may differ.
CUTTINGS = ((4.0, 0.05), (16.0, 0.05), (64.0, 0.05), (4.0, 0.2), (16.0, 0.2))


def plan(problem: Problem, *, progress: Listener | None = None) -> SpeedProfile:
    """The profile of a controller that looks some segments ahead; not the fastest.

    Raises SolverError for an axis without a limit of jerk.
    """
    return _planned(problem, None, progress)


def plan_by_itself(problem: Problem, progress: Listener | None = None) -> SpeedProfile:
    """The same without arcs on runs that have a subrun which this method leaves to jerk-limited."""
    return _planned(problem, 0.0, progress)


def _planned(problem: Problem, time_limit: float | None, progress: Listener | None) -> SpeedProfile:
    """The profile; `time_limit` [s] is for subruns that are left to jerk-limited."""

    def solved(problem: Problem, progress: Listener | None) -> SpeedProfile:
        try:
            native = plan_s_curve(problem, jerk_limits(problem), CUTTINGS, LOOK_AHEAD, time_limit, progress)
        except PlanError as fault:
            raise error_of(problem, fault) from None
        return SpeedProfile.of(native)

    return within_both(problem, solved, progress)

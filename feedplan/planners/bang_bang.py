"""The exact time-optimal profile under velocity, acceleration, feed and chord-error limits; no jerk limit."""

from __future__ import annotations

from feedplan._solvers import PlanError, plan_bang_bang
from feedplan.constraints.problem import Problem
from feedplan.planners._faults import error_of
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener


def plan(problem: Problem, *, progress: Listener | None = None) -> SpeedProfile:
    """The fastest profile; its time is the least that the limits allow, to rounding.

    Raises InfeasibleError, with the reachable speed, where the start or end speed is not possible.
    """
    try:
        return SpeedProfile.of(plan_bang_bang(problem, progress))
    except PlanError as fault:
        raise error_of(problem, fault) from None

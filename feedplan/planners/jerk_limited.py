"""The time-optimal profile under limits of velocity, acceleration and jerk of every axis, to an accuracy."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from feedplan._solvers import PlanError, plan_jerk_limited
from feedplan.arguments import number
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.errors import InfeasibleError
from feedplan.geometry.corners import Corners
from feedplan.planners import s_curve
from feedplan.planners._faults import error_of
from feedplan.planners._jerk import jerk_limits, lowered_limits
from feedplan.planners._parts import Elsewhere, Part, fault_of, joined, parts
from feedplan.planners._runs import fastest_runs
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener, part

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
# Intervals, in the time in which an axis can reach its full acceleration, at the accuracy 1e-4 and at least;
# errors fall with their square.
RESOLUTION, LEAST_RESOLUTION = 16.0, 6.0
# Those of the first plan, and its gap of complementarity: it is some tenths of a percent slower than the
# best in a fifth to a third of the time.
FIRST_RESOLUTION, FIRST_GAP = 3.0, 3e-4
# How far a plan with a time limit is after its first plan, and before that of the other method, for the
# progress shown.
FIRST, OTHER = 0.2, 0.9


def plan(
    problem: Problem,
    *,
    accuracy: float = 1e-4,
    time_limit: float | None = None,
    reserve: Callable[[SpeedProfile], float] | None = None,
    progress: Listener | None = None,
    elsewhere: Elsewhere | None = None,
) -> SpeedProfile:
    """The fastest profile, its time within about `accuracy` of the least, as a part of it.

    It is planned by the length of the tool's way (`solvers/jerk/src/jerk_limited/on_path.rs`). With a
    `time_limit` [s] there is a first plan, on a coarse grid, whatever the limit. `reserve` tells from it what
    is to be kept of the limit for other work [s]. If the rest does not suffice, each run takes the fastest of
    the first plan, of the one that was stopped, if that came to the run, and of the method s-curve; the
    profile says `stopped`. It keeps all limits too. Without a time limit runs are planned `elsewhere`, if
    that is given. Raises SolverError for an axis without a limit of jerk, InfeasibleError where the start or
    end speed cannot be had, with the speed that can.
    """
    accuracy = number(
        accuracy, "the accuracy", f"{FINEST:g} to {COARSEST:g}", lambda part: FINEST <= part <= COARSEST
    )
    if time_limit is not None:
        time_limit = number(time_limit, "the time limit", "0 or more", lambda limit: limit >= 0, "s")
    limits = jerk_limits(problem)
    resolution = max(RESOLUTION * (1e-4 / accuracy) ** 0.5, LEAST_RESOLUTION)
    proven = 1.0 - GRID_ERROR * accuracy
    whole = _Task(problem, limits, resolution, GAP * accuracy, proven, elsewhere)
    if time_limit is None:
        return whole.plan(None, progress)
    end = time.perf_counter() + time_limit
    try:
        coarse = _Task(problem, limits, FIRST_RESOLUTION, FIRST_GAP, 0.0, None)
        first = coarse.plan(None, part(progress, 0.0, FIRST))
    except InfeasibleError:
        # A coarse grid may miss a speed at an end that can just be had.
        return whole.plan(None, part(progress, FIRST, 1.0))
    if reserve is not None and time.perf_counter() < end:
        end -= reserve(first)
    found = [first]
    if time.perf_counter() < end:
        best = whole.plan(end, part(progress, FIRST, OTHER))
        if not best.stopped:
            return best
        found.append(best)
    other = s_curve.plan_by_itself(problem, part(progress, OTHER, 1.0))
    if lowered_limits(problem, limits, other) is None:
        found.append(other)
    return replace(fastest_runs(found), stopped=True)


@dataclass(frozen=True)
class _Task:
    """A plan within `limits` of jerk [mm/s³] on a grid of a `resolution` (see `RESOLUTION`), by an interior
    point that stops at a `gap` of complementarity.

    Its lower bounds are the part `proven` of those on its grid; without that part it has none. Without a time
    limit runs are planned `elsewhere`, if that is given.
    """

    problem: Problem
    limits: Floats
    resolution: float
    gap: float
    proven: float
    elsewhere: Elsewhere | None

    def plan(self, end: float | None, progress: Listener | None) -> SpeedProfile:
        """The plan by a time of the clock; again with lower limits where the joints miss those of jerk."""
        once = 0.5 if self.problem.words else 1.0
        profile = self._once(end, part(progress, 0.0, once))
        lowered = lowered_limits(self.problem, self.limits, profile)
        if lowered is None:
            return profile
        again = replace(self, limits=lowered, proven=0.0)._once(end, part(progress, once, 1.0))
        # What no plan within the limits can beat, no plan within lower ones can.
        return again.with_others(run_bounds=profile.run_bounds)

    def _once(self, end: float | None, progress: Listener | None) -> SpeedProfile:
        problem, settings = self.problem, (self.limits, self.resolution, self.gap, self.proven > 0)
        elsewhere = self.elsewhere if end is None else None
        # Fewer than two parts: there is nothing to share.
        own = [] if elsewhere is None else parts(problem, elsewhere.count())
        if elsewhere is not None and len(own) > 1:
            planned = elsewhere.map(plan_part, [(each, *settings) for each in own], progress)
            for each, (found, fault) in zip(own, planned, strict=True):
                if found is None:
                    raise error_of(problem, fault_of(each, fault))
            profile = joined(own, [found for found, _ in planned])
        else:
            left = None if end is None else max(end - time.perf_counter(), 0.0)
            try:
                native, stopped, excess, bounds = plan_jerk_limited(problem, *settings, left, progress)
            except PlanError as fault:
                raise error_of(problem, fault) from None
            profile = SpeedProfile.of(native, stopped=stopped, excess=math.fsum(excess), run_bounds=bounds)
        return profile.with_others(
            run_bounds=self.proven * profile.run_bounds if self.proven else np.empty(0)
        )


def plan_part(
    part: Part, limits: Floats, resolution: float, gap: float, proves: bool, progress: Listener
) -> tuple[tuple[SpeedProfile, Floats] | None, tuple[Any, ...]]:
    """The profile of a part and the excess of each of its runs, or None and the arguments of the fault."""
    try:
        native, _, excess, bounds = plan_jerk_limited(part, limits, resolution, gap, proves, None, progress)
        return (SpeedProfile.of(native, run_bounds=bounds), excess), ()
    except PlanError as fault:
        return None, fault.args

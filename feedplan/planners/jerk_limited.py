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

# The profile keeps the jerk limits; only where the curvature of the path jumps, its acceleration may jump.
LIMITS_JERK = True
CORNERS = Corners.SMOOTH
# Finer grids may reduce the time by this many times the accuracy.
GRID_ERROR = 2.0
# The complementarity gap at which the interior-point method stops, in units of the accuracy.
GAP = 0.01
# The range of accuracies that the grid is made for: on finer grids, the regularisation of the interior-point
# matrix is larger than smooth changes of speed.
FINEST, COARSEST = 1e-5, 0.1
# Number of grid intervals per A/J, the time in which an axis can reach its full acceleration: at the accuracy
# 1e-4, and at least. Errors fall with its square.
RESOLUTION, LEAST_RESOLUTION = 16.0, 6.0
# Resolution and complementarity gap of the first plan: it is some tenths of a percent slower than the best,
# and takes a fifth to a third of the computing time.
FIRST_RESOLUTION, FIRST_GAP = 3.0, 3e-4
# With a time limit, the share of progress reached after the first plan, and before the plan of the method
# s-curve.
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
    """The fastest profile; its time is within about the relative `accuracy` of the least time.

    It is planned over the length of the tool's path (`solvers/jerk/src/jerk_limited/on_path.rs`). With a
    `time_limit` [s] a first plan on a coarse grid is always made. `reserve` returns, from the first plan, the
    part of the limit to keep for other work [s]. If the rest of the limit does not suffice, each run takes
    the fastest of the first plan, of the unfinished plan (if it reached the run) and of the method s-curve,
    and the profile has `stopped` set; it still keeps all limits. Without a time limit runs are planned by
    `elsewhere`, if given.

    Raises SolverError for an axis without a jerk limit, and InfeasibleError, with the possible speed, where
    the start or end speed is not possible.
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
        # A coarse grid may fail at a given end speed that is only just possible.
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
    """A plan within jerk `limits` (axes,) [mm/s³] on a grid of a `resolution` (see `RESOLUTION`), by an
    interior-point method that stops at the complementarity `gap`.

    Its lower bounds are the lower bounds on its grid times `proven`; with `proven` 0 it has none. Without a
    time limit runs are planned by `elsewhere`, if given.
    """

    problem: Problem
    limits: Floats
    resolution: float
    gap: float
    proven: float
    elsewhere: Elsewhere | None

    def plan(self, end: float | None, progress: Listener | None) -> SpeedProfile:
        """The plan, to be ready at the time `end` of the clock; planned again with lower limits where the
        interpolants' jerk error exceeds `HELD`."""
        once = 0.5 if self.problem.words else 1.0
        profile = self._once(end, part(progress, 0.0, once))
        lowered = lowered_limits(self.problem, self.limits, profile)
        if lowered is None:
            return profile
        again = replace(self, limits=lowered, proven=0.0)._once(end, part(progress, once, 1.0))
        # A lower bound within the original limits is also one within lower limits.
        return again.with_others(run_bounds=profile.run_bounds)

    def _once(self, end: float | None, progress: Listener | None) -> SpeedProfile:
        problem, settings = self.problem, (self.limits, self.resolution, self.gap, self.proven > 0)
        elsewhere = self.elsewhere if end is None else None
        # With fewer than two parts there is nothing to share.
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
    """The profile of a part and the excess of each of its runs; or None and the PlanError's arguments."""
    try:
        native, _, excess, bounds = plan_jerk_limited(part, limits, resolution, gap, proves, None, progress)
        return (SpeedProfile.of(native, run_bounds=bounds), excess), ()
    except PlanError as fault:
        return None, fault.args

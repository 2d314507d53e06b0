"""Combines profiles of one path: the fastest one for each run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from feedplan.constraints.problem import Problem
from feedplan.errors import InfeasibleError
from feedplan.profile import SpeedProfile, joined_runs
from feedplan.progress import Listener, part


def within_both(
    problem: Problem, plan: Callable[[Problem, Listener | None], SpeedProfile], progress: Listener | None
) -> SpeedProfile:
    """The profile of a plan; if limits differ by direction, each run takes the faster of two plans.

    The second plan uses the smaller limit of both directions: a heuristic may be slower with wider limits.
    """
    if problem.even is problem:
        return plan(problem, progress)
    profile = plan(problem, part(progress, 0.0, 0.5))
    try:
        even = plan(problem.even, part(progress, 0.5, 1.0))
    except InfeasibleError:
        # Only the wider limits allow the given speeds at the ends of the path.
        return profile
    return fastest_runs([profile, even])


def fastest_runs(profiles: Sequence[SpeedProfile]) -> SpeedProfile:
    """For each run the profile with the least time, the first one if times are equal.

    A profile has no phases in a run that it does not plan; at least one profile must plan all runs. The
    result does not say how it was planned (`stopped`, `excess`, `run_bounds`).
    """
    times = np.stack([profile.run_times for profile in profiles])
    planned = np.stack([np.diff(profile.runs) > 0 for profile in profiles])
    best = np.argmin(np.where(planned, times, np.inf), axis=0)
    # Consecutive runs from the same profile are taken together.
    ends = [0, *(np.flatnonzero(np.diff(best)) + 1).tolist(), len(best)]
    return joined_runs((profiles[best[first]], slice(first, last), 0) for first, last in pairwise(ends))

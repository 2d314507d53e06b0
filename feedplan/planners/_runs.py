"""From several profiles of one path the fastest one of each run."""

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
    """The profile of a plan, and where limits differ by direction, the faster one of two plans for each run.

    The second plan is within the lesser limits of both directions: a heuristic may be slower with wider
    limits.
    """
    if problem.even is problem:
        return plan(problem, progress)
    profile = plan(problem, part(progress, 0.0, 0.5))
    try:
        even = plan(problem.even, part(progress, 0.5, 1.0))
    except InfeasibleError:
        # Only the wider limits allow the given speeds at the ends.
        return profile
    return fastest_runs([profile, even])


def fastest_runs(profiles: Sequence[SpeedProfile]) -> SpeedProfile:
    """Each run by the profile that takes the least time for it, by the first of those that take the same.

    A profile has no arcs of a run that it does not plan; one profile plans all of them. The result says
    nothing of how it was planned (`stopped`, `excess`, `run_bounds`).
    """
    times = np.stack([profile.run_times for profile in profiles])
    planned = np.stack([np.diff(profile.runs) > 0 for profile in profiles])
    best = np.argmin(np.where(planned, times, np.inf), axis=0)
    # Neighbouring runs of one profile are taken together.
    ends = [0, *(np.flatnonzero(np.diff(best)) + 1).tolist(), len(best)]
    return joined_runs((profiles[best[first]], slice(first, last), 0) for first, last in pairwise(ends))

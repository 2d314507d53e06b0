"""From several profiles of one path the fastest one of each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.errors import InfeasibleError
from feedplan.profile import OF_PHASES, OF_PIECES, SpeedProfile
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
    columns: dict[str, list[NDArray[np.generic]]] = {name: [] for name in (*OF_PHASES, *OF_PIECES)}
    runs = [0]
    for run, chosen in enumerate(best):
        profile = profiles[chosen]
        arcs = slice(int(profile.runs[run]), int(profile.runs[run + 1]))
        for name in OF_PHASES:
            columns[name].append(getattr(profile, name)[arcs])
        own = profile.piece[arcs]
        for name in OF_PIECES:
            pieces = getattr(profile, name)
            columns[name].append(pieces[np.isin(pieces, own)])
        runs.append(runs[-1] + len(own))
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    return replace(
        profiles[0], **joined, runs=np.array(runs), stopped=False, excess=math.nan, run_bounds=np.empty(0)
    )

"""The certificate: a time that no feasible profile of a problem can beat."""

from __future__ import annotations

from feedplan._solvers import lower_bound as native_bound
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener

# A profile keeps the limits to rounding only: it may be faster by this part than any that keeps them exactly.
ROUNDING = 1e-9


def lower_bound(problem: Problem, profile: SpeedProfile, progress: Listener | None = None) -> float:
    """A proven lower bound [s] on the time in motion along the problem's path, dwells not counted.

    No profile that keeps the limits on velocity, acceleration, feed, chord error and junction speed is
    faster; a jerk limit is not looked at. The bound comes from the path and the limits alone: `profile`, of
    any method, says only where to divide the path and which parts to divide further. A bound above its time
    shows a profile that breaks a limit. `progress` is told how far it is. See `solvers/planner/src/bound.rs`.
    """
    bound: float = native_bound(problem, profile, progress)
    time = profile.time
    return min(bound, time) if bound <= time * (1.0 + ROUNDING) else bound

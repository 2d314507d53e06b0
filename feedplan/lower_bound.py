"""The proven lower bound of a problem's time, computed natively from the path and its limits."""

from __future__ import annotations

from feedplan._solvers import lower_bound as native_bound
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener

# A profile keeps the limits only up to rounding, so it may be faster than the exact optimum by this share of
# its time.
ROUNDING = 1e-9


def lower_bound(problem: Problem, profile: SpeedProfile, progress: Listener | None = None) -> float:
    """A proven lower bound of the time in motion along the problem's path, without dwells [s].

    No profile that keeps the limits of velocity, acceleration, feed, chord error and junction speed is
    faster; jerk limits are not used. The bound follows from the path and the limits alone: `profile`, of any
    method, only decides where the path is divided. A bound above the profile's time shows that the profile
    breaks a limit. Method and sources are in the kernel (`solvers/README.md`).
    """
    bound: float = native_bound(problem, profile, progress)
    time = profile.time
    return min(bound, time) if bound <= time * (1.0 + ROUNDING) else bound

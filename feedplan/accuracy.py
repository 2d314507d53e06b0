"""Warnings about the accuracy of a plan: how much of the requested accuracy it reaches, how much is
proven."""

from __future__ import annotations

import math

from feedplan.profile import SpeedProfile


def estimate(profile: SpeedProfile) -> float | None:
    """The planner's own estimate of (time − least time on the plan's grid) / time, from the remaining
    complementarity; it is not a proof. None if the planner gives no estimate."""
    if profile.stopped or math.isnan(profile.excess) or profile.time <= 0:
        return None
    return profile.excess / profile.time


def shortfalls(
    profile: SpeedProfile,
    lower_bound: float,
    *,
    accuracy: float,
    to_prove: bool,
    time_limit: float | None,
    left_to_grids: float,
) -> tuple[str, ...]:
    """At most one sentence: the plan was stopped by its time limit [s]; or it does not reach the `accuracy`;
    or (if `to_prove`) it reaches the accuracy, but its lower bound does not prove that.

    `lower_bound` [s] is a lower bound of the time; `left_to_grids` is the share of it that was subtracted
    because finer grids may reduce the time.
    """
    slower = profile.time / lower_bound - 1.0 if lower_bound > 0 else math.inf
    most = f"the plan may be up to {percent(slower)} slower than the optimum"
    if profile.stopped and time_limit is not None:
        return (f"stopped after {time_limit:g} s: {most}",)
    own = estimate(profile)
    if own is None or slower <= accuracy:
        return ()
    if own > accuracy:
        return (f"the accuracy {accuracy:g} was not reached: {most}, by its own estimate {percent(own)}",)
    if not to_prove:
        return ()
    gap = 1.0 - lower_bound / profile.time
    loose = max(gap - left_to_grids - own, 0.0)
    return (
        f"by its own estimate the plan is within {percent(own)} of the optimum on its grid and reaches the "
        f"accuracy {accuracy:g}, but the lower bound leaves a gap of {percent(gap)}: "
        f"{percent(left_to_grids)} for what finer grids may gain, {percent(loose)} where it is not tight",
    )


def percent(part: float) -> str:
    """`3.1 %`: two digits."""
    return f"{100.0 * part:.2g} %" if math.isfinite(part) else "any part"

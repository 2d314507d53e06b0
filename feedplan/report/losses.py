"""Computes the time in which each limit is active, and the source lines that lose most time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.report.activity import Activity


@dataclass(frozen=True)
class Share:
    """A limit, the time in which it is active [s], and its share of the whole time (0 to 1)."""

    limit: str
    time: float
    part: float


@dataclass(frozen=True)
class SlowLine:
    """A source line that takes longer than its feed and the axis velocities would allow.

    `time` spent and `lost` [s]; mean `speed`, and the mean speed `wanted` that feed and axis velocities allow
    [mm/s, deg/s if the line mostly `turns`]; the `limit` that causes the greatest part of the loss, and this
    `part` (0 to 1); `stops` if the tool stops at an end of the line; `rapid` if no feed is programmed.
    """

    line: int
    time: float
    lost: float
    speed: float
    wanted: float
    limit: str
    part: float
    stops: bool
    rapid: bool
    turns: bool


def time_per_limit(problem: Problem, activity: Activity) -> list[Share]:
    """The time in which each limit is active, the longest first; dwells are listed like a limit."""
    times = np.bincount(activity.active, activity.weight, len(activity.names)).tolist()
    rows = [*zip(activity.names, times, strict=True), ("dwell", problem.path.pauses)]
    total = sum(time for _, time in rows)
    return sorted(
        (Share(name, time, time / total) for name, time in rows if time > 0), key=lambda share: -share.time
    )


def slowest_lines(
    problem: Problem, profile: SpeedProfile, activity: Activity, count: int = 20
) -> list[SlowLine]:
    """The source lines that lose most time, the greatest loss first."""
    if len(profile) == 0:
        return []
    path = problem.path
    lines, row_of_piece = np.unique(path.line, return_inverse=True)
    row = row_of_piece[activity.piece]
    time, lost = (np.bincount(row, values, len(lines)) for values in (activity.weight, activity.lost))
    # Rounded, so that lines whose losses differ only by rounding keep the program's order.
    worst = np.argsort(-np.round(lost / time.sum(), 12), kind="stable")[:count]
    worst = worst[lost[worst] > 1e-9 * time.sum()]
    ends = np.zeros(len(lines), dtype=bool)
    ends[row_of_piece[np.concatenate((path.runs[:-1], path.runs[1:] - 1))]] = True
    result = []
    for index in worst.tolist():
        own = np.flatnonzero(row == index)
        pieces = np.flatnonzero(row_of_piece == index)
        costs = np.bincount(activity.active[own], activity.lost[own])
        active = int(costs.argmax())
        # The speed is in mm/s or deg/s, depending on whether the line moves the tool or only turns it for
        # longer.
        turning = problem.tool_motion.turns[activity.piece[own]]
        turns = bool(activity.weight[own][turning].sum() > 0.5 * time[index])
        own = own[turning == turns]
        length, spent = (activity.speed[own] * activity.weight[own]).sum(), activity.weight[own].sum()
        needed = spent - activity.lost[own].sum()
        result.append(
            SlowLine(
                line=int(lines[index]),
                time=float(time[index]),
                lost=float(lost[index]),
                speed=float(length / spent),
                wanted=float(length / needed) if needed > 0 else 0.0,
                limit=activity.names[active],
                part=min(1.0, float(costs[active] / lost[index])),
                stops=bool(ends[index]),
                rapid=bool(np.isinf(path.feed[pieces]).all()),
                turns=turns,
            )
        )
    return result

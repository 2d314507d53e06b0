"""Where the time goes: how long each limit is active, and the source lines that lose most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.profile import ArcKind, SpeedProfile
from feedplan.report.limits import arc_lengths, least_times


@dataclass(frozen=True)
class Share:
    """A limit, the time it is active [s], and that as a part of the whole, 0 to 1."""

    limit: str
    time: float
    part: float


@dataclass(frozen=True)
class SlowLine:
    """A source line that takes longer than its feed and the axis velocities ask for.

    `time` spent and `lost` [s], mean `speed` and the mean speed `wanted` [mm/s], the `limit` that costs most
    and its part of the loss; `stops` where the tool stands still at an end of the line, `rapid` where no feed
    is programmed.
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


def limit_names(problem: Problem, profile: SpeedProfile) -> tuple[NDArray[np.int64], list[str]]:
    """The number of the active limit of each arc, and the limits' names."""
    codes, of_arc = np.unique(profile.kind.astype(np.int64) * 256 + profile.axis, return_inverse=True)
    texts = [_name(problem, int(code) // 256, int(code) % 256) for code in codes]
    names = sorted(set(texts))
    number = np.array([names.index(text) for text in texts], dtype=np.int64)
    return number[of_arc], names


def _name(problem: Problem, kind: int, axis: int) -> str:
    letter = f"{problem.axes[axis]} " if axis < len(problem.axes) else ""
    # An arc with p held is held by an axis too: at its acceleration limit while the path turns under it.
    if kind in (ArcKind.AXIS_ACCELERATION, ArcKind.PARAMETER_ACCELERATION):
        return f"{letter}acceleration"
    if kind == ArcKind.AXIS_VELOCITY:
        return f"{letter}velocity"
    names = {
        ArcKind.FEED: "feed",
        ArcKind.CHORD: "chord error",
        ArcKind.SPEED_LINE: "acceleration along the path",
    }
    return names.get(ArcKind(kind), "motion of limited jerk")


def time_per_limit(problem: Problem, profile: SpeedProfile) -> list[Share]:
    """The time each limit is active, the longest first; dwells stand as a limit of their own."""
    number, names = limit_names(problem, profile)
    times = np.bincount(number, weights=profile.duration, minlength=len(names))
    dwell = problem.path.pauses
    total = float(times.sum()) + dwell
    rows = [*zip(names, times.tolist(), strict=True), *([("dwell", dwell)] if dwell > 0 else [])]
    shares = [Share(name, time, time / total if total > 0 else 0.0) for name, time in rows]
    return sorted(shares, key=lambda share: -share.time)


def slowest_lines(problem: Problem, profile: SpeedProfile, count: int = 20) -> list[SlowLine]:
    """The source lines that lose most time, the worst first."""
    if len(profile) == 0:
        return []
    path = problem.path
    piece = profile.piece.astype(np.int64)
    lines, row = np.unique(path.line[piece], return_inverse=True)
    length = arc_lengths(problem, profile)
    least = least_times(problem, profile)
    time = np.bincount(row, weights=profile.duration)
    wanted = np.bincount(row, weights=least)
    distance = np.bincount(row, weights=length)
    lost = time - wanted
    worst = np.argsort(-lost, kind="stable")[:count]
    worst = worst[lost[worst] > 1e-9 * time.sum()]

    number, names = limit_names(problem, profile)
    ends = np.zeros(len(lines), dtype=bool)
    at_rest = np.concatenate((profile.runs[:-1], np.maximum(profile.runs[1:] - 1, 0)))
    ends[row[at_rest[at_rest < len(profile)]]] = True
    result = []
    for index in worst:
        arcs = np.flatnonzero(row == index)
        costs = np.bincount(number[arcs], weights=profile.duration[arcs] - least[arcs])
        active = int(costs.argmax())
        result.append(
            SlowLine(
                line=int(lines[index]),
                time=float(time[index]),
                lost=float(lost[index]),
                speed=float(distance[index] / time[index]),
                wanted=float(distance[index] / wanted[index]),
                limit=names[active],
                part=min(1.0, float(costs[active] / lost[index])),
                stops=bool(ends[index]),
                rapid=bool(np.isinf(path.feed[piece[arcs]]).all()),
            )
        )
    return result

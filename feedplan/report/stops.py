"""Counts full stops by cause: their number, the time for which the tool waits, and the time lost by braking
and starting [s]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.program.program import PathControl, Program, StopCause
from feedplan.report.activity import ACTIVE, Activity

ENDS = "start and end"
TURN_BACK = "turning back"
CORNER = "corner that cannot be rounded"
EXACT_CORNER = "corner on the exact path (G61, cycles)"
CONTROL = "change between G64 and the exact path (G61, G61.1, cycles)"
OTHER = "other"
_ASKED = {
    StopCause.TOOL: "tool change (M6)",
    StopCause.PAUSE: "programmed stop (M0, M1, M60)",
    StopCause.DWELL: "dwell (G4)",
    StopCause.SWITCH: "spindle, coolant and the like",
    StopCause.CHANGE: "change of mode or tool length (G43.4, G43.5, G49)",
}
_EXACT_STOP = "exact stop (G61.1)"

# A path that turns by more than this [deg] turns back; by less than this it has no corner.
_BACK, _STRAIGHT = 135.0, 0.5


@dataclass(frozen=True)
class Stops:
    """`count` stops of one `cause`. The tool waits there for `pause` [s] in total; braking and starting lose
    `lost` [s] compared with the speed that feeds and axis velocities alone would allow."""

    cause: str
    count: int
    pause: float
    lost: float


def stops_by_cause(problem: Problem, program: Program | None, activity: Activity) -> list[Stops]:
    """The stops of a path by cause, the greatest loss first; start and end of the path are two stops.

    The tool stops between runs, and without a pause where pieces of a run meet at rest.
    """
    path = problem.path
    if len(path.runs) < 2:
        return []
    # The first piece after each stop, and the number of pieces.
    rest = problem.junction_speed == 0.0
    rest[path.runs] = True
    rests = np.flatnonzero(rest)
    causes = [ENDS, *_causes(problem, program, rests[1:-1]), ENDS]
    pauses = np.zeros(len(rests))
    pauses[np.searchsorted(rests, path.runs)] = [path.start_dwell, *path.dwell]
    before, after = _slow_parts(activity, rests)
    lost = np.concatenate(([0.0], before)) + np.concatenate((after, [0.0]))
    found = []
    for cause in dict.fromkeys(causes):
        own = [k for k, other in enumerate(causes) if other == cause]
        found.append(Stops(cause, len(own), float(pauses[own].sum()), float(lost[own].sum())))
    return sorted(found, key=lambda stops: -(stops.pause + stops.lost))


def _causes(problem: Problem, program: Program | None, first: Integers) -> list[str]:
    """The causes of the stops before these pieces of the path."""
    path, last = problem.path, first - 1
    turn = _turns(problem, last, first)
    control = program.control if program is not None and len(program) else None
    result = []
    for k, (before, after) in enumerate(zip(path.move[last, 1], path.move[first, 0], strict=True)):
        cause = OTHER
        if program is not None and control is not None and program.stop_cause is not None:
            asked = StopCause(int(program.stop_cause[before : max(after, before + 1)].max()))
            if asked in _ASKED:
                result.append(_ASKED[asked])
                continue
            if control[before] == PathControl.EXACT_STOP:
                result.append(_EXACT_STOP)
                continue
        if turn[k] > _BACK:
            cause = TURN_BACK
        elif turn[k] > _STRAIGHT:
            exact = control is not None and PathControl.EXACT_PATH in control[[before, after]]
            cause = EXACT_CORNER if exact else CORNER
        elif control is not None and control[before] != control[after]:
            cause = CONTROL
        result.append(cause)
    return result


def _turns(problem: Problem, last: NDArray[np.integer], first: NDArray[np.integer]) -> Floats:
    """The angle between the end of one piece and the start of another [deg]."""
    curve = problem.path.curve
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (
            tangent / np.linalg.norm(tangent, axis=1)[:, None]
            for tangent in (
                curve.evaluate(last, curve.width[last], 1)[1],
                curve.evaluate(first, np.zeros(len(first)), 1)[1],
            )
        )
    half = np.linalg.norm(one - other, axis=1) / 2.0
    return np.asarray(np.degrees(2.0 * np.arcsin(np.clip(np.nan_to_num(half), 0.0, 1.0))))


def _slow_parts(activity: Activity, rests: Integers) -> tuple[Floats, Floats]:
    """Time lost before the end and after the start of each part between two stops [s].

    The part after a start ends where the tool reaches a feed or an axis velocity, or first slows down; the
    part before a stop is its mirror image.
    """
    lost, pace = activity.lost, activity.pace
    total = np.concatenate(([0.0], np.cumsum(lost)))
    start, end = (np.searchsorted(activity.piece, places, "left") for places in (rests[:-1], rests[1:]))
    slower = np.append(pace[1:] < pace[:-1], True)
    faster = np.insert(pace[1:] > pace[:-1], 0, True) if len(pace) else np.empty(0, bool)
    risen = np.append(np.flatnonzero((pace >= ACTIVE) | slower), len(pace))
    fallen = np.insert(np.flatnonzero((pace >= ACTIVE) | faster), 0, -1)
    reach = np.minimum(risen[np.searchsorted(risen, start)] + 1, end)
    back = np.maximum(fallen[np.searchsorted(fallen, end, "left") - 1], reach)
    return total[end] - total[np.minimum(back, end)], total[reach] - total[start]

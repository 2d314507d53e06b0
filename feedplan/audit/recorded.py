"""Checks recorded velocities, accelerations and jerks of setpoints against each other.

The change of the velocity over some steps, divided by their time, is the mean acceleration. It lies between
the least and the greatest acceleration recorded at these setpoints, except for accelerations that begin and
end within one step and are recorded nowhere. These change the velocity by one or two times acceleration ×
period, so the mean over `STEPS` steps may be outside the recorded range by `SHARE` of the limit. The same
holds for the change of the acceleration and the recorded jerk, where jerk is limited.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats
from feedplan.audit.worst import Findings, Worst
from feedplan.progress import Listener, tell

# Number of steps of the mean: the ramps of a machine take longer than this, or its feed is slow.
STEPS = 16

# Allowed distance of the mean from the recorded range, as a share of the limit; over 16 steps this is a
# change of velocity of four times acceleration × period.
SHARE = 0.25

# Number of steps whose means are computed at once.
_AT_ONCE = 100_000


def audit_recorded(
    name: str,
    t: Floats,
    rate: Floats,
    change: Floats,
    limit: Floats,
    jump: Floats,
    line: NDArray[np.int32],
    progress: Listener | None = None,
) -> Findings:
    """The greatest distance of the mean change of `rate` from the recorded range of `change`, as the check
    `name`.

    `t` (n,) [s]; `rate` (n, axes) is a velocity or acceleration, `change` (n, axes) its recorded derivative
    by time, `limit` (axes,) the limit of `change`, `jump` (axes,) the allowed jump of `rate` in each step.
    `line` (n,) are source lines. `progress` is called with the finished share.
    """
    worst = Worst()
    for start in range(0, len(t) - STEPS, _AT_ONCE):
        tell(progress, start / len(t))
        part = slice(start, start + _AT_ONCE + STEPS)
        time, values = t[part], change[part]
        span = (time[STEPS:] - time[:-STEPS])[:, None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            mean = (rate[part][STEPS:] - rate[part][:-STEPS]) / span
            off = np.maximum(_over_steps(np.minimum, values) - mean, mean - _over_steps(np.maximum, values))
            allowed = SHARE * limit + jump * STEPS / span
        middle = slice(STEPS // 2, STEPS // 2 + len(off))
        for axis in range(off.shape[1]):
            worst.offer(name, off[:, axis], allowed[:, axis], time[middle], line[part][middle], axis)
    return worst.findings()


def _over_steps(pick: np.ufunc, values: Floats) -> Floats:
    """Least or greatest values (by `pick`) over each `STEPS` + 1 consecutive rows."""
    reach = 1
    while reach < STEPS:
        values = pick(values[:-reach], values[reach:])
        reach *= 2
    return np.asarray(pick(values[:-1], values[1:]))

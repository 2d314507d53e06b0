"""Recorded velocities, accelerations and jerks of setpoints against each other.

The mean of an acceleration over some steps is the change of the velocity over their time. It lies among the
accelerations recorded at these setpoints, as far as those show what happens between them: within one step an
acceleration may come and go, and be recorded nowhere. That changes the velocity by one or two accelerations
times a period, so the mean over `STEPS` steps may leave the recorded range by `SHARE` of the limit. The same
holds for the acceleration and the jerk, where the jerk is limited.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats
from feedplan.audit.worst import Findings, Worst
from feedplan.progress import Listener, tell

# Steps of the mean: the ramps of a machine are longer, or its feed is slow.
STEPS = 16

# What the mean may leave the recorded range by, as a share of the limit: four accelerations times a period.
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
    """The greatest contradiction, as the check `name`.

    `t` (n,) [s]; `rate` (n, axes) and what is recorded as its `change` by time, which the `limit` (axes,)
    holds for; `jump` (axes,) is what a rate may jump by in each step. `line` (n,) source lines.
    `progress` is called with the part done.
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
    """The least or greatest of each `STEPS` + 1 consecutive rows."""
    reach = 1
    while reach < STEPS:
        values = pick(values[:-reach], values[reach:])
        reach *= 2
    return np.asarray(pick(values[:-1], values[1:]))

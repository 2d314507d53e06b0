"""Plain differences of setpoints, compared with limits and feeds without any code of the audit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.machine.machine import Machine
from feedplan.setpoints import SetpointChunk
from tests.planners.posted_programs import LINEAR, Posted

Array = NDArray[np.float64]

# Allowed relative excess of a limit, the same as in the audit.
SHARE = 1e-6
# Rounding error of a position, in units in the last place.
ROUNDING = 4.0
NAMES = {1: "velocity", 2: "acceleration", 3: "jerk"}


def exceeded(points: SetpointChunk, machine: Machine, period: float, jerk: bool) -> list[str]:
    """A sentence for each direction of an axis whose first, second or (with `jerk`) third differences exceed
    the limit.

    Setpoints are a period apart; the rounding error of the greatest position is allowed.
    """
    found = []
    for column, name in enumerate(points.axes):
        axis = machine.axis(name)
        x = points.position[:, column]
        last_place = ROUNDING * float(np.spacing(np.abs(x).max(initial=0.0)))
        limits = {1: axis.velocity_range, 2: axis.acceleration_range, 3: (-axis.max_jerk, axis.max_jerk)}
        for order, ends in limits.items():
            if (order == 3 and not jerk) or len(x) <= order:
                continue
            change = np.diff(x, order) / period**order
            for worst, limit in ((-float(change.min()), -ends[0]), (float(change.max()), ends[1])):
                if worst > limit * (1 + SHARE) + 2**order * last_place / period**order:
                    found.append(f"{NAMES[order]} of {name}: {worst:.6g} of {limit:.6g}")
    return found


def too_fast(points: SetpointChunk, posted: Posted, period: float) -> list[str]:
    """A sentence if a step is faster than all lines between its two setpoints allow."""
    lines = points.line
    low, high = np.minimum(lines[:-1], lines[1:]), np.maximum(lines[:-1], lines[1:])
    found = []
    for word, letters, allowed, others in (
        ("feed", LINEAR, posted.linear, posted.rotary),
        ("turning", "ABC", posted.rotary, posted.linear),
    ):
        columns = [k for k, name in enumerate(points.axes) if name in letters]
        if not columns:
            continue
        step = np.linalg.norm(np.diff(points.position[:, columns], axis=0), axis=1)
        spacing = float(np.spacing(np.abs(points.position[:, columns]).max(initial=0.0)))
        limit = np.full(int(lines.max(initial=0)) + 2, -np.inf)
        for line, speed in allowed.items():
            limit[min(line, len(limit) - 1)] = speed
        for line in others:
            limit[min(line, len(limit) - 1)] = np.inf
        most = _greatest_between(limit, low, high)
        excess = step / period - most * (1 + SHARE) - 4 * ROUNDING * spacing / period
        if len(excess) and excess.max() > 0:
            k = int(excess.argmax())
            found.append(f"{word} {step[k] / period:.6g} of {most[k]:.6g} in lines {low[k]} to {high[k]}")
    return found


def beside_the_path(points: SetpointChunk, posted: Posted) -> list[str]:
    """A sentence if a setpoint is farther from the program's lines than their tolerance (linear axes
    only)."""
    if posted.corners is None or any(name not in LINEAR for name in points.axes):
        return []
    start, end = posted.corners[:-1], posted.corners[1:]
    worst = 0.0
    for part in np.array_split(points.position, max(len(points) // 500, 1)):
        to = part[:, None, :] - start[None]
        way = end - start
        length_sq = (way**2).sum(axis=1)
        share = np.clip((to * way).sum(axis=2) / length_sq, 0.0, 1.0)
        worst = max(worst, float(np.sqrt(((to - share[..., None] * way) ** 2).sum(axis=2)).min(axis=1).max()))
    # Lines with tolerance 0 are met up to the rounding of coordinates.
    allowed = posted.tolerance * (1 + SHARE) + 1e-12 * float(np.abs(posted.corners).max())
    return [f"{worst:.6g} mm beside the program of {posted.tolerance:.6g}"] if worst > allowed else []


def _greatest_between(limit: Array, low: NDArray[np.int32], high: NDArray[np.int32]) -> Array:
    """max(limit[low..high]) for each pair, both ends included; lines without motion have −inf."""
    most = np.maximum(limit[low], limit[high])
    wide = np.flatnonzero(high - low > 1)
    for k in wide:
        most[k] = limit[low[k] : high[k] + 1].max()
    return most

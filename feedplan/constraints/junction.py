"""Speed limits where pieces meet: stops at run ends, an allowed velocity jump at corners."""

from __future__ import annotations

from functools import reduce

import numpy as np

from feedplan.arrays import Floats
from feedplan.geometry.corners import Corners
from feedplan.geometry.joints import tangent_jumps
from feedplan.geometry.path import Path


def junction_limit(path: Path, max_velocity_jump: Floats) -> Floats:
    """Greatest speed (n + 1,) [mm/s] at the ends of the pieces.

    It is 0 at the ends of runs. Within a run, where the unit tangent jumps by ΔT, it is the minimum over the
    axes of `max_velocity_jump` [mm/s] / |ΔT|; it is infinite where the tangent does not jump. A cusp whose
    tangents agree is left to the planner. On a smooth path no jump is allowed: the tool rests where the path
    turns back.
    """
    jump = tangent_jumps(path.curve)
    if path.corners is Corners.SMOOTH:
        max_velocity_jump = np.zeros_like(max_velocity_jump)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_axis = np.where(jump > 0, max_velocity_jump / jump, np.inf)
    limit = np.full(len(path) + 1, np.inf)
    # By axis, because NumPy is slow along short rows.
    limit[1:-1] = reduce(np.minimum, by_axis.T)
    limit[path.runs] = 0.0
    return limit

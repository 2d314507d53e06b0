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

    0 at the ends of runs. Within a run, where the unit tangent jumps by ΔT, min over the axes of
    `max_velocity_jump` [mm/s] / |ΔT|, and infinite where it does not jump. A cusp in which the direction of
    motion agrees is left to the planner. A smooth path rests where it turns back.
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

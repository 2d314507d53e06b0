"""The planning problem: a path with every limit that holds on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.geometry.path import Path


@dataclass(frozen=True)
class Problem:
    """Minimise the time along `path` under these limits.

    Per axis: `max_velocity` [mm/s], `max_acceleration` [mm/s²], `max_jerk` [mm/s³] (may be infinite). Per
    piece: `feed` (n,) greatest speed [mm/s], finite. At piece ends: `junction_speed` (n + 1,) greatest speed
    [mm/s]: 0 at a stop, infinite where nothing but the other limits holds. `chord_tolerance` [mm] and
    `period` [s] limit the speed on a curve of radius ρ to (2/T)·√(2ρδ − δ²); an infinite tolerance switches
    that off. `start_speed` and `end_speed` [mm/s] hold at the two ends of the path.
    """

    path: Path
    max_velocity: NDArray[np.float64]
    max_acceleration: NDArray[np.float64]
    max_jerk: NDArray[np.float64]
    feed: NDArray[np.float64]
    junction_speed: NDArray[np.float64]
    chord_tolerance: float
    period: float
    start_speed: float = 0.0
    end_speed: float = 0.0

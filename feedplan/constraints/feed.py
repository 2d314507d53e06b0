"""The feed limit: the commanded feed of each piece, overridden where the user asks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from feedplan.errors import InputError
from feedplan.geometry.path import Path


def feed_limit(path: Path, greatest: float, feed: float | None, override: float) -> NDArray[np.float64]:
    """Greatest speed of each piece (n,) [mm/s], at most `greatest`, which is what a rapid gets."""
    if not (math.isfinite(override) and override > 0):
        raise InputError(f"feed override is {override}: give a positive factor (1 is the programmed feed)")
    if feed is not None and not (math.isfinite(feed) and feed > 0):
        raise InputError(f"feed is {feed} mm/s: give a positive feed")
    commanded = path.feed if feed is None else np.where(np.isfinite(path.feed), feed, path.feed)
    return np.minimum(commanded * override, greatest)

"""Faults planted in whole profiles for the tests of the audit, and the checks that fail."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.audit import Audit
from feedplan.profile import SpeedProfile

# The first five are finite and not negative, so the audit's first check of signs and sizes accepts them.
STRANGE = np.array([0.0, 5e-324, 1e-310, 1e-160, 1e160, -0.0, -1.0, 1e308, math.inf, math.nan])


def broken(result: Audit) -> set[tuple[str, str | None]]:
    """Name and axis of the checks that fail."""
    return {(check.name, check.axis) for check in result.broken}


def changed(array: NDArray[Any], place: Any, value: Any) -> NDArray[Any]:
    """A copy of an array with one element replaced by a value, or by a function of it."""
    copy = array.copy()
    copy[place] = value(copy[place]) if callable(value) else value
    return copy


def faster(profile: SpeedProfile, factor: float = 1.001) -> SpeedProfile:
    """The whole profile with p times `factor` and matching durations."""
    return replace(
        profile,
        p0=profile.p0 * factor,
        p1=profile.p1 * factor,
        value=profile.value * factor,
        duration=profile.duration / math.sqrt(factor),
    )


def rubbish(
    rng: np.random.Generator, profile: SpeedProfile, share: float, values: NDArray[np.float64] = STRANGE
) -> dict[str, NDArray[Any]]:
    """The numeric columns; each entry is replaced with probability `share` by a random one of `values`."""
    columns = {}
    for name in ("value", "u0", "u1", "p0", "p1", "duration"):
        column = getattr(profile, name)
        hit = rng.random(len(column)) < share
        columns[name] = np.where(hit, rng.choice(values, len(column)), column)
    return columns

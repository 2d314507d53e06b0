"""How smoothly the pieces of a curve meet, and evaluation by the parameter from the curve's start."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan.curves.composite import CompositeCurve

# Derivatives are equal within SAME of their expected size, points within GAP [mm].
SAME, GAP = 1e-9, 1e-6


class Joint(IntEnum):
    """The continuity where two pieces meet; each level includes the ones before it."""

    APART = 0
    CORNER = 1
    TANGENT = 2
    C1 = 3
    C2 = 4
    C3 = 5


def joints(curve: CompositeCurve, closed: bool = False) -> list[Joint]:
    """The continuity where neighbouring pieces meet; with `closed` also from the last to the first."""
    last = np.arange(len(curve) if closed else len(curve) - 1)
    first = (last + 1) % len(curve)
    before = curve.evaluate(last, curve.width[last], 3)
    after = curve.evaluate(first, np.zeros(len(first)), 3)
    extent = np.ptp(curve.control_points, axis=0).max()
    rates = curve.degree.max() / np.minimum(curve.width[last], curve.width[first])
    sizes = extent * rates[:, None] ** np.arange(4)
    return [_joint(before[:, k], after[:, k], size) for k, size in enumerate(sizes)]


def _joint(before: NDArray[np.float64], after: NDArray[np.float64], size: NDArray[np.float64]) -> Joint:
    apart = np.linalg.norm(after - before, axis=1)
    if apart[0] > GAP:
        return Joint.APART
    equal = int(np.argmin([*(apart <= SAME * size)[1:], False]))
    if equal:
        return Joint(Joint.TANGENT + equal)
    one, other = before[1], after[1]
    along = one @ other / (np.linalg.norm(one) * np.linalg.norm(other))
    return Joint.TANGENT if along > 1.0 - 1e-12 else Joint.CORNER


def breakpoints(curve: CompositeCurve) -> NDArray[np.float64]:
    """The parameter from the start of the curve at the ends of all pieces (n + 1,)."""
    return np.concatenate([[0.0], np.cumsum(curve.width)])


def at(curve: CompositeCurve, parameter: ArrayLike, order: int = 0) -> NDArray[np.float64]:
    """C and its derivatives at parameters (m,) from the start; at a joint, of the piece that starts there."""
    breaks, x = breakpoints(curve), np.asarray(parameter)
    piece = np.searchsorted(breaks[1:-1], x, side="right")
    return curve.evaluate(piece, np.clip(x - breaks[piece], 0.0, curve.width[piece]), order)


def is_closed(curve: CompositeCurve) -> bool:
    """Whether the curve ends where it starts, to rounding."""
    first, last = curve.control_points[[0, -1]]
    return bool(np.abs(last - first).max() <= 1e-12 * np.abs(curve.control_points).max())

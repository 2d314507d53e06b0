"""The axes that a feed counts along: X, Y, Z, else U, V, W, else all others together, as in RS-274.

The others are the rotary axes of a program, or the axes with other names of a path without a program.

A piece of a path keeps the feeds of the moves that it follows. A blend may also move axes that none of these
moves move; along those axes it keeps the feeds of the next moves on both sides. So where a move of X, Y, Z
and one of rotary axes alone are blended, both feeds hold on the whole blend.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats, Integers
from feedplan.curves.composite import CompositeCurve

GROUPS = 3

_LETTERS = (("X", "Y", "Z"), ("U", "V", "W"))


def feed_groups(axes: tuple[str, ...]) -> Flags:
    """Whether each axis belongs to each group (3, axes): X, Y, Z; U, V, W; all others."""
    linear, parallel = ([name in letters for name in axes] for letters in _LETTERS)
    others = [not (x or u) for x, u in zip(linear, parallel, strict=True)]
    return np.array([linear, parallel, others], dtype=np.bool_)


def moved_groups(axes: tuple[str, ...], moving: Flags) -> Flags:
    """Whether each group has a moving axis in each move (m, 3); `moving` (m, axes) says which axes move."""
    return np.asarray(np.logical_or.reduce(moving[:, None, :] & feed_groups(axes), axis=2), dtype=np.bool_)


def moving_axes(curve: CompositeCurve) -> Flags:
    """Whether each piece moves each axis (n, axes)."""
    control, first = curve.control_points, curve.offsets[:-1]
    return np.asarray(np.maximum.reduceat(control, first) > np.minimum.reduceat(control, first))


def leading_group(axes: tuple[str, ...], moving: Flags) -> Integers:
    """Index of the group that the feed of each move counts along (m,), −1 where nothing moves."""
    moves = moved_groups(axes, moving)
    return np.where(np.logical_or.reduce(moves, axis=1), moves.argmax(axis=1), -1)


def told_apart(axes: tuple[str, ...], moving: Flags, feed: Floats) -> Floats:
    """The feeds (m,), where equal feeds along different groups are made different by units in the last place,
    so that the path builder treats them as a change of feed."""
    if _are_one_group(axes):
        return feed
    group = leading_group(axes, moving)
    for number in range(1, GROUPS):
        feed = np.where(group >= number, np.nextafter(feed, np.inf), feed)
    return feed


def group_feeds(
    axes: tuple[str, ...],
    moving: Flags,
    feed: Floats,
    curve: CompositeCurve,
    covered: Integers,
) -> Floats | None:
    """The greatest speed of each piece along each group of axes (n, 3) [mm/s, deg/s]; infinite: no limit.

    `moving` (m, axes) says which axes each move moves, `feed` (m,) is its feed, infinite on rapids; `covered`
    (n, 2) are the first and the last move that each piece of `curve` follows. None where all axes are in one
    group.
    """
    if _are_one_group(axes):
        return None
    moves = moved_groups(axes, moving)
    limit = np.where(moves & (np.cumsum(moves, axis=1) == 1), feed[:, None], np.inf)
    own = _over(np.minimum, limit, covered, np.inf)
    foreign = moved_groups(axes, moving_axes(curve)) & ~_over(np.logical_or, moves, covered, False)
    # The next moves on both sides that move an axis; the last row means that there is no such move.
    limit = np.concatenate([limit, np.full((1, GROUPS), np.inf)])
    goes = np.append(np.flatnonzero(np.logical_or.reduce(moves, axis=1)), len(moves))
    first, last = covered.T
    before = goes[np.searchsorted(goes, first) - 1]
    after = goes[np.minimum(np.searchsorted(goes, last, side="right"), len(goes) - 1)]
    beside = np.minimum(limit[before], limit[after])
    return np.asarray(np.where(foreign, np.minimum(own, beside), own))


def leading_feed(by_group: Floats, otherwise: Floats) -> Floats:
    """The feed along the first group with a finite feed (n,), `otherwise` where no group has one."""
    finite = np.isfinite(by_group)
    first = np.take_along_axis(by_group, finite.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where(np.logical_or.reduce(finite, axis=1), first, otherwise)


def _are_one_group(axes: tuple[str, ...]) -> bool:
    return int(np.logical_or.reduce(feed_groups(axes), axis=1).sum()) == 1


def _over(function: np.ufunc, values: NDArray[Any], covered: Integers, nothing: float | bool) -> NDArray[Any]:
    """The function over the rows of `values` from the first to the last covered move of each piece (n, …)."""
    padded = np.concatenate([values, np.full((1, *values.shape[1:]), nothing, dtype=values.dtype)])
    ends = np.stack([covered[:, 0], covered[:, 1] + 1], axis=1).ravel()
    return np.asarray(function.reduceat(padded, ends, axis=0)[::2])

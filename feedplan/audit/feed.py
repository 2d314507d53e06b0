"""Speed limits of each piece from the words of its program: the axes that a block moves, and its feed.

A feed holds along X, Y and Z where the block moves one of these, else along U, V and W, else for all other
axes together. A piece keeps the feeds of all moves that it follows. Along axes that none of these moves, it
keeps the feeds of the neighbouring moves: on a blend the feeds of both blocks hold.
"""

from __future__ import annotations

import numpy as np

from feedplan.arrays import Flags, Floats
from feedplan.constraints.problem import Problem
from feedplan.program.program import Program
from feedplan.progress import Listener, tell

# Indices of the speeds: 0 is X, Y, Z; 1 is U, V, W; 2 is the other axes; 3 (`ALL`) is all axes together, for
# paths without a program.
_LETTERS = (("X", "Y", "Z"), ("U", "V", "W"))
ALL = 3


def feed_axes(names: tuple[str, ...]) -> list[list[float]]:
    """Whether each axis (column) counts in each speed (row), 1 or 0 (4, axes)."""
    linear, parallel = ([float(name in letters) for name in names] for letters in _LETTERS)
    return [
        linear,
        parallel,
        [1.0 - x - u for x, u in zip(linear, parallel, strict=True)],
        [1.0] * len(names),
    ]


def feed_limits(problem: Problem, program: Program | None, progress: Listener | None = None) -> Floats:
    """The limit of each speed on each piece (n, 4) [mm/s, deg/s]; infinite where it is not limited.

    Without a program the limits are the problem's feeds: along the axes that the piece moves if the problem
    has `feed_share`, else along all axes together. `progress` is called when half of the work is done.
    """
    path = problem.path
    # Stored speed by speed, (4, n): much faster in NumPy than rows of four numbers.
    limits = np.full((4, len(path)), np.inf)
    groups = np.array(feed_axes(path.axes), dtype=bool)[:ALL]
    if program is not None:
        moves = _any(program.moving(), groups)
        goes = np.logical_or.reduce(moves)
        first, last = np.clip(path.move.T, 0, len(program) - 1)
        ends = np.stack([first, last + 1], axis=1).ravel()
        # The nearest blocks before and after that move anything; the index after the last one means no block.
        leads = np.append(np.flatnonzero(goes), len(program))
        count = np.concatenate([[0], np.cumsum(goes)])
        tell(progress, 0.5)
        before, after = leads[count[first] - 1], leads[count[last + 1]]
        feeds, led = problem.request.of(program.feed), np.zeros(len(program), dtype=np.bool_)
        for group in np.flatnonzero(np.logical_or.reduce(moves, axis=1)):
            feed = np.append(np.where(moves[group] & ~led, feeds, np.inf), np.inf)
            led |= moves[group]
            own = np.minimum.reduceat(feed, ends)[::2]
            foreign = ~np.logical_or.reduceat(np.append(moves[group], False), ends)[::2]
            beside = np.minimum(feed[before], feed[after])
            limits[group] = np.where(foreign, np.minimum(own, beside), own)
    elif problem.feed_share is not None:
        control, start = path.curve.control_points, path.curve.offsets[:-1]
        moves = _any(np.maximum.reduceat(control, start) > np.minimum.reduceat(control, start), groups)
        limits[moves.argmax(axis=0), np.arange(len(path))] = problem.feed
    if problem.feed_share is None:
        limits[ALL] = problem.feed
    else:
        limits[ALL] = np.where(np.isinf(limits).all(axis=0), problem.feed, np.inf)
    return np.ascontiguousarray(limits.T)


def _any(moving: Flags, groups: Flags) -> Flags:
    """Whether each group has a moving axis in each row (3, n)."""
    moves = np.zeros((len(groups), len(moving)), dtype=np.bool_)
    for group, axis in np.argwhere(groups):
        moves[group] |= moving[:, axis]
    return moves

"""How fast the tool may go on each piece by the words of its program: which axes a block moves, and its feed.

A feed holds along X, Y and Z where the block moves one of these, else along U, V and W, else for all other
axes together. A piece is held to the feeds of all moves that it follows, and to those of its neighbours along
axes that its own moves do not move: on a blend both blocks count.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.program.program import Program

# X, Y, Z; U, V, W; the other axes; all together, where no program says more.
_LETTERS = ("XYZ", "UVW")
ALL = 3


def feed_axes(names: tuple[str, ...]) -> list[list[float]]:
    """Which axes are in which speed, 1 or 0 (4, axes)."""
    linear, parallel = ([float(name in letters) for name in names] for letters in _LETTERS)
    return [
        linear,
        parallel,
        [1.0 - x - u for x, u in zip(linear, parallel, strict=True)],
        [1.0] * len(names),
    ]


def feed_limits(problem: Problem, program: Program | None) -> NDArray[np.float64]:
    """The greatest of each speed on each piece (n, 4) [mm/s, deg/s]; infinite where it is not limited.

    Without a program the numbers are the problem's: along the axes that the piece moves if the problem counts
    axes by shares, else in all axes together.
    """
    path = problem.path
    limits = np.full((len(path), 4), np.inf)
    groups = np.array(feed_axes(path.axes), dtype=bool)[:ALL]
    if program is not None:
        moves = _any(program.moving(), groups)
        feed = np.full((len(program), ALL), np.inf)
        leads = np.flatnonzero(np.logical_or.reduce(moves, axis=1))
        feed[leads, moves[leads].argmax(axis=1)] = problem.request.of(program.feed)[leads]
        beyond = np.full((1, ALL), np.inf)
        feed, moves = np.concatenate([feed, beyond]), np.concatenate([moves, beyond < 0.0])
        first, last = np.clip(path.move.T, 0, len(program) - 1)
        ends = np.stack([first, last + 1], axis=1).ravel()
        own = np.minimum.reduceat(feed, ends, axis=0)[::2]
        foreign = ~np.logical_or.reduceat(moves, ends, axis=0)[::2]
        # The blocks before and after that move anything; the last row stands for none.
        leads = np.append(leads, len(program))
        before = leads[np.searchsorted(leads, first) - 1]
        after = leads[np.minimum(np.searchsorted(leads, last, side="right"), len(leads) - 1)]
        beside = np.minimum(feed[before], feed[after])
        limits[:, :ALL] = np.where(foreign, np.minimum(own, beside), own)
    elif problem.feed_share is not None:
        control, start = path.curve.control_points, path.curve.offsets[:-1]
        moves = _any(np.maximum.reduceat(control, start) > np.minimum.reduceat(control, start), groups)
        limits[np.arange(len(path)), moves.argmax(axis=1)] = problem.feed
    every = np.logical_and.reduce(np.isinf(limits), axis=1)
    if problem.feed_share is None:
        every[:] = True
    limits[every, ALL] = problem.feed[every]
    return limits


def _any(moving: NDArray[np.bool_], groups: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which groups have an axis that moves (n, 3)."""
    return np.asarray(np.logical_or.reduce(moving[:, None, :] & groups, axis=2), dtype=np.bool_)

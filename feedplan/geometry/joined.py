"""Leaves out points of G1 moves that are within a tolerance of a line, as LinuxCNC's naive CAM detector does.

A line starts at a point of the program and grows point by point, as long as all points between its ends are
within the tolerance. The first point that breaks this ends the line at the point before it (LinuxCNC,
`emccanon.cc`: `linkable`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from feedplan.arrays import Flags, Floats, Integers
from feedplan.program.program import LINEAR_AXES, MoveKind, Program

# The greatest number of points that a line leaves out.
MOST = 100


def joined(program: Program, tolerance: Floats, halt: Flags) -> tuple[Program, Integers]:
    """The program with fewer moves, and the last original move in each new move (k,).

    `tolerance` (n,) [mm] is that of each move, 0 joins no moves. A new line begins after a move with `halt`
    (n,), and where feed or tolerance change. Only moves of X, Y and Z alone are joined.
    """
    last = _ends(program, tolerance, halt)
    if len(last) == len(program):
        return program, last
    new = np.searchsorted(last, np.arange(len(program)))
    columns = {name: getattr(program, name) for name in _BY_MOVE}
    changes: dict[str, Any] = {
        name: None if column is None else column[last] for name, column in columns.items()
    }
    for name in ("arc_move", "spline_move", "change_move"):
        changes[name] = new[getattr(program, name)]
    return replace(program, **changes), last


_BY_MOVE = (
    "kind",
    "target",
    "feed",
    "line",
    "control",
    "blend_tolerance",
    "fit_tolerance",
    "stop",
    "dwell",
    "coordinate_mode",
    "tool_length",
    "stop_cause",
)


def _ends(program: Program, tolerance: Floats, halt: Flags) -> Integers:
    """Indices of the moves at which lines end (k,)."""
    columns = [i for i, name in enumerate(program.axes) if name in LINEAR_AXES]
    others = [i for i in range(len(program.axes)) if i not in columns]
    moving = program.moving()
    alone = (program.kind == MoveKind.LINE) & (tolerance > 0.0) & ~moving[:, others].any(axis=1)
    with_next = alone[:-1] & alone[1:] & ~halt[:-1]
    with_next &= (program.feed[1:] == program.feed[:-1]) & (tolerance[1:] == tolerance[:-1])
    with_next[program.change_move[program.change_move > 0] - 1] = False
    points = np.concatenate([program.start[None, columns], program.target[:, columns]])
    ends = np.ones(len(program), dtype=np.bool_)
    # Ranges of moves that may be joined; move i goes from point i to point i + 1.
    edge = np.flatnonzero(np.diff(np.concatenate([[False], with_next, [False]]).astype(np.int8)))
    for first, past in zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True):
        start = first
        for move in range(first + 1, past + 1):
            if move - start > MOST or not _near(points[start : move + 2], tolerance[move]):
                start = move
            else:
                ends[move - 1] = False
    return np.flatnonzero(ends)


def _near(points: Floats, tolerance: float) -> bool:
    """Whether all points are within the tolerance of the line segment from the first to the last point."""
    way = points[-1] - points[0]
    square = float(way @ way)
    if square == 0.0:
        return False
    off = points[1:-1] - points[0]
    share = np.clip(off @ way / square, 0.0, 1.0)
    off -= share[:, None] * way
    return bool(np.einsum("ij,ij->i", off, off).max() <= tolerance**2)

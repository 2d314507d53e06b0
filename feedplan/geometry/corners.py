"""What becomes of the corners of a program where it may be left."""

from __future__ import annotations

from enum import Enum
from typing import Literal, get_args

# What smooth paths do with the size of arcs and bends.
FollowedPath = Literal["as-fitted", "fastest"]
PATHS: tuple[FollowedPath, ...] = get_args(FollowedPath)


class Corners(Enum):
    """How a path follows a program.

    `ROUNDED`: chains of G1 moves are fitted by splines, other corners rounded by parabolas. `ARCS`:
    lines stay lines, and an arc that touches both rounds each corner of two. `PROGRAMMED`: the path is
    the program itself; its corners may be passed with a jump of velocity, of what the accelerations give
    in one servo period. `SMOOTH`: all moves between two stops, arcs and splines too, are one curve of
    continuous fourth derivative, in which long lines are straight; its curvature has no jumps, which is what
    limits of jerk ask for. Away from their ends arcs and bends of G1 moves (each turning by less than 30°)
    keep their size. `FASTEST`: as SMOOTH, but bends are cut like corners, up to the tolerance. `JOINED`: as
    ARCS, after points of G1 moves within the fit's tolerance (G64 Q, else P) of a line have been left out.
    """

    ROUNDED = "rounded"
    ARCS = "arcs"
    PROGRAMMED = "programmed"
    SMOOTH = "smooth"
    FASTEST = "fastest"
    JOINED = "joined"

"""How a path treats the corners of a program, and which path a plan follows."""

from __future__ import annotations

from enum import Enum
from typing import Literal, get_args

# The path by the program alone, or the path that is fitted to the speed of a plan: see `feedplan.plan`.
FollowedPath = Literal["as-fitted", "fastest"]
PATHS: tuple[FollowedPath, ...] = get_args(FollowedPath)


class Corners(Enum):
    """How a path follows a program.

    - `ROUNDED`: chains of G1 moves are fitted by splines, other corners are rounded by parabolas.
    - `ARCS`: lines stay lines, and an arc that touches both lines rounds their corner.
    - `JOINED`: as ARCS, but first points of G1 moves are left out that are within the fit's tolerance (G64 Q,
      else P) of a line.
    - `PROGRAMMED`: the path is the program itself. At a corner each axis velocity may jump by acceleration
      limit × servo period.
    - `SMOOTH`: all moves between two stops, arcs and splines too, are one curve with continuous fourth
      derivative, in which long lines are straight. Its curvature does not jump, as jerk limits require. Away
      from their ends arcs and bends of G1 moves (points that turn by less than 30°) keep their size. A path
      that is fitted to a motion (`feedplan.geometry.rules.Motion`) cuts them up to the tolerance.
    """

    ROUNDED = "rounded"
    ARCS = "arcs"
    PROGRAMMED = "programmed"
    SMOOTH = "smooth"
    JOINED = "joined"

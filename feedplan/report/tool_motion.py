"""The tool's way: X, Y, Z [mm] where a piece moves one of them, else U, V, W [mm], else all others [deg].

The others are rotary axes, or the joints of an arm: the length is that of the path in their space, in their
unit. So millimetres and degrees are never added, unless a path has joints of several units. Feeds of part
programs count along the same axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.lazy import cached_property
from feedplan.progress import Listener

Floats = NDArray[np.float64]

# In this order the first group that moves counts. I, J, K are the tool's direction, a unit vector.
_GROUPS = (("X", "Y", "Z"), ("U", "V", "W"))
_DEGREES = {name: math.degrees(1.0) for name in "IJK"}

# Roundings of a control point, in units of the last digit of the greatest: they are no motion.
_ROUNDINGS = 64.0


@dataclass(frozen=True, eq=False)
class ToolMotion:
    """`curve` has a path's pieces with the axes that count, the others at 0; `turns` (n,) are those pieces on
    which nothing but rotary axes and joints moves. `share` (n, axes) is what each axis counts, None where all
    do. `units` are those of the way where a tool moves, and where it turns alone."""

    curve: CompositeCurve
    share: Floats | None
    turns: NDArray[np.bool_]
    units: tuple[str, str] = ("mm", "deg")

    @property
    def unit(self) -> str:
        """The unit of what is drawn: that of turning where nothing else moves anywhere."""
        return self.units[1 if self.turns.all() else 0]

    @cached_property
    def drawn(self) -> NDArray[np.bool_]:
        """Pieces (n,) whose way is in that unit."""
        return np.asarray(~self.turns | self.turns.all())

    def slope(self, piece: NDArray[np.integer], u: Floats) -> Floats:
        """Way by u at places (m,) [mm or deg]."""
        return np.asarray(np.linalg.norm(self.curve.evaluate(piece, u, 1)[1], axis=1))

    def lengths(self, progress: Listener | None = None) -> Floats:
        """Way of each piece (n,), [deg] where it turns and [mm] elsewhere."""
        table = CurveLength(self.curve, progress=progress)
        return np.diff(table.length(np.arange(len(self.curve)), self.curve.width), prepend=0.0)


def tool_motion(problem: Problem) -> ToolMotion:
    """The way of the tool along a problem's path."""
    curve, axes = problem.path.curve, problem.path.axes
    if set(axes) <= set(_GROUPS[0]):
        return ToolMotion(curve, None, np.zeros(len(curve), dtype=bool), problem.way_units)
    points, first = curve.control_points, curve.offsets[:-1]
    extent = np.maximum.reduceat(points, first) - np.minimum.reduceat(points, first)
    rounding = _ROUNDINGS * np.finfo(float).eps * np.abs(points).max(axis=0, initial=0.0)
    lead = np.array([[name in group for name in axes] for group in _GROUPS])
    member = np.vstack([lead, ~lead.any(axis=0)])
    moves = ((extent > rounding)[:, None, :] & member).any(axis=2)
    counts = np.where(moves.any(axis=1), moves.argmax(axis=1), len(_GROUPS))
    scale = np.array([_DEGREES.get(name, 1.0) for name in axes])
    share = member[counts] * scale
    points = points * np.repeat(share, np.diff(curve.offsets), axis=0)
    return ToolMotion(replace(curve, control_points=points), share, counts == len(_GROUPS), problem.way_units)

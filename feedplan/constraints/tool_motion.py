"""The tool's motion along a path: X, Y, Z [mm] if a piece moves one of them, else U, V, W [mm], else all
other axes [deg].

The other axes are rotary axes or the joints of an arm; the length is then measured in the space of these
axes, in their unit. So millimetres and degrees are never added, unless a path has joints of several units.
Feeds of part programs are speeds along the same axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.geometry.feed_groups import GROUPS, feed_groups, leading_group
from feedplan.geometry.path import Path
from feedplan.lazy import cached_property
from feedplan.machine.axis import DIRECTION

# A change of the tool's direction (a unit vector) is an angle in radians; lengths are in degrees.
_DEGREES = dict.fromkeys(DIRECTION, math.degrees(1.0))

# Differences of control points up to this many units in the last place of the greatest are rounding.
_ROUNDINGS = 64.0


@dataclass(frozen=True, eq=False)
class ToolMotion:
    """`curve` has a path's pieces with the axes whose length is measured, the other axes at 0; `turns` (n,)
    is true for pieces on which only rotary axes and joints move. `share` (n, axes) is the weight of each
    axis, None if all are 1. `units` are those of the length: first if the tool moves, then if it only turns.
    """

    curve: CompositeCurve
    share: Floats | None
    turns: Flags
    units: tuple[str, str]

    @classmethod
    def along(cls, path: Path, units: tuple[str, str]) -> ToolMotion:
        """The tool's motion along a path."""
        curve, share = path.curve, None
        turns = np.zeros(len(curve), dtype=bool)
        if not set(path.axes) <= set("XYZ"):
            share, turns = _counted(path)
            weights = np.repeat(share, np.diff(curve.offsets), axis=0)
            curve = replace(curve, control_points=curve.control_points * weights)
        return cls(curve, share, turns, units)

    @cached_property
    def _way(self) -> CurveLength:
        return CurveLength(self.curve)

    @property
    def unit(self) -> str:
        """The unit of the length that figures show: that of turning if no piece moves the tool."""
        return self.units[1 if self.turns.all() else 0]

    @cached_property
    def drawn(self) -> Flags:
        """Whether the length of each piece (n,) is in the unit `unit`."""
        return np.asarray(~self.turns | self.turns.all())

    def slope(self, piece: NDArray[np.integer], u: Floats) -> Floats:
        """Derivative of the length by u at parameters (m,) [mm or deg]."""
        return np.asarray(np.linalg.norm(self.curve.evaluate(piece, u, 1)[1], axis=1))

    @cached_property
    def lengths(self) -> Floats:
        """Length of each piece (n,): [deg] if it turns, else [mm]."""
        return np.diff(self._way.length(np.arange(len(self.curve)), self.curve.width), prepend=0.0)

    def drawn_length(self, piece: NDArray[np.integer], u: Floats) -> Floats:
        """Length of the drawn pieces from the start of the path to parameters (m,) of such pieces."""
        return np.asarray(self._way.length(piece, u) - self._left_out[piece])

    @cached_property
    def _left_out(self) -> Floats:
        """Length (n,) of pieces that are not drawn, from the start of the path to the end of each piece."""
        return np.cumsum(np.where(self.drawn, 0.0, self.lengths))


def linear_motion(curve: CompositeCurve, axes: tuple[str, ...]) -> CompositeCurve:
    """The motion of a curve in `axes` along X, Y and Z alone, at rest in those of the three that it lacks."""
    points = np.zeros((len(curve.control_points), 3))
    for column, name in enumerate(axes):
        if name in ("X", "Y", "Z"):
            points[:, "XYZ".index(name)] = curve.control_points[:, column]
    return replace(curve, control_points=points)


def _counted(path: Path) -> tuple[Floats, Flags]:
    """`ToolMotion.share` and `ToolMotion.turns` of a path with other axes than X, Y, Z."""
    axes, points, first = path.axes, path.curve.control_points, path.curve.offsets[:-1]
    extent = np.maximum.reduceat(points, first) - np.minimum.reduceat(points, first)
    rounding = _ROUNDINGS * np.finfo(float).eps * np.abs(points).max(axis=0, initial=0.0)
    # The length of the first group that moves is measured; that of the last group if nothing moves.
    group = leading_group(axes, extent > rounding) % GROUPS
    scale = np.array([_DEGREES.get(name, 1.0) for name in axes])
    return feed_groups(axes)[group] * scale, group == GROUPS - 1

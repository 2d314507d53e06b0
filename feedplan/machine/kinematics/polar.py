"""Polar machines: the table turns the part under a tool that only moves in and out, and up and down.

    X = ±√(x² + y²),   C = atan2(±y, ±x),   Z = z      (relative to the table's centre)

The axes of the machine file are, in this order, the slide [mm], the height [mm] and the table [deg], with any
letters, such as X, Z, C. ISO 841 counts a table's angle by the tool's motion relative to the part, opposite
to the table's own turning: C = +atan2(y, x), unless `turns = "reversed"`. `side = "minus"` works at negative
X. K is singular at the table's centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from feedplan.machine.axis import Axis
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import Number, atan2, degrees, hypot, radians, sin_cos
from feedplan.machine.parameters import Parameters


@dataclass(frozen=True)
class Polar(Kinematics):
    """A table with its axis at `centre` [mm]; `side` ±1 is the sign of the slide, `sense` ±1 the sign of the
    table's angle."""

    joint_names: tuple[str, ...]
    centre: tuple[float, float] = (0.0, 0.0)
    side: float = 1.0
    sense: float = 1.0
    tip_names: tuple[str, ...] = ("X", "Y", "Z")
    # The table turns, and its angle is known up to whole turns.
    rotary = turning = (False, False, True)

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """Slide and height [mm], table [deg]."""
        x, y, z = tip[0] - self.centre[0], tip[1] - self.centre[1], tip[2]
        angle = degrees(atan2(y * self.side, x * self.side)) * self.sense
        return hypot(x, y) * self.side + self.centre[0], z, angle

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """The point of the part under the tool."""
        slide, z, angle = joints
        sine, cosine = sin_cos(radians(angle * self.sense))
        radius = slide - self.centre[0]
        return radius * cosine + self.centre[0], radius * sine + self.centre[1], z

    def singular(self, tip: Sequence[Number]) -> dict[str, Number]:
        """The radius, which is 0 at the table's centre."""
        return {"the centre of the table": hypot(tip[0] - self.centre[0], tip[1] - self.centre[1])}


def build(axes: tuple[Axis, ...], parameters: Parameters) -> Polar:
    """Keys `centre_x`, `centre_y` [mm], `side` ("plus" or "minus"), `turns` ("iso" or "reversed")."""
    centre = (parameters.number("centre_x", 0.0), parameters.number("centre_y", 0.0))
    side = parameters.choice("side", "plus", ("plus", "minus"))
    turns = parameters.choice("turns", "iso", ("iso", "reversed"))
    names = tuple(axis.name for axis in axes)
    return Polar(
        joint_names=names if len(names) == 3 else ("X", "Z", "C"),
        centre=centre,
        side=1.0 if side == "plus" else -1.0,
        sense=1.0 if turns == "iso" else -1.0,
    )

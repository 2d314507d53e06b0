"""Cylindrical machines: a column turns an arm, the arm moves in and out, and the tool moves up and down.

    θ = atan2(y − y_c, x − x_c),   r = √((x − x_c)² + (y − y_c)²),   z = z

Cheatham 2007, figure 5.1b. The axes of the machine file are, in this order, the column [deg], the arm [mm]
and the height [mm], with any letters, such as C, X, Z. K is singular on the column's axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from feedplan.machine.axis import Axis
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import Number, atan2, degrees, hypot, radians, sin_cos
from feedplan.machine.parameters import Parameters


@dataclass(frozen=True)
class Cylindrical(Kinematics):
    """A column at `centre` [mm]."""

    joint_names: tuple[str, ...]
    centre: tuple[float, float] = (0.0, 0.0)
    tip_names: tuple[str, ...] = ("X", "Y", "Z")
    # The column turns, and its angle is known up to whole turns.
    rotary = turning = (True, False, False)

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """Angle [deg], radius and height [mm]."""
        x, y, z = tip[0] - self.centre[0], tip[1] - self.centre[1], tip[2]
        return degrees(atan2(y, x)), hypot(x, y), z

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """The point at an angle, a radius and a height."""
        angle, radius, z = joints
        sine, cosine = sin_cos(radians(angle))
        return radius * cosine + self.centre[0], radius * sine + self.centre[1], z

    def singular(self, tip: Sequence[Number]) -> dict[str, Number]:
        """The radius, which is 0 on the column's axis."""
        return {"the axis of the column": hypot(tip[0] - self.centre[0], tip[1] - self.centre[1])}


def build(axes: tuple[Axis, ...], parameters: Parameters) -> Cylindrical:
    """Keys `centre_x`, `centre_y` [mm]: the position of the column's axis, 0 by default."""
    centre = (parameters.number("centre_x", 0.0), parameters.number("centre_y", 0.0))
    names = tuple(axis.name for axis in axes)
    return Cylindrical(joint_names=names if len(names) == 3 else ("C", "X", "Z"), centre=centre)

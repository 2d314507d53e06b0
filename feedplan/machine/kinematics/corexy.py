"""CoreXY: two fixed motors drive X and Y through one crossed belt.

    q_1 = x + y,   q_2 = x − y,   q_3 = z

The first two axes of the machine file are the motors, in mm of belt, with any letters but X and Y (U and V,
or A and B with kind = "linear"). All further axes follow the program axis of their own letter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from feedplan.errors import MachineError
from feedplan.machine.axis import Axis
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import Number
from feedplan.machine.parameters import Parameters


@dataclass(frozen=True)
class CoreXY(Kinematics):
    """Belt motors 1 and 2, then axes that move on their own."""

    tip_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    rotary_joints: tuple[bool, ...]

    @property
    def rotary(self) -> tuple[bool, ...]:
        """The motors are linear (mm of belt); the others are as in the machine file."""
        return self.rotary_joints

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """Sum and difference of X and Y."""
        x, y, *others = tip
        return (x + y, x - y, *others)

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """Half the sum and half the difference of the motors."""
        first, second, *others = joints
        return (0.5 * (first + second), 0.5 * (first - second), *others)


def build(axes: tuple[Axis, ...], parameters: Parameters) -> CoreXY:
    """No keys."""
    names = tuple(axis.name for axis in axes)
    if len(names) < 2 or {"X", "Y"} & set(names):
        raise MachineError(
            f"machine {parameters.machine}: the axes are {', '.join(names)}: give the two motors first, "
            "by other letters than X and Y, as U, V, Z"
        )
    return CoreXY(
        tip_names=("X", "Y", *names[2:]),
        joint_names=names,
        rotary_joints=(False, False, *(axis.kind == "rotary" for axis in axes[2:])),
    )

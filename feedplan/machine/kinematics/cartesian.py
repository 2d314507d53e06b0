"""Cartesian machines: each joint is one program axis times a scale, as on any three-axis mill or gantry.

    q_j = scale_j · P_axis(j)

Without keys every joint follows the program axis of its own letter. `map` lets joints follow another program
axis; two joints may follow the same, as the two motors of a gantry do. `scale` is mm of the joint per mm of
the tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from feedplan.errors import MachineError
from feedplan.machine.axis import AXIS_LETTERS, ROTARY_LETTERS, Axis
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import Number
from feedplan.machine.parameters import Parameters


@dataclass(frozen=True)
class Cartesian(Kinematics):
    """`source[j]`: index in `tip_names` of the program axis that joint j follows; `scale[j]`: its factor."""

    tip_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    rotary_joints: tuple[bool, ...]
    source: tuple[int, ...]
    scale: tuple[float, ...]
    any_unit = True

    @property
    def rotary(self) -> tuple[bool, ...]:
        """The kinds of the machine's axes."""
        return self.rotary_joints

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """Scaled program axes."""
        return tuple(tip[i] * scale for i, scale in zip(self.source, self.scale, strict=True))

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """Each program axis from the first joint that follows it."""
        first = [self.source.index(i) for i in range(len(self.tip_names))]
        return tuple(joints[j] / self.scale[j] for j in first)


def build(axes: tuple[Axis, ...], parameters: Parameters) -> Cartesian:
    """Keys `map = {joint = "program axis"}` and `scale = {joint = factor}`."""
    names = tuple(axis.name for axis in axes)
    mapped, scales = parameters.table("map"), parameters.table("scale")
    for key, table in (("map", mapped), ("scale", scales)):
        for letter in table:
            parameters.require(letter in names, key, letter, f"one of the joints {', '.join(names)}")
    follows = [mapped.get(name, name) for name in names]
    for letter in mapped.values():
        good = isinstance(letter, str) and len(letter) == 1 and letter in AXIS_LETTERS
        parameters.require(good, "map", letter, f"one of the letters {AXIS_LETTERS}")
    scale = [scales.get(name, 1.0) for name in names]
    for value in scale:
        good = isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < abs(value) < 1e6
        parameters.require(good, "scale", value, "a number other than 0")
    for axis, letter in zip(axes, follows, strict=True):
        if (letter in ROTARY_LETTERS) != (axis.kind == "rotary") and letter != axis.name:
            raise MachineError(
                f"machine {parameters.machine}: the {axis.kind} joint {axis.name} follows {letter}: "
                "map linear joints to X, Y, Z, U, V, W and rotary ones to A, B, C"
            )
    # Axes with other names follow themselves: programs cannot move them.
    letters = tuple(AXIS_LETTERS)
    tip_names = tuple(name for name in letters if name in follows)
    tip_names += tuple(name for name in follows if name not in letters)
    return Cartesian(
        tip_names=tip_names,
        joint_names=names,
        rotary_joints=tuple(axis.kind == "rotary" for axis in axes),
        source=tuple(tip_names.index(letter) for letter in follows),
        scale=tuple(float(value) for value in scale),
    )

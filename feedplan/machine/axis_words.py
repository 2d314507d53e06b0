"""The axis words of a program on a machine: maps a program's columns to the input of its kinematics.

A program reader gives the coordinate mode and the tool length of each move, and the columns I, J, K for
directions. In the modes TIP and VECTOR the words are the position of the tip: the reader does not add the
tool length to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from feedplan.arrays import Floats
from feedplan.errors import MachineError
from feedplan.machine.axis import DIRECTION
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.machine import Machine
from feedplan.machine.rotary import RotaryChain, ToolVector


@dataclass(frozen=True)
class AxisWords:
    """The words of moves in one coordinate mode: `kinematics` takes these columns of the program's axes.

    The column −1 is an axis that the program does not use: it stays at 0.
    """

    coordinate_mode: CoordinateMode
    kinematics: Kinematics
    column: tuple[int, ...]

    @property
    def other_pose(self) -> AxisWords:
        """These words with the other pose of the joints that gives the same tool direction."""
        assert isinstance(self.kinematics, ToolVector)
        return replace(self, kinematics=replace(self.kinematics, side=-self.kinematics.side))

    def tip(self, points: Floats) -> Floats:
        """The input of `kinematics` (…, tip axes), from points or Bézier points (…, program axes)."""
        columns = [
            points[..., column] if column >= 0 else np.zeros(points.shape[:-1]) for column in self.column
        ]
        return np.stack(columns, axis=-1)


def axis_words(
    machine: Machine,
    axes: Sequence[str],
    coordinate_mode: CoordinateMode | None = None,
    *,
    tool_length: float | None = None,
) -> AxisWords:
    """The words of the program axes `axes`; raises MachineError for a letter that the machine lacks.

    Letters of other modes are ignored: I, J, K, or rotary joints together with a direction.

    Without a `coordinate_mode`, it is the machine's mode before any G43.4. `tool_length` [mm] replaces the
    one in the machine file.
    """
    axes = tuple(axes)
    kinematics = machine.inverse
    if coordinate_mode is None:
        coordinate_mode = CoordinateMode.TIP if kinematics.always else CoordinateMode.JOINTS
    if tool_length is not None and isinstance(kinematics, RotaryChain):
        kinematics = kinematics.with_tool(tool_length)
    if coordinate_mode is CoordinateMode.JOINTS:
        kinematics = _joint_positions(machine)
    elif coordinate_mode is CoordinateMode.VECTOR:
        if not isinstance(kinematics, RotaryChain) or len(kinematics.joint_names) != 5:
            raise MachineError(
                f"machine {machine.name} has no two rotary axes that point the tool along I, J, K: "
                "program rotary words (G43.4), or use a five-axis machine"
            )
        kinematics = ToolVector(kinematics)
    known = kinematics.tip_names
    # A program with several modes has the columns of all of them.
    others = kinematics.joint_names if coordinate_mode is CoordinateMode.VECTOR else DIRECTION
    for letter in axes:
        if letter not in known and letter not in others:
            raise MachineError(
                f"the program uses {letter}, but machine {machine.name} takes {', '.join(known)} there: "
                f"take {letter} out of the program, or use a machine that has it"
            )
    column = tuple(axes.index(letter) if letter in axes else -1 for letter in known)
    if coordinate_mode is CoordinateMode.VECTOR and -1 in column[3:]:
        raise MachineError("a tool direction needs all of I, J and K: give the missing words")
    return AxisWords(coordinate_mode, kinematics, column)


def _joint_positions(machine: Machine) -> Kinematics:
    """The identity on the machine's joints."""
    from feedplan.machine.kinematics.cartesian import Cartesian

    names = machine.axis_names
    return Cartesian(
        tip_names=names,
        joint_names=names,
        rotary_joints=tuple(axis.kind == "rotary" for axis in machine.axes),
        source=tuple(range(len(names))),
        scale=(1.0,) * len(names),
    )

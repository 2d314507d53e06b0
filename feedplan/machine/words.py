"""What a program's axis words mean on a machine: joint positions, the tool tip, or the tip and a direction.

A reader that knows G43.4 and the like says for each stretch of moves which meaning holds, the tool's length,
and for directions the columns I, J, K. Under TIP and VECTOR the words are the tip itself, so the reader
leaves the tool length offset out of them, and adds work offsets, also of rotary axes, as it does now.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from feedplan.errors import MachineError
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.machine import Machine
from feedplan.machine.meaning import Meaning
from feedplan.machine.rotary import RotaryChain, ToolVector

DIRECTION = ("I", "J", "K")


@dataclass(frozen=True)
class AxisWords:
    """A stretch of program on a machine: `kinematics` takes the columns `column` of the program's axes.

    A column of −1 is an axis that the program does not use: it stays at `held` [mm, deg].
    """

    meaning: Meaning
    kinematics: Kinematics
    column: tuple[int, ...]
    held: tuple[float, ...]

    @property
    def other_pose(self) -> AxisWords:
        """The same by the other pose that points the tool along a direction."""
        assert isinstance(self.kinematics, ToolVector)
        return replace(self, kinematics=replace(self.kinematics, side=-self.kinematics.side))

    def tip(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """What `kinematics` takes (…, tip axes), from points or Bézier points (…, program axes)."""
        columns = [
            points[..., column] if column >= 0 else np.full(points.shape[:-1], held)
            for column, held in zip(self.column, self.held, strict=True)
        ]
        return np.stack(columns, axis=-1)


def axis_words(
    machine: Machine,
    axes: Sequence[str],
    meaning: Meaning | None = None,
    *,
    tool_length: float | None = None,
    held: Mapping[str, float] | None = None,
    side: float = 1.0,
) -> AxisWords:
    """The program axes `axes` on a machine; MachineError names a letter the machine does not have.

    Letters of the machine's other meanings are left out: I, J, K, or rotary joints beside a direction.

    Without a meaning, words mean what they do on that machine before any G43.4. `tool_length` [mm] replaces
    the machine file's; `held` gives positions of axes that the program never moves, 0 by default; `side` ±1
    chooses between the two poses that point the tool along a direction.
    """
    axes = tuple(axes)
    kinematics = machine.inverse
    if meaning is None:
        meaning = Meaning.TIP if kinematics.always else Meaning.JOINTS
    if tool_length is not None and isinstance(kinematics, RotaryChain):
        kinematics = kinematics.with_tool(tool_length)
    if meaning is Meaning.JOINTS:
        kinematics = _joint_positions(machine)
    elif meaning is Meaning.VECTOR:
        if not isinstance(kinematics, RotaryChain) or len(kinematics.joint_names) != 5:
            raise MachineError(
                f"machine {machine.name} has no two rotary axes that point the tool along I, J, K: "
                "program rotary words, or use a five-axis machine"
            )
        kinematics = ToolVector(kinematics, side)
    known = kinematics.tip_names
    # The columns of a program with several meanings serve all of them.
    others = kinematics.joint_names if meaning is Meaning.VECTOR else DIRECTION
    for letter in axes:
        if letter not in known and letter not in others:
            raise MachineError(
                f"the program uses {letter}, but machine {machine.name} takes {', '.join(known)} there: "
                f"take {letter} out of the program, or use a machine that has it"
            )
    column = tuple(axes.index(letter) if letter in axes else -1 for letter in known)
    if meaning is Meaning.VECTOR and -1 in column[3:]:
        raise MachineError("a tool direction needs all of I, J and K: give the missing words")
    return AxisWords(meaning, kinematics, column, tuple((held or {}).get(letter, 0.0) for letter in known))


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

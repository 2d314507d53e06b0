"""The axes of a path: the program's letters that a machine takes, their mode, and the limits of the axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from feedplan.arrays import Flags, Floats
from feedplan.errors import MachineError
from feedplan.machine.axis import AXIS_LETTERS, DIRECTION, size_of
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.program.program import Program


@dataclass(frozen=True)
class PathWords:
    """The axes of a path.

    `names` are the machine's axes that the program names, in the machine's order. `joints` (n,): the words of
    the move are joint positions; `changes` (n − 1,): the mode or the tool length of the next move differs.
    `max_velocity`, `max_acceleration`, `max_jerk` (axes,) are used to round corners and to fit, the smaller
    limit of both directions: where all words are joints, the limit of the joint; else the limit of a rotary
    axis itself, and for other axes the least limit of all linear joints. `travel` (axes, 2) holds where words
    are joints. `may_jump`: all words are joints, and all that move allow a velocity jump at corners.
    """

    names: tuple[str, ...]
    joints: Flags
    changes: Flags
    max_velocity: Floats
    max_acceleration: Floats
    max_jerk: Floats
    travel: Floats
    may_jump: bool


def path_words(program: Program, machine: Machine) -> PathWords:
    """The axes of the program's path on a machine.

    Raises MachineError where the program moves a letter that the machine does not take, or too many of them.
    """
    default = CoordinateMode.JOINTS if machine.words_are_joints else CoordinateMode.TIP
    given = program.coordinate_mode
    coordinate_mode = np.full(len(program), default, dtype=np.uint8) if given is None else given
    known: dict[str, None] = {}
    moving = program.moving()
    used: Flags = np.logical_or.reduce(moving, axis=0)
    for value in [default] if given is None or len(given) == 0 else np.unique(given):
        letters = _letters(machine, CoordinateMode(value))
        known.update(dict.fromkeys(letters))
        for column, name in enumerate(program.axes):
            if name in letters:
                continue
            moves: Flags = moving[:, column] & (coordinate_mode == value)
            if moves.any():
                line = program.line[int(moves.argmax())]
                what = "none" if value == CoordinateMode.JOINTS else f"{', '.join(letters)} there"
                raise MachineError(
                    f"{program.name}, line {line}: axis {name} moves and machine {machine.name} has {what}: "
                    f"choose a machine with {name}, or add it to the machine file"
                )
    names = tuple(name for name in known if name in program.axes)
    if not names:
        raise MachineError(f"{program.name} moves no axis of machine {machine.name}: choose another machine")
    for axis in machine.axes if machine.is_plain else ():
        if axis.name in names and axis.name in tuple(AXIS_LETTERS) and axis.unit != axis.usual_unit:
            raise MachineError(
                f"{program.name} is in {axis.usual_unit} along {axis.name}, and axis {axis.name} of machine "
                f"{machine.name} in {axis.unit}: convert its limits and leave out unit"
            )
    changes = coordinate_mode[1:] != coordinate_mode[:-1]
    if program.tool_length is not None:
        before, after = program.tool_length[:-1], program.tool_length[1:]
        changes |= (before != after) & ~(np.isnan(before) & np.isnan(after))
    joints = coordinate_mode == CoordinateMode.JOINTS
    # Where words are not joints, a corner is a stop.
    may_jump = bool(joints.all()) and all(
        machine.axis(name).max_velocity_jump > 0 for name in names if used[program.axes.index(name)]
    )
    return PathWords(
        names=names,
        joints=joints,
        changes=changes,
        max_velocity=_limits(machine, names, bool(joints.all()), "max_velocity"),
        max_acceleration=_limits(machine, names, bool(joints.all()), "max_acceleration"),
        max_jerk=_limits(machine, names, bool(joints.all()), "max_jerk"),
        travel=np.array(
            [machine.axis(name).travel if name in machine.axis_names else (-np.inf, np.inf) for name in names]
        ),
        may_jump=may_jump,
    )


def _letters(machine: Machine, coordinate_mode: CoordinateMode) -> tuple[str, ...]:
    """The program letters that a machine takes in a coordinate mode, in its order."""
    if coordinate_mode is CoordinateMode.JOINTS:
        return machine.axis_names
    if coordinate_mode is CoordinateMode.TIP:
        return machine.inverse.tip_names
    # Imported here, so that kinematics are loaded only if needed.
    from feedplan.machine.axis_words import axis_words

    return axis_words(machine, DIRECTION, coordinate_mode).kinematics.tip_names


def _limits(machine: Machine, names: tuple[str, ...], joints: bool, limit: str) -> Floats:
    size = {axis.name: size_of(getattr(axis, limit)) for axis in machine.axes}
    linear = [size[axis.name] for axis in machine.axes if axis.kind == "linear"]
    least = min(linear or size.values())
    return np.array(
        [
            size[name]
            if name in machine.axis_names and (joints or machine.axis(name).kind == "rotary")
            else least
            for name in names
        ]
    )

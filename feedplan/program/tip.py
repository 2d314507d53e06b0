"""Converts the same joint positions between coordinate modes on a machine, for G43.4, G43.5 and G49."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from feedplan.errors import MachineError
from feedplan.machine.axis import AXIS_LETTERS, DIRECTION
from feedplan.machine.axis_words import axis_words
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.machine.rotary import RotaryChain, ToolVector, shortest_turn

# Sine of the angle up to which the tool counts as parallel to a rotary axis.
_PARALLEL = 1e-9


@dataclass(frozen=True)
class TipControl:
    """The machine as the G-code reader uses it; places are X Y Z A B C U V W [mm, deg], then I J K.

    `tool_length` [mm] is NaN for that of the machine file. All methods raise MachineError in one sentence.
    """

    machine: Machine

    @property
    def applies(self) -> bool:
        """Whether the machine has more than one coordinate mode."""
        return isinstance(self.machine.inverse, RotaryChain)

    def check(self, mode: int) -> None:
        """Raises MachineError if the machine does not have that coordinate mode."""
        if mode != CoordinateMode.JOINTS:
            self._chain(math.nan)
        if mode == CoordinateMode.VECTOR:
            axis_words(self.machine, DIRECTION, CoordinateMode.VECTOR)

    def joints(
        self,
        mode: int,
        tool_length: float,
        entry: Sequence[float],
        places: Sequence[Sequence[float]],
    ) -> list[float]:
        """Joints (9,) at the last of the `places` (k, 12) of consecutive moves in one mode; the joints are at
        `entry` before them.

        With directions, each move takes the pose and the turns nearest to the joints before it.
        """
        joints = list(places[-1][: len(AXIS_LETTERS)])
        if mode == CoordinateMode.JOINTS:
            return joints
        chain = self._chain(tool_length)
        angles = chain.joint_names[3:]
        if mode == CoordinateMode.VECTOR:
            turned = self._follow(chain, entry, places)
            for name, angle in zip(angles, turned, strict=True):
                joints[AXIS_LETTERS.index(name)] = angle
        for name, value in zip(chain.joint_names, chain.joints(_words(chain, joints)), strict=True):
            joints[AXIS_LETTERS.index(name)] = float(value)
        return joints

    def place(
        self, mode: int, tool_length: float, joints: Sequence[float]
    ) -> tuple[list[float], list[float]]:
        """Place (9,) and tool direction (3,) in the words of a mode, for joints (9,)."""
        place, direction = list(joints), [0.0, 0.0, 1.0]
        if mode == CoordinateMode.JOINTS:
            return place, direction
        chain = self._chain(tool_length)
        words = _words(chain, joints)
        for name, value in zip(chain.tip_names, chain.tip(words), strict=True):
            place[AXIS_LETTERS.index(name)] = float(value)
        if len(chain.joint_names) == 5:
            direction = [float(v) for v in ToolVector(chain).tip(words)[3:]]
        return place, direction

    def _chain(self, tool_length: float) -> RotaryChain:
        chain = self.machine.inverse
        if not isinstance(chain, RotaryChain):
            raise MachineError(
                f"machine {self.machine.name} has no rotary axes to follow the tool's tip with: "
                "remove G43.4 and G43.5, or use a machine that has them"
            )
        return chain if math.isnan(tool_length) else chain.with_tool(tool_length)

    def _follow(
        self, chain: RotaryChain, entry: Sequence[float], places: Sequence[Sequence[float]]
    ) -> list[float]:
        """The rotary joints [deg] after moves by directions, in the pose nearest at their first move."""
        joints = {name: entry[AXIS_LETTERS.index(name)] for name in chain.joint_names[3:]}
        vector = ToolVector(chain)
        first = vector.from_part[0].name
        posed = False
        for place in places:
            (sine,) = vector.singular((*place[:3], *place[9:])).values()
            parallel = float(sine) < _PARALLEL
            found = _angles(vector, joints, place)
            if not (posed or parallel):
                posed = True
                other = replace(vector, side=-1.0)
                others = _angles(other, joints, place)
                if _turning(others, joints) < _turning(found, joints):
                    vector, found = other, others
            # A tool parallel to the rotary axis nearest to the part does not move that axis.
            joints = found | ({first: joints[first]} if parallel else {})
        return list(joints.values())


def _words(chain: RotaryChain, place: Sequence[float]) -> list[float]:
    """The words of a place that the chain takes: X, Y, Z and its rotary words."""
    return [place[AXIS_LETTERS.index(name)] for name in chain.joint_names]


def _angles(vector: ToolVector, before: Mapping[str, float], place: Sequence[float]) -> dict[str, float]:
    """The rotary joints [deg] for a place's direction, on the whole turns nearest to `before`."""
    found = vector.angles(place[9:])
    return {name: shortest_turn(angle, float(found[name])) for name, angle in before.items()}


def _turning(angles: Mapping[str, float], before: Mapping[str, float]) -> float:
    return sum(abs(angles[name] - before[name]) for name in angles)

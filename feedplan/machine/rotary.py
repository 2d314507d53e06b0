"""Machines with rotary axes on table, head or both: joint positions from the tip and the angles.

    J = T(w) − H(0, 0, −L),   T = T_1 ∘ T_2,  T_i(x) = p_i + R(−θ_i)(x − p_i),   H alike with R(+θ_i)

w is the tip in the part's coordinates, which are the machine's coordinates with all tables at zero. J are the
linear joints, which give the position of the tool's gauge point (spindle nose) with all angles at zero. L is
the tool's length below the gauge point. Axis 1 is the one nearest the machine's frame. p_i is a point of the
rotary axis with all angles at zero: for tables in the machine's coordinates, for heads relative to the gauge
point. ISO 841 counts every axis by the tool's motion relative to the part, so a table turns opposite to its
angle; the tool's direction in the part is R(tables, part first) R(heads) ẑ. A `sense` of −1 reverses the sign
of an axis's angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from feedplan.errors import MachineError
from feedplan.machine.axis import DIRECTION, Axis
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import Number, atan2, degrees, hypot, radians, sin_cos
from feedplan.machine.parameters import Parameters, Vector

LINEAR = ("X", "Y", "Z")


@dataclass(frozen=True)
class RotaryAxis:
    """A rotary axis: A, B or C about X, Y or Z through `pivot` [mm]; `sense` −1 is opposite to ISO 841."""

    name: str
    pivot: Vector = (0.0, 0.0, 0.0)
    sense: float = 1.0


@dataclass(frozen=True)
class RotaryChain(Kinematics):
    """X, Y, Z and rotary axes `tables` and `heads`, each from the machine's frame outwards.

    The rotary words are the angles of the joints (G43.4). `tool_length` [mm] is the distance from the gauge
    point to the tip.
    """

    joint_names: tuple[str, ...]
    tables: tuple[RotaryAxis, ...] = ()
    heads: tuple[RotaryAxis, ...] = ()
    tool_length: float = 0.0
    always: bool = False

    @property
    def tip_names(self) -> tuple[str, ...]:  # type: ignore[override]
        """X, Y, Z and the rotary axes in the machine's order."""
        return self.joint_names

    def with_tool(self, length: float) -> RotaryChain:
        """This machine with another tool length [mm]."""
        return replace(self, tool_length=float(length))

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """The linear joints [mm], then the angles [deg] unchanged."""
        waves = self._waves(tip[3:])
        point = tuple(tip[:3])
        for axis in reversed(self.tables):
            sine, cosine = waves[axis.name]
            point = _turn(axis, point, -sine, cosine)
        tool = self._tool(waves)
        return (*(a - b for a, b in zip(point, tool, strict=True)), *tip[3:])

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """The tip on the part [mm] and the angles [deg]."""
        waves = self._waves(joints[3:])
        point = tuple(a + b for a, b in zip(joints[:3], self._tool(waves), strict=True))
        for axis in self.tables:
            sine, cosine = waves[axis.name]
            point = _turn(axis, point, sine, cosine)
        return (*point, *joints[3:])

    def _waves(self, angles: Sequence[Number]) -> dict[str, tuple[Number, Number]]:
        """Sine and cosine of each rotary axis's angle, with the sign of ISO 841."""
        senses = {axis.name: axis.sense for axis in (*self.tables, *self.heads)}
        waves = {}
        for name, angle in zip(self.joint_names[3:], angles, strict=True):
            sine, cosine = sin_cos(radians(angle))
            waves[name] = (sine * senses[name], cosine)
        return waves

    def _tool(self, waves: dict[str, tuple[Number, Number]]) -> tuple[Number, ...]:
        """The tip relative to the linear joints: H(0, 0, −L)."""
        point: tuple[Number, ...] = (0.0, 0.0, -self.tool_length)
        for axis in reversed(self.heads):
            sine, cosine = waves[axis.name]
            point = _turn(axis, point, sine, cosine)
        return point


@dataclass(frozen=True)
class ToolVector(Kinematics):
    """A five-axis machine programmed by the tip and the tool's direction I, J, K of any length (G43.5).

    The direction points from the tip to the spindle. `side` ±1 chooses between the two pairs of angles that
    give it. K is singular where the tool is parallel to the rotary axis nearest to the part.
    """

    chain: RotaryChain
    side: float = 1.0
    always: bool = False
    # Both angles come from the direction.
    turning = (False, False, False, True, True)

    @property
    def tip_names(self) -> tuple[str, ...]:  # type: ignore[override]
        """The tip and the direction."""
        return (*LINEAR, *DIRECTION)

    @property
    def joint_names(self) -> tuple[str, ...]:  # type: ignore[override]
        """The joint names of the chain."""
        return self.chain.joint_names

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """The joints of the chain, with the angles that give the tool's direction."""
        angles = self.angles(tip[3:])
        return self.chain.joints((*tip[:3], *(angles[name] for name in self.joint_names[3:])))

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """The tip and the unit direction."""
        waves = self.chain._waves(joints[3:])
        direction: tuple[Number, ...] = (0.0, 0.0, 1.0)
        for axis in reversed(self.from_part):
            direction = _turn(replace(axis, pivot=(0.0, 0.0, 0.0)), direction, *waves[axis.name])
        return (*self.chain.tip(joints)[:3], *direction)

    def singular(self, tip: Sequence[Number]) -> dict[str, Number]:
        """The sine of the angle between the tool and the rotary axis nearest to the part."""
        i, j, k = tip[3:]
        first = self.from_part[0].name
        across = {"A": hypot(j, k), "B": hypot(i, k), "C": hypot(i, j)}[first]
        return {f"a tool axis parallel to {first}": across / hypot(hypot(i, j), k)}

    def angles(self, direction: Sequence[Number]) -> dict[str, Number]:
        """The angles of the two rotary axes [deg] that give the tool a direction."""
        i, j, k = direction
        first, second = self.from_part
        s = self.side
        # R(first) R(second) ẑ = (i, j, k), solved for both; the other solution has s = −1.
        match first.name + second.name:
            case "CA":
                pair = atan2(i * s, j * -s), atan2(hypot(i, j) * s, k)
            case "CB":
                pair = atan2(j * s, i * s), atan2(hypot(i, j) * s, k)
            case "AB":
                pair = atan2(j * -s, k * s), atan2(i, hypot(j, k) * s)
            case _:
                pair = atan2(i * s, k * s), atan2(-j, hypot(i, k) * s)
        return {
            axis.name: degrees(angle) * axis.sense for axis, angle in zip((first, second), pair, strict=True)
        }

    @property
    def from_part(self) -> tuple[RotaryAxis, ...]:
        """The rotary axes in order from the part to the frame and on to the tool."""
        return (*reversed(self.chain.tables), *self.chain.heads)


def shortest_turn(start: float, target: float) -> float:
    """The angle [deg] nearest to `start` that differs from `target` by whole turns."""
    return target + 360.0 * round((start - target) / 360.0)


def build_chain(
    axes: tuple[Axis, ...], parameters: Parameters, tables: tuple[str, ...], heads: tuple[str, ...]
) -> RotaryChain:
    """A chain of these axes with the keys `tool_length`, `pivot_a`, `pivot_b`, `pivot_c` [mm], `reversed`."""
    names = (*tables, *heads)
    backwards = parameters.letters("reversed", names)

    def axis(name: str) -> RotaryAxis:
        pivot = parameters.point(f"pivot_{name.lower()}", (0.0, 0.0, 0.0))
        return RotaryAxis(name, pivot, -1.0 if name in backwards else 1.0)

    letters = tuple(axis.name for axis in axes)
    in_order = sorted(letters[3:]) == sorted(names)
    return RotaryChain(
        joint_names=(*LINEAR, *(letters[3:] if in_order else names)),
        tables=tuple(axis(name) for name in tables),
        heads=tuple(axis(name) for name in heads),
        tool_length=parameters.number("tool_length", 0.0),
    )


def require_pointing(first: str, second: str, machine: str) -> None:
    """Raises MachineError unless two rotary axes, part side first, can point the tool in every direction."""
    if first == second or second == "C":
        raise MachineError(
            f"machine {machine}: rotary axes {first} (part side) and {second} (tool side) cannot "
            "tilt the tool every way: give A and B, or C on the part side of A or B"
        )


def _turn(axis: RotaryAxis, point: Sequence[Number], sine: Number, cosine: Number) -> tuple[Number, ...]:
    """p + R(θ)(x − p) about the axis, right-handed."""
    x, y, z = (a - b if b else a for a, b in zip(point, axis.pivot, strict=True))
    if axis.name == "A":
        x, y, z = x, cosine * y - sine * z, sine * y + cosine * z
    elif axis.name == "B":
        x, y, z = cosine * x + sine * z, y, cosine * z - sine * x
    else:
        x, y, z = cosine * x - sine * y, sine * x + cosine * y, z
    x, y, z = (a + b if b else a for a, b in zip((x, y, z), axis.pivot, strict=True))
    return x, y, z

"""One axis of a machine with its limits, and the letters by which programs name axes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from feedplan.arguments import is_text
from feedplan.machine.checks import numbers, require, set_limit, set_within

# The axis letters of programs, and the letters of rotary axes unless an axis has a `kind`.
AXIS_LETTERS = "XYZABCUVW"
ROTARY_LETTERS = ("A", "B", "C")
# The letters of the tool's direction.
DIRECTION = ("I", "J", "K")
AXIS_NAME = re.compile(r"(?![IJK]\Z)[A-Za-z_][A-Za-z0-9_]{0,31}", re.ASCII)
# The unit of an axis appears in tables between brackets.
_UNIT = re.compile(r"[^\s\[\]<>&\"'`\\,;]{1,12}")
_ROTARY_UNITS = ("deg", "°", "rad")
NAME_REMEDY = "1 to 32 letters, digits and underscores, no digit first, other than I, J and K"
AxisKind = Literal["linear", "rotary"]
# One number for both directions, or the least (negative) and the greatest value.
Limit: TypeAlias = float | tuple[float, float]

# Allowed ranges of a machine's numbers, in mm or degrees and seconds. A number outside is a mistake: ramps
# would be shorter than the rounding of positions, or plans longer than a year.
VELOCITIES = 1e-5, 1e9
GREATEST_ACCELERATION = 1e10
# The time [s] in which an axis reaches its velocity (v/a), and its acceleration (a/j).
RISE_TIMES = 1e-5, 1e7
JERK_TIMES = 1e-7, 1e2
# The least time to full acceleration as a share of the time to full velocity.
LEAST_JERK_SHARE = 1e-7
# The least distance [mm] in which an axis reaches its velocity, v²/a, and its acceleration, a³/j².
LEAST_WAY = 1e-11
FARTHEST = 1e9


@dataclass(frozen=True)
class Axis:
    """One axis (joint) of the machine, and its limits.

    `name`: 1 to 32 letters, digits and underscores, the first no digit, other than I, J and K (a tool's
    direction). Programs can only move axes with one of the names XYZABCUVW, paths from Python any axes.
    `max_velocity` [mm/s] and `max_acceleration` [mm/s²] are each one number or, where the limit differs by
    direction, two: (-1.0, 2.0) allows 1 in the negative and 2 in the positive direction. `max_jerk` [mm/s³]
    (infinite: not limited), `travel` (least, greatest) [mm], `max_velocity_jump` [mm/s] is allowed at a
    corner (0: corners are stops). On a rotary axis every mm is a degree. `kind` is "linear" or "rotary"; if
    it is empty, A, B, C and axes in deg, ° or rad are rotary, all others linear.

    `unit` is the unit of its positions, 1 to 12 characters; empty means mm, or deg on a rotary axis. Another
    unit, such as rad or µm, replaces mm in all limits; programs, and kinematics with dimensions, need mm and
    deg. Limits and positions are never converted.

    Velocities v must be from 1e-5 to 1e9, accelerations a at most 1e10. v/a, the time to full velocity, must
    be from 1e-5 to 1e7 s; a/j, the time to full acceleration, from 1e-7 to 100 s and at least 1e-7 of v/a;
    the distances v²/a and a³/j² at least 1e-11. Travel must be within ±1e9.

    Raises MachineError for other values.
    """

    name: str
    max_velocity: Limit
    max_acceleration: Limit
    max_jerk: float = math.inf
    travel: tuple[float, float] = (-math.inf, math.inf)
    max_velocity_jump: float = 0.0
    kind: AxisKind | Literal[""] = ""
    unit: str = ""

    def __post_init__(self) -> None:
        named = isinstance(self.name, str) and AXIS_NAME.fullmatch(self.name) is not None
        require(named, "axis name", self.name, NAME_REMEDY)
        place = f"axis {self.name}: "
        kind: object = self.kind
        require(
            isinstance(kind, str) and kind in ("linear", "rotary", ""),
            f"{place}kind",
            kind,
            '"linear" or "rotary"',
        )
        turns = self.name in ROTARY_LETTERS or (is_text(self.unit) and self.unit in _ROTARY_UNITS)
        kind = kind or ("rotary" if turns else "linear")
        object.__setattr__(self, "kind", kind)
        object.__setattr__(self, "unit", self.unit if self.unit != "" else self.usual_unit)
        good = is_text(self.unit) and self.unit.isprintable() and _UNIT.fullmatch(self.unit) is not None
        require(good, f"{place}unit", self.unit, "1 to 12 characters, such as mm, deg or rad")
        set_limit(self, "max_velocity", place, f"{self.unit}/s", VELOCITIES)
        slow, fast = sizes_of(self.max_velocity)
        fastest, slowest = RISE_TIMES
        most = min(slow / fastest, slow**2 / LEAST_WAY, GREATEST_ACCELERATION)
        set_limit(self, "max_acceleration", place, f"{self.unit}/s²", (fast / slowest, most))
        weak, strong = sizes_of(self.max_acceleration)
        fastest, slowest = JERK_TIMES
        fastest = max(fastest, LEAST_JERK_SHARE * fast / weak)
        ends = strong / slowest, min(weak / fastest, math.sqrt(weak**3 / LEAST_WAY))
        set_within(self, "max_jerk", place, f"{self.unit}/s³", ends, infinite=True)
        set_within(self, "max_velocity_jump", place, f"{self.unit}/s", (0.0, VELOCITIES[1]))
        remedy = f"the least position and a greater one, within {FARTHEST:g} {self.unit} or infinite"
        least, greatest = numbers(self.travel, 2, f"{place}travel", remedy, infinite=True)
        good = least < greatest and all(abs(end) <= FARTHEST or math.isinf(end) for end in (least, greatest))
        require(good, f"{place}travel", self.travel, remedy)
        object.__setattr__(self, "travel", (least, greatest))

    @property
    def velocity_range(self) -> tuple[float, float]:
        """The velocity limits (negative, positive)."""
        return range_of(self.max_velocity)

    @property
    def acceleration_range(self) -> tuple[float, float]:
        """The acceleration limits (negative, positive)."""
        return range_of(self.max_acceleration)

    @property
    def usual_unit(self) -> str:
        """The unit in programs: mm or deg."""
        return "deg" if self.kind == "rotary" else "mm"


def range_of(limit: Limit) -> tuple[float, float]:
    """The least and the greatest value that a limit allows."""
    return limit if isinstance(limit, tuple) else (-limit, limit)


def sizes_of(limit: Limit) -> tuple[float, float]:
    """The limits of both directions as absolute values, the smaller one first."""
    least, greatest = sorted(map(abs, range_of(limit)))
    return least, greatest


def size_of(limit: Limit) -> float:
    """The absolute value that a limit allows in both directions."""
    return sizes_of(limit)[0]


def usual_units(names: Iterable[str]) -> tuple[str, ...]:
    """The units of axes and directions by their names alone: deg for A, B, C, I, J, K, else mm."""
    return tuple("deg" if name in (*ROTARY_LETTERS, *DIRECTION) else "mm" for name in names)

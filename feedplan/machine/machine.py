"""A machine: its axes with their limits, its servo period and its chord tolerance."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from feedplan.arguments import is_text, shown
from feedplan.errors import MachineError
from feedplan.lazy import cached_property
from feedplan.machine.checks import (
    numbers,
    one_by_one,
    require,
    require_text,
    set_limit,
    set_within,
    written,
)
from feedplan.machine.controller import Controller

if TYPE_CHECKING:
    from feedplan.machine.kinematics import Kinematics

MAX_AXES = 9
# The letters of programs, and which of them are rotary where an axis does not say.
AXIS_LETTERS = "XYZABCUVW"
ROTARY_LETTERS = ("A", "B", "C")
# I, J and K are the tool's direction.
AXIS_NAME = re.compile(r"(?![IJK]\Z)[A-Za-z_][A-Za-z0-9_]{0,31}", re.ASCII)
# The unit of an axis stands in tables, between brackets.
_UNIT = re.compile(r"[^\s\[\]<>&\"'`\\,;]{1,12}")
_ROTARY_UNITS = ("deg", "°", "rad")
NAME_REMEDY = "1 to 32 letters, digits and underscores, no digit first, other than I, J and K"
AxisKind = Literal["linear", "rotary"]
# The same in both directions, or the least and the greatest.
Limit: TypeAlias = float | tuple[float, float]

# What numbers of machines can be, in mm or degrees and seconds. Beyond, a number is a mistake: ramps would be
# shorter than places are known, or plans longer than a year.
VELOCITIES = 1e-5, 1e9
GREATEST_ACCELERATION = 1e10
# The times [s] after which an axis has its velocity, and its acceleration.
RISE_TIMES = 1e-5, 1e7
JERK_TIMES = 1e-7, 1e2
# The time to full acceleration is this part of the time to full velocity, or more.
LEAST_JERK_SHARE = 1e-7
# The least way [mm] in which an axis has its velocity v²/a, and its acceleration a³/j².
LEAST_WAY = 1e-11
# The fastest axis is so many times as fast as the slowest one, or less.
MOST_TIMES = 1e8
PERIODS = 1e-6, 10.0
# A period is this part of the longest time to full velocity, or of this time [s], or more.
LEAST_PERIOD_SHARE, LONG = 1e-7, 1e2
CHORD_TOLERANCES = 1e-7, 1e6
# Chord tolerance e and period T limit the acceleration on arcs to 8 e/T²: to this part of an axis's, or more.
LEAST_CHORD_SHARE = 1e-9
FARTHEST = 1e9


@dataclass(frozen=True)
class Axis:
    """One axis, a joint of the machine, and its limits.

    `name`: 1 to 32 letters, digits and underscores, the first no digit, other than I, J and K (a tool's
    direction). Programs move axes named by one of the letters XYZABCUVW, paths from Python any axes.
    `max_velocity` [mm/s], `max_acceleration` [mm/s²], each one number or, where it differs by direction, two:
    (-1.0, 2.0) is at most 1 backward and 2 forward. `max_jerk` [mm/s³] (infinite: not limited),
    `travel` (least, greatest) [mm], `max_velocity_jump` [mm/s] allowed at a corner (0: corners stop).
    On a rotary axis every mm is a degree. `kind` is "linear" or "rotary"; empty, the letter or the unit
    decides: A, B and C are rotary, and axes in deg, ° or rad.

    `unit` is that of its positions, 1 to 12 characters: empty, mm, or deg on a rotary axis. Another one, such
    as rad or µm, takes the place of mm in all limits; programs, and kinematics with dimensions, need mm and
    deg. Limits and positions are never converted.

    Velocities v are from 1e-5 to 1e9, accelerations a at most 1e10; an axis has its velocity after v/a from
    1e-5 to 1e7 s, and its acceleration after a/j from 1e-7 to 100 s and 1e-7 of that time or more, in ways
    v²/a and a³/j² of 1e-11 or more. Travel is within 1e9.

    Raises MachineError for values that are none of these.
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
        """The least and the greatest velocity."""
        return range_of(self.max_velocity)

    @property
    def acceleration_range(self) -> tuple[float, float]:
        """The least and the greatest acceleration."""
        return range_of(self.max_acceleration)

    @property
    def usual_unit(self) -> str:
        """mm or deg, as programs have them."""
        return "deg" if self.kind == "rotary" else "mm"


@dataclass(frozen=True)
class Machine:
    """A machine tool.

    `period` is the servo period [s], `chord_tolerance` the allowed distance [mm] between the path and the
    straight line from one setpoint to the next (infinite: not limited), `home` the position [mm] that G28
    and G30 go to (and where programs begin if their words always are the tool's tip; empty: 0), `offsets` the
    work offsets by name (`"G54"`) [mm]; both have one number for each of `program_letters`. `kinematics` is
    the type that turns the tool tip into joint positions, `parameters` its keys in the machine file,
    `controller` what drives the machine today (or its name; None: not known). Periods
    T are from 1e-6 to 10 s and 1e-7 of the longest time to a full velocity, or of 100 s, or more, chord
    tolerances e from 1e-7 to 1e6 mm; the acceleration 8 e/T² to which they limit arcs is at least 1e-9 of the
    greatest of an axis, and no axis is more than 1e8 times as fast as another one.

    Raises MachineError for values that are none of these.
    """

    name: str
    axes: tuple[Axis, ...]
    period: float = 0.001
    chord_tolerance: float = math.inf
    kinematics: str = "cartesian"
    home: tuple[float, ...] = ()
    offsets: tuple[tuple[str, tuple[float, ...]], ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict, hash=False)
    controller: Controller | None = None

    def __post_init__(self) -> None:
        require_text(self.name, "name")
        require_text(self.kinematics, "kinematics")
        object.__setattr__(self, "axes", _axes(self.axes))
        speeds = {axis: sizes_of(axis.max_velocity) for axis in self.axes}
        fastest = max(self.axes, key=lambda axis: speeds[axis][1])
        for axis in self.axes:
            least, what = speeds[fastest][1] / MOST_TIMES, f"axis {axis.name}: max_velocity"
            remedy = f"{least:g} {axis.unit}/s or more, beside {speeds[fastest][1]:g} of axis {fastest.name}"
            require(speeds[axis][0] >= least, what, axis.max_velocity, remedy)
        rise = max(speeds[axis][1] / size_of(axis.max_acceleration) for axis in self.axes)
        set_within(
            self, "period", "", "s", (max(PERIODS[0], LEAST_PERIOD_SHARE * min(rise, LONG)), PERIODS[1])
        )
        set_within(self, "chord_tolerance", "", "mm", CHORD_TOLERANCES, infinite=True)
        strongest = max(sizes_of(axis.max_acceleration)[1] for axis in self.axes)
        least = LEAST_CHORD_SHARE / 8.0 * strongest * self.period**2
        require(
            self.chord_tolerance >= least,
            f"with a period of {self.period:g} s the chord_tolerance",
            self.chord_tolerance,
            f"{least:.3g} mm or more, or a shorter period",
        )
        remedy = "a table of its keys, other than type, as in a machine file"
        keyed = isinstance(self.parameters, Mapping) and "type" not in self.parameters
        require(keyed, "kinematics", self.parameters, remedy)
        object.__setattr__(self, "parameters", written(self.parameters, "kinematics"))
        if self.controller is not None:
            object.__setattr__(self, "controller", Controller.of(self.controller))
        letters = self.program_letters
        remedy = f"{len(letters)} finite numbers, for the program's axes {', '.join(letters)}"
        home = one_by_one(self.home, "home", remedy)
        object.__setattr__(self, "home", numbers(home, len(letters), "home", remedy) if home else ())
        pairs = _pairs(self.offsets)
        offsets = tuple((key, numbers(row, len(letters), str(key), remedy)) for key, row in pairs)
        require(len(dict(offsets)) == len(offsets), "offsets", self.offsets, "each name once")
        object.__setattr__(self, "offsets", offsets)

    def __repr__(self) -> str:
        return f"<Machine {self.name}: {self.kinematics}, axes {' '.join(self.axis_names)}>"

    @property
    def axis_names(self) -> tuple[str, ...]:
        """The names of the axes in order."""
        return tuple(axis.name for axis in self.axes)

    def axis(self, name: str) -> Axis:
        """The axis of that name; raises MachineError where there is none."""
        for axis in self.axes:
            if isinstance(name, str) and axis.name == name:
                return axis
        own = ", ".join(self.axis_names)
        raise MachineError(f"machine {self.name} has no axis {name!s:.60}: it has {own}")

    @property
    def is_plain(self) -> bool:
        """Every program axis is the joint of its own letter, in the same unit."""
        return self.kinematics == "cartesian" and not self.parameters

    @property
    def words_are_joints(self) -> bool:
        """Axis words are joint positions as they stand, unless G43.4 or the like says otherwise."""
        return self.is_plain or not self.inverse.always

    @property
    def program_letters(self) -> tuple[str, ...]:
        """The letters of a program's axis words: the tip's where words always mean that, else the joints'."""
        return self.axis_names if self.words_are_joints else self.inverse.tip_names

    @cached_property
    def inverse(self) -> Kinematics:
        """The kinematics q = K(P) with this machine's dimensions; raises MachineError if they do not fit."""
        from feedplan.machine import kinematics

        return kinematics.create(self.kinematics, self.axes, self.parameters, self.name)

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Machine:
        """The bundled machine of that name, or the machine in a TOML file.

        Raises MachineError naming the file, the key and the remedy.
        """
        from feedplan.machine.file import MAX_LETTERS, parse

        remedy = "the name of a bundled machine, or the path of a .toml file"
        require(isinstance(source, (str, os.PathLike)), "the machine", source, remedy)
        text = os.fspath(source)
        require(isinstance(text, str), "the machine", source, remedy)
        if text.endswith(".toml") or "/" in text or "\\" in text:
            path = FilePath(text)
            try:
                with path.open(encoding="utf-8") as file:
                    content = file.read(MAX_LETTERS + 1)
            except (OSError, ValueError) as error:
                raise MachineError(f"machine file {text} cannot be read: {error}") from None
            return parse(content, text)
        return parse(bundled_text(text), text)

    @classmethod
    def of(cls, given: Machine | str | os.PathLike[str]) -> Machine:
        """A machine as it is, or what `load` makes of a name or file."""
        return given if isinstance(given, Machine) else cls.load(given)

    def to_toml(self) -> str:
        """The text of a machine file that gives the same machine."""
        from feedplan.machine.file import text_of

        return text_of(self)

    def with_period(self, period: float) -> Machine:
        """The same machine with another servo period [s]."""
        return replace(self, period=period)


def range_of(limit: Limit) -> tuple[float, float]:
    """The least and the greatest value that a limit allows."""
    return limit if isinstance(limit, tuple) else (-limit, limit)


def sizes_of(limit: Limit) -> tuple[float, float]:
    """What a limit allows in both directions, and in one of them."""
    least, greatest = sorted(map(abs, range_of(limit)))
    return least, greatest


def size_of(limit: Limit) -> float:
    """What a limit allows in both directions."""
    return sizes_of(limit)[0]


def usual_units(names: Iterable[str]) -> tuple[str, ...]:
    """The units of axes and directions by their names alone: deg of A, B, C, I, J, K, else mm."""
    return tuple("deg" if name in (*ROTARY_LETTERS, "I", "J", "K") else "mm" for name in names)


def bundled_machines() -> tuple[str, ...]:
    """The names of the machines that come with feedplan."""
    models = resources.files(__package__).joinpath("models")
    return tuple(sorted(entry.name[:-5] for entry in models.iterdir() if entry.name.endswith(".toml")))


def bundled_text(name: str) -> str:
    """The machine file of a bundled machine; raises MachineError where there is none of that name."""
    if name not in bundled_machines():
        known = ", ".join(bundled_machines())
        raise MachineError(
            f"there is no bundled machine {shown(name)}: use one of {known}, or the path of a .toml file"
        )
    return resources.files(__package__).joinpath("models", f"{name}.toml").read_text("utf-8")


def template() -> str:
    """The text of a machine file with comments, to begin with."""
    return resources.files(__package__).joinpath("template.toml").read_text("utf-8")


def _axes(given: Any) -> tuple[Axis, ...]:
    """Axes of different names; raises MachineError that names the first which cannot be used."""
    remedy = f"a list of 1 to {MAX_AXES} axes"
    if isinstance(given, Axis):
        raise MachineError(f"axes is the axis {given.name} alone: give {remedy}")
    axes = one_by_one(given, "axes", remedy)
    for number, axis in enumerate(axes, 1):
        require(isinstance(axis, Axis), f"axis {number}", axis, 'an Axis, as Axis("X", 100, 1000)')
    if not 0 < len(axes) <= MAX_AXES:
        raise MachineError(f"the machine has {len(axes)} axes: give {remedy}")
    seen: set[str] = set()
    for axis in axes:
        if axis.name in seen:
            raise MachineError(f"axis {axis.name} comes twice: give each axis another name")
        seen.add(axis.name)
    return axes


def _pairs(offsets: Any) -> tuple[tuple[str, Any], ...]:
    """Names and places, given as such or as a mapping; raises MachineError for anything else."""
    remedy = "names with places, such as G54 with [0.0, 0.0, 0.0]"
    pairs = one_by_one(offsets.items() if isinstance(offsets, Mapping) else offsets, "offsets", remedy)
    good = all(isinstance(pair, tuple) and len(pair) == 2 for pair in pairs)
    require(good, "offsets", offsets, remedy)
    for name, _ in pairs:
        require_text(name, "offsets: a name")
    return pairs

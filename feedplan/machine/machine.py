"""A machine: its axes with their limits, its servo period and its chord tolerance, read from TOML."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import resources
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from feedplan.errors import MachineError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

if TYPE_CHECKING:
    from feedplan.machine.kinematics import Kinematics

MAX_AXES = 6
AXIS_LETTERS = "XYZABCUVW"


@dataclass(frozen=True)
class Axis:
    """One axis, a joint of the machine, and its limits.

    `max_velocity` [mm/s], `max_acceleration` [mm/s²], `max_jerk` [mm/s³] (infinite: not limited),
    `travel` (least, greatest) [mm], `max_velocity_jump` [mm/s] allowed at a corner (0: corners stop).
    On a rotary axis every mm is a degree. `kind` is "linear" or "rotary"; empty, the letter decides: A, B and
    C are rotary.
    """

    name: str
    max_velocity: float
    max_acceleration: float
    max_jerk: float = math.inf
    travel: tuple[float, float] = (-math.inf, math.inf)
    max_velocity_jump: float = 0.0
    kind: str = ""

    def __post_init__(self) -> None:
        if not self.kind:
            object.__setattr__(self, "kind", _kind_of(self.name))

    @property
    def unit(self) -> str:
        """The unit its positions are in: mm or deg."""
        return "deg" if self.kind == "rotary" else "mm"


@dataclass(frozen=True)
class Machine:
    """A machine tool.

    `period` is the servo period [s], `chord_tolerance` the allowed distance [mm] between the path and the
    straight line from one setpoint to the next (infinite: not limited), `home` the position [mm] that G28
    and G30 go to (and where programs begin if their words always are the tool's tip), `offsets` the work
    offsets by name (`"G54"`) [mm]; both have one number for each of `program_letters`. `kinematics` is the
    type that turns the tool tip into joint positions, `parameters` its keys in the machine file.
    """

    name: str
    axes: tuple[Axis, ...]
    period: float = 0.001
    chord_tolerance: float = math.inf
    kinematics: str = "cartesian"
    home: tuple[float, ...] = ()
    offsets: tuple[tuple[str, tuple[float, ...]], ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def axis_names(self) -> tuple[str, ...]:
        """The axis letters in order."""
        return tuple(axis.name for axis in self.axes)

    def axis(self, name: str) -> Axis:
        """The axis of that letter; raises MachineError where there is none."""
        for axis in self.axes:
            if axis.name == name:
                return axis
        raise MachineError(f"machine {self.name} has no axis {name}: it has {', '.join(self.axis_names)}")

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
    def load(cls, source: str | FilePath) -> Machine:
        """The bundled machine of that name, or the machine in a TOML file.

        Raises MachineError naming the file, the key and the remedy.
        """
        text = str(source)
        if text.endswith(".toml") or "/" in text or "\\" in text:
            path = FilePath(text)
            try:
                content = path.read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                raise MachineError(f"machine file {text} cannot be read: {error}") from None
            return _parse(content, text)
        if text not in bundled_machines():
            known = ", ".join(bundled_machines())
            raise MachineError(
                f"there is no bundled machine '{text}': use one of {known}, or the path of a .toml file"
            )
        return _parse(
            resources.files(__package__).joinpath("models", f"{text}.toml").read_text("utf-8"), text
        )

    def with_period(self, period: float) -> Machine:
        """The same machine with another servo period [s]."""
        _require(math.isfinite(period) and period > 0, self.name, "period", period, "a positive number [s]")
        return replace(self, period=period)


def bundled_machines() -> tuple[str, ...]:
    """The names of the machines that come with feedplan."""
    models = resources.files(__package__).joinpath("models")
    return tuple(sorted(entry.name[:-5] for entry in models.iterdir() if entry.name.endswith(".toml")))


_MACHINE_KEYS = {"name", "description", "period", "chord_tolerance", "kinematics", "home", "offsets", "axes"}
_AXIS_KEYS = {"name", "max_velocity", "max_acceleration", "max_jerk", "travel", "max_velocity_jump", "kind"}


def _require(condition: bool, place: str, key: str, value: object, remedy: str) -> None:
    if not condition:
        raise MachineError(f"machine {place}: {key} is {value!r}: give {remedy}")


def _number(table: dict[str, Any], key: str, place: str, default: float | None, unit: str) -> float:
    """A positive number from a TOML table; infinite only as a default."""
    if key not in table and default is not None:
        return default
    value = table.get(key, "missing")
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value < math.inf
    _require(good, place, key, value, f"a positive number [{unit}]")
    return float(value)


def _numbers(values: Any, count: int, place: str, key: str) -> tuple[float, ...]:
    good = (
        isinstance(values, list)
        and len(values) == count
        and all(isinstance(v, (int, float)) and not isinstance(v, bool) and math.isfinite(v) for v in values)
    )
    _require(good, place, key, values, f"a list of {count} finite numbers")
    return tuple(float(value) for value in values)


def _parse(text: str, place: str) -> Machine:
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise MachineError(f"machine {place} is not valid TOML: {error}") from None
    unknown = sorted(set(table) - _MACHINE_KEYS)
    _require(not unknown, place, "keys", unknown, f"only {', '.join(sorted(_MACHINE_KEYS))}")
    rows = table.get("axes")
    good_rows = isinstance(rows, list) and all(isinstance(row, dict) for row in rows)
    good_count = good_rows and 0 < len(rows or []) <= MAX_AXES
    _require(good_count, place, "axes", rows, f"1 to {MAX_AXES} [[axes]] tables")
    axes = tuple(_parse_axis(row, place) for row in rows or [])
    names = [axis.name for axis in axes]
    _require(len(set(names)) == len(names), place, "axes", names, "each axis letter once")
    kinematics = table.get("kinematics", "cartesian")
    parameters = {"type": kinematics} if isinstance(kinematics, str) else kinematics
    good_type = isinstance(parameters, dict) and isinstance(parameters.get("type"), str)
    _require(good_type, place, "kinematics", kinematics, 'a name, or a table with type = "cartesian"')
    offsets = table.get("offsets", {})
    _require(isinstance(offsets, dict), place, "offsets", offsets, "a table such as G54 = [0.0, 0.0, 0.0]")
    machine = Machine(
        name=str(table.get("name", place)),
        axes=axes,
        period=_number(table, "period", place, 0.001, "s"),
        chord_tolerance=_number(table, "chord_tolerance", place, math.inf, "mm"),
        kinematics=parameters["type"],
        parameters={key: value for key, value in parameters.items() if key != "type"},
    )
    if not machine.is_plain:
        _check_kinematics(machine, place)
    letters = machine.program_letters
    home = table.get("home", [0.0] * len(letters))
    return replace(
        machine,
        home=_places(home, letters, place, "home"),
        offsets=tuple((key, _places(row, letters, place, key)) for key, row in offsets.items()),
    )


def _places(values: Any, letters: tuple[str, ...], place: str, key: str) -> tuple[float, ...]:
    """One number for each letter of a program."""
    good = isinstance(values, list) and len(values) == len(letters)
    _require(good, place, key, values, f"{len(letters)} numbers, for the program's axes {', '.join(letters)}")
    return _numbers(values, len(letters), place, key)


def _check_kinematics(machine: Machine, place: str) -> None:
    """A wrong kinematics is refused when the file is read, with the file's name."""
    from feedplan.machine import kinematics

    kinematics.create(machine.kinematics, machine.axes, machine.parameters, place)


def _kind_of(letter: str) -> str:
    return "rotary" if letter in "ABC" else "linear"


def _parse_axis(row: dict[str, Any], machine: str) -> Axis:
    name = row.get("name")
    good = isinstance(name, str) and len(name) == 1 and name in AXIS_LETTERS
    _require(good, machine, "axis name", name, f"one of the letters {AXIS_LETTERS}")
    place = f"{machine}, axis {name}"
    kind = row.get("kind", _kind_of(str(name)))
    _require(kind in ("linear", "rotary"), place, "kind", kind, '"linear" or "rotary"')
    unit = "deg" if kind == "rotary" else "mm"
    unknown = sorted(set(row) - _AXIS_KEYS)
    _require(not unknown, place, "keys", unknown, f"only {', '.join(sorted(_AXIS_KEYS))}")
    travel = _numbers(row["travel"], 2, place, "travel") if "travel" in row else (-math.inf, math.inf)
    _require(travel[0] < travel[1], place, "travel", travel, "[least, greatest] with least < greatest")
    jump = row.get("max_velocity_jump", 0.0)
    good_jump = isinstance(jump, (int, float)) and not isinstance(jump, bool) and 0 <= jump < math.inf
    _require(good_jump, place, "max_velocity_jump", jump, f"a finite number ≥ 0 [{unit}/s]")
    return Axis(
        name=str(name),
        max_velocity=_number(row, "max_velocity", place, None, f"{unit}/s"),
        max_acceleration=_number(row, "max_acceleration", place, None, f"{unit}/s²"),
        max_jerk=_number(row, "max_jerk", place, math.inf, f"{unit}/s³"),
        travel=(travel[0], travel[1]),
        max_velocity_jump=float(jump),
        kind=kind,
    )

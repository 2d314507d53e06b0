"""A machine: its axes with their limits, its servo period and its chord tolerance."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from importlib import resources
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from feedplan.arguments import printable, shown
from feedplan.errors import MachineError, unreadable
from feedplan.lazy import cached_property
from feedplan.machine.axis import Axis, size_of, sizes_of
from feedplan.machine.checks import numbers, one_by_one, require, require_text, set_within, written
from feedplan.machine.controller import Controller
from feedplan.machine.toml import MAX_LETTERS, table_lines, table_of, toml_value

if TYPE_CHECKING:
    from feedplan.machine.kinematics import Kinematics

MAX_AXES = 9
# The greatest ratio of the velocities of two axes.
MOST_TIMES = 1e8
PERIODS = 1e-6, 10.0
# The least period as a share of the longest time in which an axis reaches full velocity, which counts as at
# most `LONG` [s].
LEAST_PERIOD_SHARE, LONG = 1e-7, 1e2
CHORD_TOLERANCES = 1e-7, 1e6
# Chord tolerance e and period T limit the acceleration on arcs to 8 e/T², which must be at least this share
# of an axis's limit.
LEAST_CHORD_SHARE = 1e-9


@dataclass(frozen=True)
class Machine:
    """A machine tool.

    `period` is the servo period [s], `chord_tolerance` the allowed distance [mm] between the path and the
    straight line from one setpoint to the next (infinite: not limited), `home` the position [mm] that G28 and
    G30 go to (and where programs begin if their words always mean the tool's tip; empty: 0), `offsets` the
    work offsets by name (`"G54"`) [mm]; both have one number for each of `program_letters`. `kinematics` is
    the type that computes joint positions from the tool tip, `parameters` its keys in the machine file,
    `controller` the controller that drives the machine today (or its name; None: not known). Periods T must
    be from 1e-6 to 10 s, and at least 1e-7 of the longest time in which an axis reaches full velocity (at
    most 100 s counts). Chord tolerances e must be from 1e-7 to 1e6 mm; they limit the acceleration on arcs to
    8 e/T², which must be at least 1e-9 of the greatest acceleration of an axis. No axis may be more than 1e8
    times as fast as another one.

    Raises MachineError for other values.
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
        """Whether every program axis is the joint of its own letter, in the same unit."""
        return self.kinematics == "cartesian" and not self.parameters

    @property
    def words_are_joints(self) -> bool:
        """Whether axis words are joint positions, unless G43.4 or the like changes this."""
        return self.is_plain or not self.inverse.always

    @property
    def program_letters(self) -> tuple[str, ...]:
        """The letters of a program's axis words: the tip's if words always mean the tip, else the joints'."""
        return self.axis_names if self.words_are_joints else self.inverse.tip_names

    @cached_property
    def inverse(self) -> Kinematics:
        """The kinematics q = K(P) with this machine's dimensions; raises MachineError if they do not fit."""
        # Imported here, because most machines are plain and need no kinematics.
        from feedplan.machine import kinematics

        return kinematics.create(self.kinematics, self.axes, self.parameters, self.name)

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Machine:
        """The bundled machine of that name, or the machine in a TOML file.

        Raises MachineError naming the file, the key and the remedy.
        """
        remedy = "the name of a bundled machine, or the path of a .toml file"
        require(isinstance(source, (str, os.PathLike)), "the machine", source, remedy)
        text = os.fspath(source)
        require(isinstance(text, str), "the machine", source, remedy)
        if text.lower().endswith(".toml") or "/" in text or "\\" in text:
            path = FilePath(text)
            try:
                with path.open(encoding="utf-8") as file:
                    content = file.read(MAX_LETTERS + 1)
            except (OSError, ValueError) as error:
                remedy = "the path of a .toml file in UTF-8"
                raise MachineError(unreadable(f"machine file {text}", error, remedy)) from None
            return cls.from_toml(content, printable(text))
        return cls.from_toml(bundled_text(text), text)

    @classmethod
    def of(cls, given: Machine | str | os.PathLike[str]) -> Machine:
        """The machine itself, or the machine that `load` finds for a name or file."""
        return given if isinstance(given, Machine) else cls.load(given)

    @classmethod
    def from_toml(cls, text: str, name: str, joints_only: bool = False) -> Machine:
        """The machine that the text of the machine file `name` describes.

        `joints_only` ignores its kinematics, and everything that depends on it: for checking setpoints the
        limits of the joints suffice, also where a kinematics registered by a user is not known. Raises
        MachineError naming the file, the key and the remedy.
        """
        require_text(name, "the name of the machine file")
        require(isinstance(text, str), f"the text of machine file {name}", text, "a text")
        try:
            table = table_of(text)
            if joints_only:
                table = {key: value for key, value in table.items() if key not in _OF_KINEMATICS}
            return cls(**_fields(table, name))
        except MachineError as error:
            raise MachineError(f"machine file {name}: {error}") from None
        except (ValueError, RecursionError) as error:
            raise MachineError(f"machine file {name} is not valid TOML ({error}): correct it there") from None

    def to_toml(self) -> str:
        """The text of a machine file for this machine."""
        head: dict[str, Any] = {"name": self.name, "period": self.period}
        head["chord_tolerance"] = self.chord_tolerance
        if self.home:
            head["home"] = list(self.home)
        lines = [f"{key} = {toml_value(value)}" for key, value in head.items()]
        lines += table_lines("[kinematics]", {"type": self.kinematics, **self.parameters})
        lines += table_lines("[offsets]", dict(self.offsets)) if self.offsets else []
        if self.controller:
            lines += table_lines("[controller]", {"type": self.controller.name, **self.controller.parameters})
        for axis in self.axes:
            given = {own.name: getattr(axis, own.name) for own in fields(axis)}
            changed = {key: value for key, value in given.items() if value != _AXIS_DEFAULTS[key]}
            lines += table_lines("[[axes]]", changed)
        return "\n".join(lines) + "\n"

    def with_period(self, period: float) -> Machine:
        """This machine with another servo period [s]."""
        return replace(self, period=period)


# Keys of a machine file.
_AXIS_DEFAULTS = {own.name: own.default for own in fields(Axis)}
_OF_KINEMATICS = {"kinematics", "home", "offsets", "controller"}
_MACHINE_KEYS = {own.name for own in fields(Machine)} - {"parameters"} | {"description"}


def bundled_machines() -> tuple[str, ...]:
    """The names of the machines that come with feedplan."""
    models = resources.files(__package__).joinpath("models")
    return tuple(sorted(entry.name[:-5] for entry in models.iterdir() if entry.name.endswith(".toml")))


def bundled_text(name: str) -> str:
    """The machine file of a bundled machine; raises MachineError for an unknown name."""
    if name not in bundled_machines():
        known = ", ".join(bundled_machines())
        raise MachineError(
            f"there is no bundled machine {shown(name)}: use one of {known}, or the path of a .toml file"
        )
    return resources.files(__package__).joinpath("models", f"{name}.toml").read_text("utf-8")


def template() -> str:
    """The text of a commented machine file, as a start for users."""
    return resources.files(__package__).joinpath("template.toml").read_text("utf-8")


def _fields(table: dict[str, Any], name: str) -> dict[str, Any]:
    """The fields of the machine that a machine file describes."""
    _check_keys(table, _MACHINE_KEYS, "")
    rows: Any = table.get("axes")
    remedy = "an [[axes]] table for each axis"
    require(isinstance(rows, list), "axes", rows, remedy)
    for number, row in enumerate(rows, 1):
        require(isinstance(row, dict), f"axis {number}", row, remedy)
    plain = ("period", "chord_tolerance", "home", "offsets", "controller")
    given = {key: table[key] for key in plain if key in table}
    driven = table.get("kinematics", "cartesian")
    parameters = {"type": driven} if isinstance(driven, str) else driven
    if not (isinstance(parameters, dict) and isinstance(parameters.get("type"), str)):
        remedy = 'give a name, or a table with type = "cartesian"'
        raise MachineError(f"kinematics is {shown(driven)}: {remedy}")
    return {
        "name": table.get("name", FilePath(name).stem),
        "axes": tuple(_axis(row) for row in rows),
        "kinematics": parameters["type"],
        "parameters": {key: value for key, value in parameters.items() if key != "type"},
        **given,
    }


def _axis(row: dict[str, Any]) -> Axis:
    place = f"axis {row.get('name')}: "
    _check_keys(row, set(_AXIS_DEFAULTS), place)
    for key, default in _AXIS_DEFAULTS.items():
        if default is MISSING and key not in row:
            raise MachineError(f"{place}{key} is missing: give it")
    return Axis(**row)


def _check_keys(table: dict[str, Any], known: set[str], place: str) -> None:
    unknown = sorted(set(table) - known)
    if unknown:
        remedy = f"give only {', '.join(sorted(known))}"
        raise MachineError(f"{place}the keys {shown(unknown)} are not known: {remedy}")


def _axes(given: Any) -> tuple[Axis, ...]:
    """Axes with different names; raises MachineError that names the first one that cannot be used."""
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
    """Names with positions, from a list of pairs or a mapping; raises MachineError for anything else."""
    remedy = "names with places, such as G54 with [0.0, 0.0, 0.0]"
    pairs = one_by_one(offsets.items() if isinstance(offsets, Mapping) else offsets, "offsets", remedy)
    good = all(isinstance(pair, tuple) and len(pair) == 2 for pair in pairs)
    require(good, "offsets", offsets, remedy)
    for name, _ in pairs:
        require_text(name, "offsets: a name")
    return pairs

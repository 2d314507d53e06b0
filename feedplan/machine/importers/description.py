"""A machine found in a controller's file: its numbers with their sources, and the machine file made from
them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

from feedplan.arguments import is_number, shown
from feedplan.errors import MachineError
from feedplan.machine.axis import FARTHEST, GREATEST_ACCELERATION, JERK_TIMES, ROTARY_LETTERS, VELOCITIES
from feedplan.machine.controller import MODELS
from feedplan.machine.importers.text_files import Setting
from feedplan.machine.toml import toml_value

# The names of an axis's limits for `limits`, and their keys in a machine file.
LIMITS = {"velocity": "max_velocity", "acceleration": "max_acceleration", "jerk": "max_jerk"}
_NEEDED = ("velocity", "acceleration")
# Numbers from this size on, such as 1e99, mean that there is no limit.
_NONE_FROM = {
    "velocity": VELOCITIES[1],
    "acceleration": GREATEST_ACCELERATION,
    "jerk": GREATEST_ACCELERATION / JERK_TIMES[0],
}
_DIGITS = 12
_LONGEST = 160
_TIME = {"velocity": "/s", "acceleration": "/s²", "jerk": "/s³"}


@dataclass(frozen=True)
class Found:
    """A number [mm, deg, s, or the axis's own unit] and its source."""

    value: float
    source: str


def least(candidates: Iterable[Found | None]) -> Found | None:
    """The least of the limits that are known; None if none is known."""
    return min((each for each in candidates if each is not None), key=lambda each: each.value, default=None)


def greatest(candidates: Iterable[Found | None]) -> Found | None:
    """The greatest of the numbers that are known; None if none is known."""
    return max((each for each in candidates if each is not None), key=lambda each: each.value, default=None)


@dataclass(frozen=True)
class FoundAxis:
    """An axis: `limits` by the names of `LIMITS`; `travel` (least, greatest), None if not known.

    `unused_travel` is a travel that the controller does not enforce, with the reason.
    """

    name: str
    limits: Mapping[str, Found]
    travel: tuple[Found, Found] | None = None
    unused_travel: tuple[float, float, str] | None = None
    kind: str = ""
    unit: str = ""

    @property
    def shown_unit(self) -> str:
        """The unit of its positions."""
        turns = self.kind == "rotary" or (self.name in ROTARY_LETTERS and self.kind != "linear")
        return self.unit or ("deg" if turns else "mm")


@dataclass(frozen=True)
class FoundMachine:
    """A machine from a controller's file: `origin` names file and controller, `period` [s] is that of the
    servo, with its source.

    `remarks` are sentences for the head of the machine file; `warnings` are sentences that the user must see.
    `controller` is the name of its model (`feedplan.machine.controller`), empty if there is none, and
    `parameters` are the model's parameters in the file.
    """

    name: str
    origin: str
    axes: tuple[FoundAxis, ...]
    period: Found
    kinematics: str = "cartesian"
    remarks: tuple[str, ...] = ()
    warnings: tuple[str, ...] = field(default=())
    controller: str = ""
    parameters: Mapping[str, Found] = field(default_factory=dict)

    def with_limits(self, given: Mapping[str, float]) -> FoundMachine:
        """This machine with limits given by name, such as `X.jerk`, which replace those of the file.

        Raises MachineError for unknown names, for values that are no positive numbers, and for velocities and
        accelerations that are still missing: the message names all of these.
        """
        axes = {axis.name: axis for axis in self.axes}
        for key, value in given.items():
            name, _, limit = key.rpartition(".") if isinstance(key, str) else ("", "", "")
            limit = limit.removeprefix("max_")
            axis = axes.get(name) or axes.get(name.upper())
            if axis is None or limit not in LIMITS:
                raise MachineError(
                    f"there is no limit {shown(key)}: give one such as {self.axes[0].name}.jerk, of the axes "
                    f"{', '.join(axes)} and the limits {', '.join(LIMITS)}"
                )
            if not (is_number(value) and 0.0 < value < math.inf):
                unit = axis.shown_unit + _TIME[limit]
                raise MachineError(f"the limit {key} is {shown(value)}: give a number > 0 [{unit}]")
            file = axis.limits.get(limit)
            source = "given" if file is None else f"given in place of {_number(file.value)} of {file.source}"
            axes[axis.name] = replace(axis, limits={**axis.limits, limit: Found(float(value), source)})
        result = replace(self, axes=tuple(axes.values()))
        result._require_limits()
        return result

    def notes(self) -> tuple[str, ...]:
        """Sentences for the user: what a machine file cannot express, and what the file lacks."""
        without = [axis.name for axis in self.axes if "jerk" not in axis.limits]
        if not without:
            return self.warnings
        note = f"{self.origin} has no jerk of {', '.join(without)}: jerk-limited, s-curve and ruckig need it"
        return (*self.warnings, f"{note} (--limit {without[0]}.jerk=...)")

    def to_toml(self) -> str:
        """The text of a machine file, with the source of each number as a comment."""
        lines = [_comment(f"From {self.origin}: in mm, degrees and seconds, or an axis's own unit.")]
        lines += [_comment(remark) for remark in (*self.remarks, *self.warnings)]
        lines += [f"name = {toml_value(self.name)}", _row("period", self.period)]
        lines += [] if self.kinematics == "cartesian" else [f"kinematics = {toml_value(self.kinematics)}"]
        lines += ["", "[controller]", f"type = {toml_value(self.controller)}"] if self.controller else []
        lines += [_row(key, own) for key, own in self.parameters.items()]
        for axis in self.axes:
            own: dict[str, Any] = {"name": axis.name, "kind": axis.kind, "unit": axis.unit}
            lines += ["", "[[axes]]", *(f"{key} = {toml_value(text)}" for key, text in own.items() if text)]
            for limit, key in LIMITS.items():
                if limit in axis.limits:
                    lines.append(_row(key, axis.limits[limit]))
                else:
                    lines.append(f"# {key} = ...  # [{axis.shown_unit}{_TIME[limit]}], the file has none")
            lines += _travel_rows(axis)
        return "\n".join(lines) + "\n"

    def _require_limits(self) -> None:
        lacking: dict[tuple[str, ...], list[str]] = {}
        for limit in _NEEDED:
            names = tuple(axis.name for axis in self.axes if limit not in axis.limits)
            if names:
                lacking.setdefault(names, []).append(limit)
        if lacking:
            parts = (f"{' or '.join(own)} of {', '.join(names)}" for names, own in lacking.items())
            names, own = next(iter(lacking.items()))
            raise MachineError(
                f"{self.origin} has no {' and no '.join(parts)}: give each by --limit, as "
                f"--limit {names[0]}.{own[0]}=100, in mm, degrees (or the axis's unit) and seconds"
            )


def limits_of(found: Mapping[str, Found | None]) -> dict[str, Found]:
    """The limits that are known and in range; a jerk of 0 and numbers too great for a limit mean no limit."""
    return {
        limit: own
        for limit, own in found.items()
        if own is not None and own.value < _NONE_FROM[limit] and not (limit == "jerk" and own.value == 0.0)
    }


def parameters_of(controller: str, settings: Mapping[str, Setting], per_mm: float = 1.0) -> dict[str, Found]:
    """The parameters of the controller's model that its settings give with an allowed value; lengths in the
    settings are in units of 1/`per_mm` mm."""
    parameters = MODELS[controller].parameters
    found: dict[str, Found] = {}
    for key, setting in settings.items():
        with suppress(MachineError):
            unit = per_mm if parameters[key].unit.startswith("mm") else 1.0
            found[key] = Found(parameters[key].checked(key, setting.number / unit), setting.source)
    return found


def travel_of(low: Found | None, high: Found | None) -> tuple[Found, Found] | None:
    """The travel between two ends; an unknown end is infinite. None if both are unknown or beyond
    FARTHEST."""
    low, high = low or Found(-math.inf, "no lower end"), high or Found(math.inf, "no upper end")
    return None if min(abs(low.value), abs(high.value)) > FARTHEST else (low, high)


def _travel_rows(axis: FoundAxis) -> list[str]:
    if axis.unused_travel is not None:
        low, high, reason = axis.unused_travel
        return [f"# travel = [{_number(low)}, {_number(high)}]{_comment('  ' + reason, '  # ')}"]
    if axis.travel is None:
        return []
    ends = ", ".join(map(_end, axis.travel))
    sources = dict.fromkeys(end.source for end in axis.travel)
    return [f"{f'travel = [{ends}]':<30}" + _comment(" and ".join(sources), " # ")]


def _end(end: Found) -> str:
    infinite = "inf" if end.value > 0 else "-inf"
    return _number(end.value) if abs(end.value) <= FARTHEST else infinite


def _row(key: str, found: Found) -> str:
    return f"{f'{key} = {_number(found.value)}':<30}" + _comment(found.source, " # ")


def _number(value: float) -> str:
    """A number as text, without the rounding errors of a conversion of units."""
    return repr(float(f"{value:.{_DIGITS}g}"))


def _comment(text: str, mark: str = "# ") -> str:
    """A comment on one line, even if the text has line breaks."""
    line = " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
    return mark + (line if len(line) <= _LONGEST else f"{line[: _LONGEST - 3]}...")

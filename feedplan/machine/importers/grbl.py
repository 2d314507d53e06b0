"""Makes machines of grbl and grblHAL from the output of `$$`:
https://github.com/gnea/grbl/wiki/Grbl-v1.1-Configuration.

| setting | what it becomes, for axis k of XYZABCUVW |
|---|---|
| $110 + k [mm/min] | velocity |
| $120 + k [mm/s²] | acceleration |
| $800 + k [mm/s³] | jerk, of grblHAL where it is built with it |
| $130 + k [mm] | travel from −$130 to 0, a comment where soft limits ($20) are off |
| $22 bit 3, $23 | travel from 0 on, where homing sets 0 at the low end (grblHAL) |
| $376 | which of A, B, C, U, V are rotary (grblHAL) |
| $11, $12 [mm], $398 | junction_deviation, arc_tolerance, planner_blocks of [controller]; grblHAL has $398 |

The last value of a setting counts. All other lines of the file, such as a log of the session, are ignored.
"""

from __future__ import annotations

import re
from pathlib import Path

from feedplan.errors import MachineError
from feedplan.machine.axis import AXIS_LETTERS
from feedplan.machine.importers.description import Found, FoundAxis, FoundMachine, limits_of, parameters_of
from feedplan.machine.importers.text_files import Setting, TextFiles
from feedplan.units import SECONDS_PER_MINUTE

CONTROLLER = "grbl"
_SETTING = re.compile(r"^[ \t>]*\$(\d{1,5})\s*=\s*(.*)$", re.ASCII)
RECOGNISED = re.compile(r"^[ \t>]*\$\d{1,5}[ \t]*=", re.MULTILINE | re.ASCII)

_SOFT_LIMITS, _HOMING, _TO_LOW_END, _ROTARY = 20, 22, 23, 376
_BLOCKS = 398
_OF_CONTROLLER = {"junction_deviation": 11, "arc_tolerance": 12, "planner_blocks": _BLOCKS}
_VELOCITY, _ACCELERATION, _TRAVEL, _JERK = 110, 120, 130, 800
_ZERO_AT_HOME = 8
_MAY_TURN = "ABCUV"


def read(path: Path, files: TextFiles) -> FoundMachine:
    """The machine from the lines of `$$`; raises MachineError where no axis has a setting."""
    settings: dict[int, Setting] = {}
    for line, place in files.lines(path):
        match = _SETTING.match(line)
        if match:
            settings[int(match[1])] = Setting(f"${match[1]}", match[2].strip(), place)
    own = (_VELOCITY, _ACCELERATION, _TRAVEL)
    numbers = [k for k in range(len(AXIS_LETTERS)) if any(base + k in settings for base in own)]
    if not numbers:
        raise MachineError(f"{path.name} has no $110 to $138, the limits of axes: give all that $$ prints")
    axes = tuple(_axis(settings, k) for k in numbers)
    remarks = []
    controller = "grblhal" if _BLOCKS in settings else "grbl"
    known = {key: settings[own] for key, own in _OF_CONTROLLER.items() if own in settings}
    if any(axis.travel for axis in axes):
        remarks.append("Travel is in machine coordinates: give where the work is, as [offsets] G54 = [...].")
    return FoundMachine(
        name=path.stem,
        origin=f"{path.name} ({CONTROLLER})",
        axes=axes,
        period=Found(0.001, "grbl has none: that of the setpoints [s]"),
        remarks=tuple(remarks),
        controller=controller,
        parameters=parameters_of(controller, known),
    )


def _axis(settings: dict[int, Setting], k: int) -> FoundAxis:
    def found(base: int, per: float = 1.0) -> Found | None:
        setting = settings.get(base + k)
        return None if setting is None else Found(setting.number / per, setting.source)

    def has(number: int, bit: int) -> bool:
        return number in settings and bool(_flags(settings[number]) & bit)

    letter = AXIS_LETTERS[k]
    kind = ""
    if _ROTARY in settings and letter in _MAY_TURN:
        kind = "rotary" if has(_ROTARY, 1 << _MAY_TURN.index(letter)) else "linear"
    limits = limits_of(
        {
            "velocity": found(_VELOCITY, SECONDS_PER_MINUTE),
            "acceleration": found(_ACCELERATION),
            "jerk": found(_JERK),
        }
    )
    length = found(_TRAVEL)
    if length is None:
        return FoundAxis(letter, limits, kind=kind)
    to_low_end = has(_HOMING, _ZERO_AT_HOME) and has(_TO_LOW_END, 1 << k)
    low, high = (0.0, abs(length.value)) if to_low_end else (-abs(length.value), 0.0)
    if not has(_SOFT_LIMITS, 1):
        reason = f"{length.source}; soft limits ($20) are off"
        return FoundAxis(letter, limits, unused_travel=(low, high, reason), kind=kind)
    return FoundAxis(letter, limits, (Found(low, length.source), Found(high, length.source)), kind=kind)


def _flags(setting: Setting) -> int:
    value = setting.number
    if not (0 <= value < 1 << 16 and value == int(value)):
        raise MachineError(f"{setting.place}: {setting.label} is {setting.text[:24]}: give a whole number")
    return int(value)

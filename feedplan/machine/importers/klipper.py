"""Makes machines of Klipper from printer.cfg: https://www.klipper3d.org/Config_Reference.html.

| setting | what it becomes |
|---|---|
| [printer] max_velocity, max_accel | velocity and acceleration of each axis, or of both motors of a corexy |
| [printer] max_z_velocity, max_z_accel | those of Z; without them the two above, as Klipper does |
| [stepper_x] position_min (0 without it), position_max | travel; of Z alone on a corexy |
| these, square_corner_velocity, minimum_cruise_ratio, [gcode_arcs] resolution | [controller], not of corexy |
| [printer] kinematics | cartesian, corexy |

The last value of an option counts; `[include file]` may have `*` in the file's name. Klipper's limits hold
along the path; here they hold for each joint: diagonal moves may be faster than in Klipper on a cartesian
printer, and are slower on a corexy.
"""

from __future__ import annotations

import re
from pathlib import Path

from feedplan.arguments import shown
from feedplan.errors import MachineError
from feedplan.machine.controller import MODELS
from feedplan.machine.importers.description import (
    Found,
    FoundAxis,
    FoundMachine,
    limits_of,
    parameters_of,
    travel_of,
)
from feedplan.machine.importers.text_files import Setting, TextFiles

CONTROLLER = "Klipper"
RECOGNISED = re.compile(r"^\[(printer|include\s.*|mcu|stepper_\w+)\]", re.MULTILINE)

_SECTION = re.compile(r"\[([^\]]*)\]")
_OPTION = re.compile(r"([^:=]+)[:=](.*)")
_COMMENT = re.compile(r"#.*|(?:^|\s);.*")
_PER_AXIS = ("cartesian", "corexy")
Options = dict[tuple[str, str], Setting]


def read(path: Path, files: TextFiles) -> FoundMachine:
    """The machine from a printer.cfg; raises MachineError for kinematics that cannot be imported."""
    options: Options = {}
    _read(path, (), files, options)
    kinematics = options.get(("printer", "kinematics"))
    if kinematics is None or kinematics.text not in _PER_AXIS:
        what = "names no [printer] kinematics" if kinematics is None else f"has {shown(kinematics.text)}"
        raise MachineError(
            f"{path.name} {what}: cartesian and corexy are imported, begin others by feedplan machines new"
        )
    corexy = kinematics.text == "corexy"
    names = "UVZ" if corexy else "XYZ"
    axes = [_axis(options, name, not (corexy and name in "UV")) for name in names]
    return FoundMachine(
        name=path.stem,
        origin=f"{path.name} ({CONTROLLER})",
        axes=tuple(axes),
        period=Found(0.001, "Klipper has none: that of the setpoints [s]"),
        kinematics=kinematics.text,
        remarks=tuple(_remarks(corexy)),
        # Klipper's controller model needs joints that are the program's axes.
        controller="" if corexy else "klipper",
        parameters={} if corexy else parameters_of("klipper", _of_controller(options)),
    )


def _of_controller(options: Options) -> dict[str, Setting]:
    sections = {"resolution": "gcode_arcs"}
    keys = MODELS["klipper"].parameters
    places = {key: (sections.get(key, "printer"), key) for key in keys}
    return {key: options[place] for key, place in places.items() if place in options}


def _axis(options: Options, name: str, moves_tool: bool) -> FoundAxis:
    def found(section: str, *keys: str) -> Found | None:
        settings = (options.get((section, key)) for key in keys)
        setting = next((each for each in settings if each is not None), None)
        return None if setting is None else Found(setting.number, setting.source)

    own = name == "Z"
    limits = limits_of(
        {
            "velocity": found("printer", *["max_z_velocity"] * own, "max_velocity"),
            "acceleration": found("printer", *["max_z_accel"] * own, "max_accel"),
        }
    )
    stepper = f"stepper_{name.lower()}"
    high = found(stepper, "position_max")
    if high is None or not moves_tool:
        return FoundAxis(name, limits)
    low = found(stepper, "position_min") or Found(0.0, f"[{stepper}] has no position_min")
    return FoundAxis(name, limits, travel_of(low, high))


def _remarks(corexy: bool) -> list[str]:
    if corexy:
        return [
            "U and V are the motors, in mm of belt: the tool keeps max_velocity and max_accel in every "
            "direction; on diagonals Klipper allows 1.41 times as much.",
            "Travel of X and Y cannot be told by motors: it is left out.",
        ]
    return ["max_velocity, max_accel: along the path there, of each axis here, diagonals may be faster."]


def _read(path: Path, inside: tuple[Path, ...], files: TextFiles, options: Options) -> None:
    inside = (*inside, path)
    section = ""
    for line, place in files.lines(path):
        line = _COMMENT.sub("", line).rstrip()
        # Indented lines continue an option of several lines, such as the G-code of a macro.
        if not line or line[0].isspace():
            continue
        head = _SECTION.match(line)
        option = _OPTION.match(line)
        if head and head[1].startswith("include "):
            for file in files.included(head[1].removeprefix("include ").strip(), inside, place):
                _read(file, inside, files, options)
        elif head:
            section = head[1].strip()
        elif option:
            key = option[1].strip().lower()
            options[section, key] = Setting(f"[{section}] {key}", option[2].strip(), place)

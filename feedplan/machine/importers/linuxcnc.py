"""Makes machines of LinuxCNC from its INI file: https://linuxcnc.org/docs/html/config/ini-config.html.

| setting | what it becomes |
|---|---|
| [TRAJ] COORDINATES | the axes; X, Y, Z without it |
| [TRAJ] LINEAR_UNITS, ANGULAR_UNITS | mm, inch or units per mm; degree, rad, grad or units per degree |
| [AXIS_X], [JOINT_0] MAX_VELOCITY, MAX_ACCELERATION, MAX_JERK | the axis's limits, the least of them |
| [TRAJ] MAX_LINEAR_VELOCITY, MAX_LINEAR_ACCELERATION, MAX_LINEAR_JERK | as well, of linear axes |
| the first two of these, [TRAJ] ARC_BLEND_OPTIMIZATION_DEPTH | parameters of the controller's model |
| [AXIS_X], [JOINT_0] MIN_LIMIT, MAX_LIMIT | travel, the least of them |
| [AXIS_X] OFFSET_AV_RATIO | the part of velocity and acceleration that programs do not have |
| [EMCMOT] SERVO_PERIOD | period |
| [KINS] KINEMATICS | trivkins, with its coordinates, or corexykins; others have dimensions in HAL files |

The first value of a name counts, up to the end of the line, with a warning where a later one differs. Lines
that are no settings are ignored, and a backslash at the end of a line joins it to the next. `#INCLUDE file`
must be at the start of a line. Limits of the tool's motion along the path hold here for each axis: a diagonal
move may be faster. DEFAULT_… are for jogging and are ignored.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from feedplan.arguments import shown
from feedplan.errors import MachineError
from feedplan.machine.axis import AXIS_LETTERS, ROTARY_LETTERS
from feedplan.machine.importers.description import (
    Found,
    FoundAxis,
    FoundMachine,
    greatest,
    least,
    limits_of,
    parameters_of,
    travel_of,
)
from feedplan.machine.importers.text_files import LONGEST_LINE, Setting, TextFiles
from feedplan.units import MM_PER_INCH

CONTROLLER = "LinuxCNC"
RECOGNISED = re.compile(
    r"^#INCLUDE\s|^[ \t]*\[[ \t]*(EMC|TRAJ|KINS|EMCMOT|RS274NGC|(AXIS|JOINT)_\w)[ \t]*\]", re.MULTILINE
)

_UNITS_PER_MM = {"mm": 1.0, "metric": 1.0, **dict.fromkeys(("in", "inch", "imperial"), 1.0 / MM_PER_INCH)}
_UNITS_PER_DEGREE = {
    **dict.fromkeys(("deg", "degree"), 1.0),
    **dict.fromkeys(("rad", "radian"), math.pi / 180.0),
    **dict.fromkeys(("grad", "gon"), 10.0 / 9.0),
}
# LinuxCNC's default of MAX_LINEAR_JERK, which means no limit by its documentation.
_NO_JERK = 1e9
# Kinematics whose dimensions are not in the INI file, and the bundled machines that are like them.
_LIKE = {
    "xyzac-trt-kins": "trunnion-ac",
    "xyzbc-trt-kins": "trunnion-bc",
    "5axiskins": "head-head",
    "maxkins": "head-table",
}
_MOTORS = ("U", "V")


class Ini:
    """The settings of an INI file and the files that it includes; the first setting of a name counts."""

    def __init__(self, path: Path, files: TextFiles) -> None:
        self._settings: dict[tuple[str, str], Setting] = {}
        self._later: dict[tuple[str, str], Setting] = {}
        self._overruled: dict[str, None] = {}
        self._files = files
        self._section = ""
        self._read(path, ())

    def get(self, section: str, *keys: str) -> Setting | None:
        """The setting of the first of these keys that exists and is not empty."""
        for key in keys:
            found = self._settings.get((section, key))
            if found is not None and found.text:
                later = self._later.get((section, key))
                if later is not None:
                    told = f"{later.place}: {shown(later.text)} of {later.label} is left out"
                    first = f"the first counts, {shown(found.text)} of {found.place}"
                    self._overruled[f"{told}: {first}"] = None
                return found
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each setting that was read by `get` and has a different value later in the files."""
        return tuple(self._overruled)

    def _read(self, path: Path, inside: tuple[Path, ...]) -> None:
        inside = (*inside, path)
        joined = ""
        for line, place in self._files.lines(path):
            line = line.rstrip()
            joined += line.removesuffix("\\") if len(joined) <= LONGEST_LINE else ""
            if line.endswith("\\"):
                continue
            line, joined = joined, ""
            if line.startswith("#INCLUDE"):
                name = line.removeprefix("#INCLUDE").strip()
                for file in self._files.included(name, inside, place) if name else ():
                    self._read(file, inside)
            else:
                self._take(line.strip(), place)

    def _take(self, line: str, place: str) -> None:
        if line.startswith("["):
            self._section = line[1:].split("]", 1)[0].strip()
        elif line[:1] not in ("#", ";") and "=" in line:
            key, _, text = (part.strip() for part in line.partition("="))
            own = Setting(f"[{self._section}] {key}", text, place)
            if self._settings.setdefault((self._section, key), own).text != text:
                self._later.setdefault((self._section, key), own)


def read(path: Path, files: TextFiles) -> FoundMachine:
    """The machine from an INI file; raises MachineError for units and kinematics that cannot be used."""
    ini = Ini(path, files)
    kinematics, joints, warnings = _kinematics(ini, path)
    letters = _letters(ini)
    turning = any(letter in ROTARY_LETTERS for letter in letters)
    per_degree = _units(ini, path, "ANGULAR_UNITS", _UNITS_PER_DEGREE, "degree") if turning else 1.0
    per_mm = _units(ini, path, "LINEAR_UNITS", _UNITS_PER_MM, "mm or inch")
    reader = _AxisReader(ini, per_mm, per_degree)
    if kinematics == "corexy":
        axes = _corexy_axes(reader, letters, path)
    else:
        axes = [reader.axis(letter, [letter], joints.get(letter, [])) for letter in letters]
    name = ini.get("EMC", "MACHINE")
    found = FoundMachine(
        name=name.text[:60] if name else path.stem,
        origin=f"{path.name} ({CONTROLLER})",
        axes=tuple(axes),
        period=_period(ini),
        kinematics=kinematics,
        remarks=tuple(_remarks(ini)),
        # LinuxCNC's controller model needs joints that are the program's axes.
        controller="linuxcnc" if kinematics == "cartesian" else "",
        parameters=_of_controller(ini, per_mm) if kinematics == "cartesian" else {},
    )
    # The warnings are complete only after all settings have been read.
    return replace(found, warnings=(*warnings, *ini.warnings))


def _of_controller(ini: Ini, per_mm: float) -> dict[str, Found]:
    """The limits along the path and the look-ahead depth, for LinuxCNC's controller model."""
    places = {
        "max_linear_velocity": ("MAX_LINEAR_VELOCITY", "MAX_VELOCITY"),
        "max_linear_acceleration": ("MAX_LINEAR_ACCELERATION", "MAX_ACCELERATION"),
        "arc_blend_optimization_depth": ("ARC_BLEND_OPTIMIZATION_DEPTH",),
    }
    settings = {key: ini.get("TRAJ", *names) for key, names in places.items()}
    return parameters_of("linuxcnc", {key: own for key, own in settings.items() if own is not None}, per_mm)


class _AxisReader:
    def __init__(self, ini: Ini, per_mm: float, per_degree: float) -> None:
        self._ini, self._per_mm, self._per_degree = ini, per_mm, per_degree

    def axis(
        self, name: str, letters: Iterable[str], joints: Iterable[int], moves_tool: bool = True
    ) -> FoundAxis:
        """The axis `name`, with the least limits of these axes and joints; it has no travel if it does not
        move the tool alone (`moves_tool` false)."""
        turns = moves_tool and name in ROTARY_LETTERS
        unit = self._per_degree if turns else self._per_mm
        sections = [f"AXIS_{letter}" for letter in letters]
        # Before LinuxCNC 2.8 the sections of joints had the names of axes.
        sections += [f"{kind}_{joint}" for joint in joints for kind in ("JOINT", "AXIS")]

        def found(section: str, *keys: str) -> Found | None:
            setting = self._ini.get(section, *keys)
            return None if setting is None else Found(setting.number / unit, setting.source)

        def limit(word: str) -> Found | None:
            own = [self._without_offsets(section, found(section, f"MAX_{word}")) for section in sections]
            whole = [] if turns else [found("TRAJ", f"MAX_LINEAR_{word}", f"MAX_{word}")]
            return least(own + whole)

        def jerk() -> Found | None:
            own = [found(section, "MAX_JERK") for section in sections]
            whole = self._ini.get("TRAJ", "MAX_LINEAR_JERK")
            if whole is not None and whole.number < _NO_JERK and not turns:
                own.append(found("TRAJ", "MAX_LINEAR_JERK"))
            return least(each for each in own if each is not None and each.value)

        limits = {"velocity": limit("VELOCITY"), "acceleration": limit("ACCELERATION"), "jerk": jerk()}
        low = [found(section, "MIN_LIMIT") for section in sections]
        high = [found(section, "MAX_LIMIT") for section in sections]
        travel = travel_of(greatest(low), least(high)) if moves_tool else None
        return FoundAxis(name, limits_of(limits), travel)

    def _without_offsets(self, section: str, own: Found | None) -> Found | None:
        """A limit without the share that is reserved for external offsets."""
        ratio = self._ini.get(section, "OFFSET_AV_RATIO")
        if ratio is None or own is None:
            return own
        # LinuxCNC replaces values that are not allowed by 0.1.
        part = ratio.number if 0.0 <= ratio.number <= 0.9 else 0.1
        return Found(own.value * (1.0 - part), f"{own.source}, less OFFSET_AV_RATIO = {part:g}")


def _corexy_axes(reader: _AxisReader, letters: list[str], path: Path) -> list[FoundAxis]:
    """The two motors, with limits that also keep those of X and Y, and the other axes."""
    others = [letter for letter in letters if letter not in "XY"]
    taken = [letter for letter in others if letter in _MOTORS]
    if taken:
        raise MachineError(
            f"{path.name}: corexykins has an axis {taken[0]}, as its motors are called here: leave it out"
        )
    motors = [reader.axis(name, "XY", [joint], moves_tool=False) for joint, name in enumerate(_MOTORS)]
    return motors + [reader.axis(letter, [letter], [AXIS_LETTERS.index(letter)]) for letter in others]


def _kinematics(ini: Ini, path: Path) -> tuple[str, dict[str, list[int]], list[str]]:
    """feedplan's name of the kinematics, the joints of each letter, and warnings for the user."""
    setting = ini.get("KINS", "KINEMATICS")
    words = setting.text.split() if setting else []
    name = words[0].lower() if words else "trivkins"
    if name == "corexykins":
        return "corexy", {}, []
    if name != "trivkins":
        like = f", as --like {_LIKE[name]}" if name in _LIKE else ""
        raise MachineError(
            f"{path.name}: the kinematics is {shown(name)}, whose dimensions are in HAL files: trivkins and "
            f"corexykins are imported, begin others by feedplan machines new{like}"
        )
    told = next((word[12:] for word in words[1:] if word.lower().startswith("coordinates=")), AXIS_LETTERS)
    joints: dict[str, list[int]] = {}
    for joint, letter in enumerate(letter for letter in told.upper() if letter in AXIS_LETTERS):
        joints.setdefault(letter, []).append(joint)
    missing = f"{path.name} has no [KINS] KINEMATICS: each axis is taken as a joint of its own"
    return "cartesian", joints, [] if setting else [missing]


def _letters(ini: Ini) -> list[str]:
    setting = ini.get("TRAJ", "COORDINATES")
    told = setting.text.upper() if setting else "XYZ"
    return [letter for letter in AXIS_LETTERS if letter in told]


def _units(ini: Ini, path: Path, key: str, names: dict[str, float], remedy: str) -> float:
    """Units of the file per mm or per degree."""
    setting = ini.get("TRAJ", key)
    if setting is None:
        raise MachineError(f"{path.name} has no [TRAJ] {key}: add it there, as {key} = {remedy.split()[0]}")
    value = names.get(setting.text.split()[0].lower())
    if value is None:
        value = setting.number if setting.text[0] in "+.0123456789" else 0.0
    if not 1e-6 <= value <= 1e6:
        raise MachineError(f"{setting.place}: {key} is {shown(setting.text)}: give {remedy}")
    return value


def _period(ini: Ini) -> Found:
    setting = ini.get("EMCMOT", "SERVO_PERIOD")
    if setting is None:
        return Found(0.001, "the file has no [EMCMOT] SERVO_PERIOD: LinuxCNC's usual one")
    return Found(1e-9 * setting.number, setting.source.replace(" = ", " [ns] = ", 1))


def _remarks(ini: Ini) -> Iterable[str]:
    words = ("VELOCITY", "ACCELERATION", "JERK")
    whole = [ini.get("TRAJ", f"MAX_LINEAR_{word}", f"MAX_{word}") for word in words]
    labels = [each.label for each in whole if each]
    if labels:
        yield f"{', '.join(labels)}: along the path there, of each axis here, diagonals may be faster."
    table = ini.get("EMCIO", "TOOL_TABLE")
    if table:
        yield f"Its tool table, for --tool-table: {table.text}"
    if ini.get("RS274NGC", "PARAMETER_FILE"):
        yield "Work offsets are not in the INI file: where travel counts, give them as [offsets] G54 = [...]."

"""Makes machines from joint_limits.yaml of ROS (MoveIt, ros2_control), which replaces limits of the URDF.

| key of a joint | what it becomes |
|---|---|
| max_velocity, where has_velocity_limits is true | velocity [rad/s] |
| max_acceleration, where has_acceleration_limits is true | acceleration [rad/s²] |
| max_jerk, where has_jerk_limits is true | jerk [rad/s³] |
| min_position, max_position, where has_position_limits is true | travel [rad] |

Joints are below the key `joint_limits`, each with its own keys; `!degrees` before a number is understood.
Lists, texts of several lines, anchors and braces are not read: such files do not need them. Only the URDF
says which joints are prismatic, and so in metres.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from feedplan.arguments import shown
from feedplan.errors import MachineError
from feedplan.machine.importers.description import Found, FoundAxis, FoundMachine, limits_of, travel_of
from feedplan.machine.importers.text_files import Setting, TextFiles

CONTROLLER = "ROS"
RECOGNISED = re.compile(r"^[ ]*joint_limits[ ]*:", re.MULTILINE)

_LINE = re.compile(r"""[ ]*("[^"]*"|'[^']*'|[^\s:#"'&*\[\]{}|>@`%!-][^:#]*):(?:\s+(.*))?$""")
_COMMENT = re.compile(r"(?:^|\s)#.*")
_TAGGED = re.compile(r"!(degrees|radians)\s+(.*)")
_TRUE = ("true", "yes", "on")
MAX_DEPTH = 20
Joint = dict[str, Setting]


def read(path: Path, files: TextFiles) -> FoundMachine:
    """The machine with the joints of a file; raises MachineError for lines that such files do not have."""
    joints = _joints(path, files)
    if not joints:
        raise MachineError(f"{path.name} has no joints below joint_limits: give a joint_limits.yaml")
    return FoundMachine(
        name=path.stem,
        origin=f"{path.name} ({CONTROLLER})",
        axes=tuple(_axis(name, joint) for name, joint in joints.items()),
        period=Found(0.001, "the file has none: that of the setpoints [s]"),
        warnings=('All joints are taken in rad: the file does not say so. Prismatic ones need unit = "m".',),
    )


def _axis(name: str, joint: Joint) -> FoundAxis:
    def found(key: str, flag: str) -> Found | None:
        setting, limited = joint.get(key), joint.get(f"has_{flag}_limits")
        if setting is None or limited is None or limited.text.lower() not in _TRUE:
            return None
        tagged = _TAGGED.match(setting.text)
        value = Setting(setting.label, tagged[2] if tagged else setting.text, setting.place).number
        return Found(math.radians(value) if tagged and tagged[1] == "degrees" else value, setting.source)

    limits = {limit: found(f"max_{limit}", limit) for limit in ("velocity", "acceleration", "jerk")}
    travel = travel_of(found("min_position", "position"), found("max_position", "position"))
    return FoundAxis(name, limits_of(limits), travel, unit="rad")


def _joints(path: Path, files: TextFiles) -> dict[str, Joint]:
    """The keys of each joint, in the order of the file."""
    joints: dict[str, Joint] = {}
    # The keys that enclose the current line, each with its indentation.
    keys: list[tuple[int, str]] = []
    for line, place in files.lines(path):
        line = _COMMENT.sub("", line).rstrip()
        if not line or line.startswith(("---", "...", "%")):
            continue
        match = _LINE.match(line)
        indent = len(line) - len(line.lstrip(" "))
        while keys and keys[-1][0] >= indent:
            keys.pop()
        below = [key for _, key in keys]
        inside = "joint_limits" in below
        if match is None:
            if inside:
                raise MachineError(
                    f"{place}: {shown(line.strip())} is not read: give lines as max_velocity: 3.14"
                )
            continue
        if len(keys) >= MAX_DEPTH:
            raise MachineError(f"{place}: keys in more than {MAX_DEPTH} levels: give a joint_limits.yaml")
        key, text = match[1].strip(" \"'"), (match[2] or "").strip()
        keys.append((indent, key))
        if inside and below[-1] == "joint_limits" and not text:
            joints[key] = {}
        elif inside and len(below) > 1 and below[-2] == "joint_limits" and below[-1] in joints:
            joints[below[-1]][key] = Setting(f"{below[-1]} {key}", text, place)
    return joints

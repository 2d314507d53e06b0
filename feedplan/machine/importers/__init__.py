"""Makes machines from controllers' files: LinuxCNC's INI, grbl's $$, Klipper's printer.cfg, ROS's joint
limits.

A format is a module with `CONTROLLER`, its name; `RECOGNISED`, a pattern that occurs only in its files; and
`read(path, files)`, which finds the numbers with their sources. Numbers that a file lacks are never guessed:
the user must give them.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

from feedplan.arguments import file_path, shown
from feedplan.errors import InputError, MachineError
from feedplan.machine.checks import require_text
from feedplan.machine.importers import grbl, klipper, linuxcnc, ros
from feedplan.machine.importers.description import FoundMachine
from feedplan.machine.importers.text_files import TextFiles
from feedplan.machine.machine import Machine

FORMATS = (linuxcnc, klipper, grbl, ros)
_REMEDY = "LinuxCNC's INI file, what grbl prints for $$, Klipper's printer.cfg or a joint_limits.yaml"


def import_machine(
    file: str | os.PathLike[str], limits: Mapping[str, float] | None = None, *, name: str | None = None
) -> Machine:
    """The machine described by a controller's own file: LinuxCNC's INI, grbl's $$, Klipper's printer.cfg,
    ROS's joint_limits.yaml.

    `limits` replace numbers of the file, by axis and limit: `{"X.jerk": 50_000}`, also velocity and
    acceleration, in mm, degrees (or the axis's unit) and seconds. `name` replaces the machine's name in the
    file. `Machine.to_toml` gives the text of a machine file. Raises MachineError where the file cannot be
    read or used, and where it lacks velocities or accelerations: the message names all that are missing.
    """
    found = find_machine(file, limits, name=name)
    return Machine.from_toml(found.to_toml(), found.origin)


def find_machine(
    file: str | os.PathLike[str], limits: Mapping[str, float] | None = None, *, name: str | None = None
) -> FoundMachine:
    """The numbers, with their sources, from which `import_machine` makes the machine.

    Raises as `import_machine` does, except for numbers outside the ranges of a machine.
    """
    if not (limits is None or isinstance(limits, Mapping)):
        raise MachineError(f"limits is {shown(limits)}: give a dictionary such as {{'X.jerk': 50000}}")
    if name is not None:
        require_text(name, "the name")
    try:
        path = file_path(file, "the file of a machine", _REMEDY)
    except InputError as error:
        raise MachineError(str(error)) from None
    # The format is recognised by the file itself, not by files that it includes.
    text = "\n".join(line for line, _ in TextFiles(path).lines(path))
    form = next((each for each in FORMATS if each.RECOGNISED.search(text)), None)
    if form is None:
        raise MachineError(f"{path.name} is no file of a machine that is known: give {_REMEDY}")
    files = TextFiles(path)
    found: FoundMachine = form.read(path, files)
    missing = tuple(f"{shown(own)} is not there: what it holds is left out" for own in files.missing)
    found = replace(found, name=found.name if name is None else name, warnings=(*found.warnings, *missing))
    return found.with_limits(limits or {})

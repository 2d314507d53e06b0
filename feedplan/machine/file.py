"""Machine files: the keys of a TOML file become the fields of a machine, and the other way round."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from feedplan.arguments import shown
from feedplan.errors import MachineError
from feedplan.machine.checks import require
from feedplan.machine.machine import Axis, Machine

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# The greatest machine file. Keys in keys are few: reading takes as long as the square of their number.
MAX_LETTERS = 1 << 17
MAX_LEVELS = 20
_NOT_OF_KEYS = re.compile(r"[^\w\-\"'. \t]+")

_AXIS_KEYS = {own.name for own in fields(Axis)}
_NEEDED = [own.name for own in fields(Axis) if own.default is MISSING]
_OF_KINEMATICS = {"kinematics", "home", "offsets", "controller"}
_MACHINE_KEYS = {own.name for own in fields(Machine)} - {"parameters"} | {"description"}


def parse(text: str, name: str, joints_only: bool = False) -> Machine:
    """The machine that the text of the file `name` tells; raises MachineError naming file, key and remedy.

    `joints_only`: its joints with their limits, whatever its kinematics. Setpoints need no more, and so are
    checked where a kinematics that a user registered is not known.
    """
    try:
        if len(text) > MAX_LETTERS:
            raise MachineError(f"it has more than {MAX_LETTERS} letters: give fewer")
        for part in _NOT_OF_KEYS.split(text):
            if sum(bool(key.strip()) for key in part.split(".")) > MAX_LEVELS:
                raise MachineError(f"{shown(part)} has more than {MAX_LEVELS} levels: give fewer")
        table = tomllib.loads(text)
        if joints_only:
            table = {key: value for key, value in table.items() if key not in _OF_KINEMATICS}
        return _machine(table, name)
    except MachineError as error:
        raise MachineError(f"machine file {name}: {error}") from None
    except (ValueError, RecursionError) as error:  # ValueError also for integers of thousands of digits
        raise MachineError(f"machine file {name} is not valid TOML: {error}") from None


def text_of(machine: Machine) -> str:
    """The text of a machine file that gives the same machine."""
    defaults = {own.name: own.default for own in fields(Axis)}
    rows: dict[str, Any] = {"name": machine.name, "period": machine.period}
    rows |= {"chord_tolerance": machine.chord_tolerance, "home": list(machine.home)}
    if not machine.home:
        del rows["home"]
    lines = [f"{key} = {toml_value(value)}" for key, value in rows.items()]
    lines += _table("[kinematics]", {"type": machine.kinematics, **machine.parameters})
    lines += _table("[offsets]", dict(machine.offsets)) if machine.offsets else []
    if machine.controller:
        driver = machine.controller
        lines += _table("[controller]", {"type": driver.name, **driver.parameters})
    for axis in machine.axes:
        given = {key: getattr(axis, key) for key in defaults}
        own = {key: value for key, value in given.items() if value != defaults[key]}
        lines += _table("[[axes]]", own)
    return "\n".join(lines) + "\n"


def _table(head: str, rows: Mapping[str, Any]) -> list[str]:
    return [head, *(f"{_key(key)} = {toml_value(value)}" for key, value in rows.items())]


def _key(key: str) -> str:
    plain = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if plain else toml_value(key)


def toml_value(value: Any) -> str:
    """A value in TOML; JSON has the same texts, but for one control character."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key(key)} = {toml_value(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml_value, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _machine(table: dict[str, Any], name: str) -> Machine:
    _check_keys(table, _MACHINE_KEYS, "")
    rows: Any = table.get("axes")
    remedy = "an [[axes]] table for each axis"
    require(isinstance(rows, list), "axes", rows, remedy)
    for number, row in enumerate(rows, 1):
        require(isinstance(row, dict), f"axis {number}", row, remedy)
    plain = ("period", "chord_tolerance", "home", "offsets", "controller")
    given = {key: table[key] for key in plain if key in table}
    kinematics = table.get("kinematics", "cartesian")
    parameters = {"type": kinematics} if isinstance(kinematics, str) else kinematics
    if not (isinstance(parameters, dict) and isinstance(parameters.get("type"), str)):
        remedy = 'give a name, or a table with type = "cartesian"'
        raise MachineError(f"kinematics is {shown(kinematics)}: {remedy}")
    return Machine(
        name=str(table.get("name", Path(name).stem)),
        axes=tuple(_axis(row) for row in rows),
        kinematics=parameters["type"],
        parameters={key: value for key, value in parameters.items() if key != "type"},
        **given,
    )


def _axis(row: dict[str, Any]) -> Axis:
    place = f"axis {row.get('name')}: "
    _check_keys(row, _AXIS_KEYS, place)
    for key in _NEEDED:
        if key not in row:
            raise MachineError(f"{place}{key} is missing: give it")
    return Axis(**row)


def _check_keys(table: dict[str, Any], known: set[str], place: str) -> None:
    unknown = sorted(set(table) - known)
    if unknown:
        remedy = f"give only {', '.join(sorted(known))}"
        raise MachineError(f"{place}the keys {shown(unknown)} are not known: {remedy}")

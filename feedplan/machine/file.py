"""Machine files: the keys of a TOML file become the fields of a machine."""

from __future__ import annotations

import sys
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from feedplan.errors import MachineError
from feedplan.machine.machine import Axis, Machine

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_AXIS_KEYS = {own.name for own in fields(Axis)}
_NEEDED = [own.name for own in fields(Axis) if own.default is MISSING]
_MACHINE_KEYS = {own.name for own in fields(Machine)} - {"parameters"} | {"description"}


def parse(text: str, name: str) -> Machine:
    """The machine that the text of the file `name` tells; raises MachineError naming file, key and remedy."""
    try:
        return _machine(tomllib.loads(text), name)
    except tomllib.TOMLDecodeError as error:
        raise MachineError(f"machine file {name} is not valid TOML: {error}") from None
    except MachineError as error:
        raise MachineError(f"machine file {name}: {error}") from None


def _machine(table: dict[str, Any], name: str) -> Machine:
    _check_keys(table, _MACHINE_KEYS, "")
    rows = table.get("axes")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise MachineError(f"axes is {rows!r}: give an [[axes]] table for each axis")
    given = {key: table[key] for key in ("period", "chord_tolerance", "home", "offsets") if key in table}
    kinematics = table.get("kinematics", "cartesian")
    parameters = {"type": kinematics} if isinstance(kinematics, str) else kinematics
    if not (isinstance(parameters, dict) and isinstance(parameters.get("type"), str)):
        raise MachineError(f'kinematics is {kinematics!r}: give a name, or a table with type = "cartesian"')
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
        raise MachineError(f"{place}the keys {unknown} are not known: give only {', '.join(sorted(known))}")

"""Checks the shapes and types of the arrays of a file, and makes a chunk of setpoints from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from feedplan.arguments import shown
from feedplan.errors import InputError
from feedplan.events import TimedEvents
from feedplan.machine.axis import AXIS_LETTERS
from feedplan.outputs import FORMAT, QUANTITIES, SETPOINTS, SetpointFile, require_format

COLUMNS = ("t", *QUANTITIES, "line")


def chunk_of(
    arrays: Mapping[str, Any], file: FilePath, columns: Sequence[str] = COLUMNS, rows: str = SETPOINTS
) -> SetpointFile:
    """The chunk in these named arrays. Raises InputError with the file and the mistake in it.

    `columns` are the columns of the format. `format`, `units`, `period` and `events` may be missing, as in
    files of other programs.
    """
    missing = [name for name in (*columns, "axes") if name not in arrays]
    if missing:
        raise InputError(
            f"{file} is not a file of setpoints: it lacks {', '.join(missing)}: give one that has them"
        )
    require_format(_single(arrays.get("format", FORMAT)), str(file))
    axes = tuple(str(name) for name in np.asarray(arrays["axes"]).ravel())
    if len(axes) > len(AXIS_LETTERS):
        raise InputError(f"{file} has {len(axes)} axes: give at most {len(AXIS_LETTERS)}")
    twice = next((name for name in axes if axes.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{file}: the axis {twice} comes {axes.count(twice)} times: give each axis once")
    units = tuple(str(unit) for unit in np.asarray(arrays.get("units", ())).ravel())
    if units and (len(units) != len(axes) or not all(units)):
        raise InputError(f"{file}: units are {' '.join(units)}: give one for each of {' '.join(axes)}")
    period = _single(arrays["period"]) if "period" in arrays else None
    if period is not None and not (isinstance(period, (int, float)) and 0 < period < np.inf):
        raise InputError(f"{file}: the period is {shown(period)}: give a positive number [s]")
    t = np.asanyarray(arrays["t"])
    if t.ndim != 1 or len(t) == 0:
        raise InputError(f"{file} holds no setpoints: t has the shape {t.shape}: give times of shape (n,)")
    shapes = {"t": (len(t),), "line": (len(t),)} | {name: (len(t), len(axes)) for name in QUANTITIES}
    known = {name: arrays[name] for name in columns}
    for name in columns:
        shape, array = shapes[name], np.asanyarray(known[name])
        if array.shape != shape or array.dtype.kind not in "fiu":
            raise InputError(f"{file}: {name} has the shape {array.shape}: give numbers of shape {shape}")
    none = {name: np.empty((0, *shape[1:])) for name, shape in shapes.items() if name not in columns}
    known |= none
    t, position, velocity, acceleration, jerk = (
        np.asanyarray(known[name], dtype=np.float64) for name in ("t", *QUANTITIES)
    )
    with np.errstate(invalid="ignore"):
        line = np.asanyarray(known["line"]).astype(np.int32, copy=False)
    events = arrays.get("events", TimedEvents.none())
    return SetpointFile(
        t, position, velocity, acceleration, jerk, line, axes,
        file=file, units=units, period=period, rows=rows, events=events,
    )  # fmt: skip


def _single(value: Any) -> Any:
    """The number in an array of one element, in which form a file may have it; other values unchanged."""
    array = np.asarray(value)
    return array.item() if array.size == 1 else value

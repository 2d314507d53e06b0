"""Makes files of a job's setpoints by time and axis, in every format of `feedplan.outputs`."""

from __future__ import annotations

import mimetypes
import secrets
from collections.abc import Sequence
from pathlib import Path as FilePath

import numpy as np

from feedplan import outputs
from feedplan.events import TimedEvents
from feedplan.outputs import SETPOINTS, FormatName, Header, format_named, npz
from feedplan.service.refusals import INPUT, Refusal

_ROWS_AT_ONCE = 10_000
_MEDIA_TYPES = {".npz": "application/zip"}


def formats() -> tuple[FormatName, ...]:
    """The formats of setpoints; formats of knots need the plan itself and are left out."""
    return tuple(name for name in outputs.formats() if format_named(name).ROWS == SETPOINTS)


def media_type(format_name: str) -> str:
    """The media type of a format's files."""
    ending = FilePath(format_named(format_name).FILE).suffix
    return _MEDIA_TYPES.get(ending) or mimetypes.types_map.get(ending, "application/octet-stream")


def setpoints_file(
    result: FilePath,
    new: FilePath,
    format_name: str,
    axes: Sequence[str],
    start: float | None,
    end: float | None,
) -> tuple[FilePath, bool]:
    """A file of the setpoints of a job from `start` to `end` [s] of some `axes` (empty: all).

    The flag is true if the file is new, in its own folder below `new`; the caller removes this folder. Raises
    Refusal for axes or times that the plan does not have.
    """
    stored = result / npz.FILE
    if format_name == "npz" and not axes and start is None and end is None:
        return stored, False
    points = npz.load(stored)
    axes = axes or points.axes
    for name in axes:
        if name not in points.axes:
            raise Refusal(INPUT, f"the plan has no axis {name[:32]}: give some of {', '.join(points.axes)}")
    if len(set(axes)) < len(axes):
        raise Refusal(INPUT, "axes has an axis twice: give each once")
    units = tuple(points.units[points.axes.index(name)] for name in axes)
    low, high = points.t[0] if start is None else start, points.t[-1] if end is None else end
    first, last = int(np.searchsorted(points.t, low, "left")), int(np.searchsorted(points.t, high, "right"))
    if first >= last:
        span = f"{points.t[0]:g} to {points.t[-1]:g} s"
        raise Refusal(INPUT, f"there are no setpoints from {low:g} to {high:g} s: give times within {span}")
    if format_name not in formats():
        raise Refusal(
            INPUT, f"{format_name} has no rows at servo periods: give one of {', '.join(formats())}"
        )
    output = format_named(format_name)
    within = TimedEvents.of(event for event in points.events if low <= event.time <= high)
    folder = new / secrets.token_hex(8)
    folder.mkdir()
    file = folder / output.FILE
    header = Header(tuple(axes), units, float(points.period or 0.0), within)
    with output.writer(file, header, last - first) as add:
        for row in range(first, last, _ROWS_AT_ONCE):
            add(points.part(slice(row, min(row + _ROWS_AT_ONCE, last)), axes))
    return file, True

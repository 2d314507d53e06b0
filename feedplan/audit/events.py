"""Checks events (stops, dwells, tool changes …) against the setpoints that belong to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from feedplan.arrays import Floats
from feedplan.errors import InputError
from feedplan.events import Event, TimedEvents
from feedplan.program.actions import KINDS
from feedplan.setpoints import SetpointChunk

# Positions during one stop may differ by this many units in the last place of the greatest coordinate.
_ROUNDINGS = 4
# A tool rests if its speed is at most this share of its speed one period before or after: the time of a stop
# is rounded.
_REST = 1e-6


def require_events(
    file: Path, events: TimedEvents, points: SetpointChunk, resolution: float, rounding: float
) -> None:
    """Raises InputError unless the events are of known kinds, in order and within the time of the setpoints,
    and the tool rests where they stop it: at the first setpoint at or after an event, all through a dwell.

    Times may differ by `rounding` [s], a small part of a period; positions of a tool at rest by 2 ×
    `resolution` [mm].
    """
    rows = list(events)
    begin, end = float(points.t[0]), float(points.t[-1])
    last = begin
    for row in rows:
        if row.kind not in KINDS:
            raise _refused(file, row, f"is of the kind '{row.kind}'", f"kinds are {', '.join(KINDS)}")
        if not begin - rounding <= row.time <= end + rounding:
            raise _refused(
                file, row, f"is at {row.time:.9g} s", f"setpoints go from {begin:.9g} to {end:.9g} s"
            )
        if row.time < last:
            raise _refused(file, row, f"is at {row.time:.9g} s", f"the one before it is at {last:.9g} s")
        last = row.time
    pauses = np.where(events.kind == "dwell", events.value, 0.0)
    first = np.searchsorted(points.t, events.time - rounding, side="left")
    after = np.searchsorted(points.t, events.time + pauses + rounding, side="right")
    for row, start, stop in zip(rows, first.tolist(), after.tolist(), strict=True):
        if not row.stops:
            continue
        if _moves(points.velocity[max(start - 1, 0) : start + 2], min(start, 1)):
            raise _refused(file, row, "stops the tool", f"it moves at {points.t[start]:.9g} s")
        held = points.position[start : max(stop, start + 1)]
        allowed = 2.0 * resolution + _ROUNDINGS * np.spacing(np.abs(held).max())
        if row.kind == "dwell" and np.ptp(held, axis=0).max() > allowed:
            why = f"the tool moves before {points.t[stop - 1]:.9g} s"
            raise _refused(file, row, f"takes {row.value:g} s", why)


def _moves(velocity: Floats, row: int) -> bool:
    """Whether the tool moves at a row, by the velocities around it; False if these are unknown."""
    if not len(velocity):
        return False
    speed = np.abs(velocity).max(axis=1)
    return bool(speed[row] > _REST * speed.max())


def _refused(file: Path, event: Event, what: str, why: str) -> InputError:
    return InputError(f"{file}: the event {event.text} of line {event.line} {what}, and {why}: plan again")

"""Setpoints and events written in a format, and the expected content."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from feedplan.events import Event, TimedEvents
from feedplan.outputs import Header, format_named
from feedplan.setpoints import SetpointChunk

NAMES = ("t", "position", "velocity", "acceleration", "jerk", "line")
ALWAYS = ("t", "position", "line")
LONG = "a message that goes on " * 400
EVENTS = TimedEvents.of(
    [
        Event(0.0, 1, "comment", math.nan, math.nan, False, 'µ (ends with | and ;\u2028 \\ "quotes"'),
        Event(0.0, 1, "spindle", math.nan, -8000.0, True, "M4"),
        Event(0.0, 2, "message", math.nan, math.nan, False, LONG),
        Event(0.0001234567890123456, 3, "analog", 0.0, 1 / 3, False, "M67 E0 Q0.333333"),
        Event(0.0001234567890123456, 4, "analog", 1.0, 0.5, False, "M67 E1 Q0.5"),
        Event(0.5, 2**31 - 1, "dwell", math.nan, 0.25, True, "G4 P0.25"),
        Event(0.998 + 1e-9, 7, "stop", math.nan, 30.0, True, "M30"),
    ]
)


def chunk(count: int, axes: str = "XYZ", seed: int = 1) -> SetpointChunk:
    random = np.random.default_rng(seed)
    tables = (random.normal(size=(count, len(axes))) * 10.0 ** random.integers(-9, 9) for _ in range(4))
    line = random.integers(1, 2**31 - 1, count).astype(np.int32)
    return SetpointChunk(np.arange(count) * 1e-3, *tables, line, tuple(axes))


def part_of(whole: SetpointChunk, first: int, last: int) -> SetpointChunk:
    return SetpointChunk(**{name: getattr(whole, name)[first:last] for name in NAMES}, axes=whole.axes)


def written(name: str, folder: Path, whole: SetpointChunk, cuts: tuple[int, ...] = ()) -> Path:
    output = format_named(name)
    with output.writer(folder / output.FILE, header(whole.axes), len(whole.t)) as add:
        for first, last in zip((0, *cuts), (*cuts, len(whole.t)), strict=True):
            add(part_of(whole, first, last))
    return folder / output.FILE


def ending(name: str) -> str:
    return Path(format_named(name).FILE).suffix


def header(axes: tuple[str, ...], events: TimedEvents = EVENTS) -> Header:
    return Header(axes, tuple("deg" if axis in "ABC" else "mm" for axis in axes), 0.001, events)


def same(read: SetpointChunk, whole: SetpointChunk) -> bool:
    """Whether two chunks are equal in all columns of the format."""
    found = {name: getattr(read, name) for name in NAMES}
    return read.axes == whole.axes and all(
        np.array_equal(column, getattr(whole, name))
        for name, column in found.items()
        if name in ALWAYS or len(column)
    )

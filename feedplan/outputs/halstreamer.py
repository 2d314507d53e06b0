"""Setpoints for LinuxCNC's `halstreamer`: a line of values for HAL pins for every servo period.

A line has the position of each axis [mm, deg] and the source line. `loadrt streamer depth=16000 cfg=fffs`
makes the pins of three axes, one `f` each, and `s` for the line; `halstreamer setpoints.halstream` sets them.
The header, a comment `# feedplan {…}`, has the text `fffs` as `pins`. A comment `# event {…}` is before the
first line at or after an event. halstreamer skips lines with #: HAL gets the motion only, and another program
must switch spindle, tools and outputs by these comments. Every number is the shortest text that reads back
unchanged.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path as FilePath

import numpy as np

from feedplan.arrays import Floats
from feedplan.errors import InputError
from feedplan.outputs import SETPOINTS, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._text import read_head, read_rows, row_writer
from feedplan.progress import Listener
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.halstream"
ROWS = SETPOINTS
# Times may differ from a whole number of periods by this much because of rounding [periods].
_ROUNDING = 1e-6


def pins(axes: tuple[str, ...]) -> str:
    """The types of the pins for streamer's `cfg`: a float for each axis, then the line."""
    return "f" * len(axes) + "s"


def writer(file: FilePath, header: Header, count: int) -> AbstractContextManager[Add]:
    """Writes the header, then a line for every setpoint. Raises InputError if the last setpoint is early."""

    def positions(chunk: SetpointChunk) -> Floats:
        periods = chunk.t[-1:] / header.period
        if (np.abs(periods - np.round(periods)) > _ROUNDING).any():
            raise InputError(
                f"halstreamer has a line every {header.period:g} s, and the plan ends in motion "
                f"at {chunk.t[-1]:.9g} s: plan with end speed 0"
            )
        return chunk.position

    return row_writer(
        file, "halstreamer", header, positions, separator=b" ", extra={"pins": pins(header.axes)}
    )


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The positions and lines of a file of this format; the time of a setpoint is its index times the
    period."""
    head = read_head(file, has_names=False)
    table, events = read_rows(head, len(head.entry("axes", list)) + 1, None, progress)
    times = np.arange(len(table)) * head.entry("period", float)
    columns = {"t": times, "position": table[:, :-1], "line": table[:, -1]}
    return chunk_of({**head.header, **columns, "events": events}, file, tuple(columns))

"""Setpoints for LinuxCNC's `halstreamer`: a line of pins' values for every servo period.

A line has the position of each axis [mm, deg] and the source line: `loadrt streamer depth=16000 cfg=fffs`
makes pins for three axes, one `f` each, and `s` for the line, and `halstreamer setpoints.halstream` fills
them. The header, a comment `# feedplan {…}`, has that text as `pins`. Comments `# event {…}` stand before
the first line at or after an event: halstreamer leaves lines with # out, so HAL sees the motion alone,
and whoever runs the stream switches spindle, tools and outputs by these comments. Every number is the
shortest that reads back the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath

import numpy as np

from feedplan.errors import InputError
from feedplan.outputs import SETPOINTS, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._text import Rows, RowWriter, read_rows
from feedplan.progress import Listener
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.halstream"
ROWS = SETPOINTS
# What a time may differ from whole periods by rounding [periods].
_ROUNDING = 1e-6


def pins(axes: tuple[str, ...]) -> str:
    """The types of the pins, as streamer's `cfg` wants them: a float for each axis, then the line."""
    return "f" * len(axes) + "s"


@contextmanager
def writer(file: FilePath, header: Header, count: int) -> Iterator[Add]:
    """Writes the header, then a line for every setpoint. Raises InputError where the last one is early."""
    with file.open("wb") as stream:
        rows = RowWriter(stream, "halstreamer", header, separator=b" ", extra={"pins": pins(header.axes)})

        def add(chunk: SetpointChunk) -> None:
            periods = chunk.t[-1:] / header.period
            if (np.abs(periods - np.round(periods)) > _ROUNDING).any():
                raise InputError(
                    f"halstreamer has a line every {header.period:g} s, and the plan ends in motion "
                    f"at {chunk.t[-1]:.9g} s: plan with end speed 0"
                )
            rows.add(chunk.t, chunk.position, chunk.line)

        yield add
        rows.close()


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The positions and lines of a file that this format wrote; a setpoint's place tells its time."""

    def width_of(rows: Rows) -> int:
        return len(rows.of_header("axes", list, file)) + 1

    rows = read_rows(file, width_of, has_names=False, separator=None, progress=progress)
    period = rows.of_header("period", float, file)
    columns = {
        "t": np.arange(len(rows.table)) * period,
        "position": rows.table[:, :-1],
        "line": rows.table[:, -1],
    }
    return chunk_of({**rows.header, **columns, "events": rows.events}, file, tuple(columns))

"""Knots as a table of position, velocity and time, for drives that interpolate between knots.

A line has the time of a knot on the plan's own clock, the time since the knot before, position and velocity
of each axis, and the source line: `time [s],step [s],position X [mm],velocity X [mm/s],…,line`. Between two
stops all steps are equal, at most as long as the requested step; knots at stops have the plan's own times and
velocity 0, and a pause is one step. Header and events are comments, as in csv. Every number is the shortest
text that reads back unchanged.

A drive moves from knot to knot on cubic polynomials, which have the plan's positions and velocities at the
knots. If the plan's acceleration jumps between two knots, the cubic's acceleration overshoots for every step:
plans with limited jerk are suitable for such drives, and `feedplan check` measures the greatest acceleration
of the cubics.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path as FilePath

import numpy as np

from feedplan.arrays import Floats
from feedplan.errors import InputError
from feedplan.outputs import KNOTS, QUANTITIES, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._text import read_columns, row_writer
from feedplan.progress import Listener
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.pvt"
ROWS = KNOTS
_PAIR = ("position", "velocity")


def column_names(axes: Sequence[str], units: Sequence[str]) -> str:
    """The names of the columns."""
    pairs = [
        f"{name} {axis} [{unit}{QUANTITIES[name]}]"
        for axis, unit in zip(axes, units, strict=True)
        for name in _PAIR
    ]
    return ",".join(["time [s]", "step [s]", *pairs, "line"])


def writer(file: FilePath, header: Header, count: int) -> AbstractContextManager[Add]:
    """Writes the header, then a line for every knot."""
    before = 0.0

    def values(chunk: SetpointChunk) -> Floats:
        nonlocal before
        steps = np.diff(chunk.t, prepend=before)
        before = chunk.t[-1] if len(chunk) else before
        pairs = np.stack([chunk.position, chunk.velocity], axis=2).reshape(len(chunk), 2 * len(chunk.axes))
        return np.column_stack([chunk.t, steps, pairs])

    return row_writer(file, "pvt", header, values, f"{column_names(header.axes, header.units)}\n")


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The knots of a table with the names that this format writes."""
    head, table, about = read_columns(file, column_names, progress)
    about |= {"format": head.header.get("format"), "period": head.entry("period", float)}
    t, steps = table[:, 0], table[:, 1]
    if (wrong := np.diff(t, prepend=0.0) != steps).any():
        raise InputError(
            f"{file}: the step to {t[wrong][0]:.9g} s is {steps[wrong][0]:.9g} s, not the difference of the "
            "times: one of them was changed, plan again"
        )
    columns = {"t": t, "position": table[:, 2:-1:2], "velocity": table[:, 3:-1:2], "line": table[:, -1]}
    return chunk_of({**columns, **about}, file, tuple(columns), KNOTS)

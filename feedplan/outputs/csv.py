"""Setpoints as text: a line of column names with units, then a line for every setpoint.

A comment `# feedplan {…}` before the names has version and period; a comment `# event {…}` is before the
first setpoint at or after an event of the program. `pandas.read_csv(file, comment="#")` skips both. Every
number is the shortest text that reads back unchanged, so a check of the text checks the plan itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path as FilePath

import numpy as np

from feedplan.arrays import Floats
from feedplan.outputs import QUANTITIES, SETPOINTS, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._text import read_columns, row_writer
from feedplan.progress import Listener
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.csv"
ROWS = SETPOINTS


def column_names(axes: Sequence[str], units: Sequence[str]) -> str:
    """The names of the columns: `t [s],position X [mm],…,line`."""
    columns = [
        f"{name} {axis} [{unit}{per}]"
        for name, per in QUANTITIES.items()
        for axis, unit in zip(axes, units, strict=True)
    ]
    return ",".join(["t [s]", *columns, "line"])


def values(chunk: SetpointChunk) -> Floats:
    """The columns of a chunk without the source line (n, k)."""
    return np.column_stack([chunk.t, *(getattr(chunk, name) for name in QUANTITIES)])


def writer(file: FilePath, header: Header, count: int) -> AbstractContextManager[Add]:
    """Writes the header, then a line for every setpoint."""
    return row_writer(file, SETPOINTS, header, values, f"{column_names(header.axes, header.units)}\n")


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The setpoints of a csv file with the names that this format writes."""
    head, table, about = read_columns(file, column_names, progress)
    about |= {name: head.header[name] for name in ("format", "period") if name in head.header}
    groups = np.split(table[:, 1:-1], len(QUANTITIES), axis=1)
    columns = {"t": table[:, 0], **dict(zip(QUANTITIES, groups, strict=True)), "line": table[:, -1]}
    return chunk_of({**columns, **about}, file)

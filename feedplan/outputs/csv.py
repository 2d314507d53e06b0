"""Setpoints as text: a line of names with units, then a line for every setpoint.

Every number is the shortest that reads back the same, so checking the text checks the plan itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import csv_rows
from feedplan.errors import InputError
from feedplan.outputs import QUANTITIES, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.progress import Listener, tell
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.csv"
_BYTES_AT_ONCE = 1_000_000


def column_names(axes: Sequence[str], units: Sequence[str]) -> str:
    """The names of the columns: `t [s],position X [mm],…,line`."""
    columns = [
        f"{name} {axis} [{unit}{per}]"
        for name, per in QUANTITIES.items()
        for axis, unit in zip(axes, units, strict=True)
    ]
    return ",".join(["t [s]", *columns, "line"])


@contextmanager
def writer(file: FilePath, header: Header, count: int) -> Iterator[Add]:
    """Writes the header, then a line for every setpoint."""
    with file.open("wb") as stream:
        stream.write(f"{column_names(header.axes, header.units)}\n".encode())

        def add(chunk: SetpointChunk) -> None:
            values = np.column_stack([chunk.t, *(getattr(chunk, name) for name in QUANTITIES)])
            line = np.ascontiguousarray(chunk.line, dtype=np.int32)
            stream.write(csv_rows(np.ascontiguousarray(values, dtype=np.float64), line))

        yield add


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The setpoints of a csv file with the header that this format writes."""
    parts: list[NDArray[np.float64]] = []
    done, read, size = 1, 0, max(file.stat().st_size, 1)
    try:
        with file.open(encoding="utf-8") as stream:
            first = stream.readline().strip()
            found = re.findall(r"position (\S+) \[([^\s\[\]]+)\]", first)
            axes, units = zip(*found, strict=True) if found else (("X", "Y"), ("mm", "mm"))
            if first != (names := column_names(axes, units)):
                raise InputError(f"{file}, line 1: the columns must be named {names}")
            width = 2 + len(QUANTITIES) * len(axes)
            while lines := stream.readlines(_BYTES_AT_ONCE):
                parts.append(_rows(lines, width, file, done))
                done += len(lines)
                read += sum(map(len, lines))
                tell(progress, min(read / size, 1.0))
    except UnicodeDecodeError:
        raise InputError(f"{file} is not text: give a csv file of setpoints") from None
    table = np.concatenate(parts) if parts else np.empty((0, width))
    groups = np.split(table[:, 1:-1], len(QUANTITIES), axis=1)
    arrays = dict(zip(QUANTITIES, groups, strict=True))
    columns = {"t": table[:, 0], **arrays, "line": table[:, -1]}
    return chunk_of({**columns, "axes": axes, "units": units}, file)


def _rows(lines: list[str], width: int, file: FilePath, done: int) -> NDArray[np.float64]:
    """These lines as numbers; `done` lines went before them."""
    try:
        table = np.loadtxt(lines, delimiter=",", ndmin=2, comments=None, dtype=np.float64)
        if table.shape == (len(lines), width):
            return table
    except ValueError:
        pass
    for number, text in enumerate(lines, start=done + 1):
        fields = text.rstrip("\r\n").split(",")
        if len(fields) != width:
            raise InputError(f"{file}, line {number}: {len(fields)} values where {width} are needed")
        wrong = next((field for field in fields if not _is_number(field)), None)
        if wrong is not None:
            raise InputError(f"{file}, line {number}: '{wrong}' is not a number")
    raise InputError(f"{file}: the rows cannot be read: give one line of {width} numbers a setpoint")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

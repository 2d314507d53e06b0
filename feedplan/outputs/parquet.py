"""Setpoints as a Parquet table with the columns of csv, for pandas, Polars and DuckDB.

The entry `feedplan` of the table's metadata is a JSON object with format, period, axes, units and events.
Needs the package pyarrow.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from feedplan.errors import InputError, MissingPackageError
from feedplan.events import to_json
from feedplan.outputs import QUANTITIES, SETPOINTS, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._events import from_objects
from feedplan.outputs.csv import column_names, values
from feedplan.progress import Listener, tell
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.parquet"
ROWS = SETPOINTS
_KEY = b"feedplan"
# Number of rows of one row group.
_GROUP = 100_000


def _package() -> Any:
    try:
        import pyarrow.parquet
    except ImportError:
        raise MissingPackageError(
            "the format parquet needs the package pyarrow: `pip install feedplan[parquet]`"
        ) from None
    return pyarrow


@contextmanager
def writer(file: FilePath, header: Header, count: int) -> Iterator[Add]:
    """Writes row groups. Raises MissingPackageError."""
    arrow = _package()
    names = column_names(header.axes, header.units).split(",")
    about = {**header.about(), "events": [to_json(event) for event in header.events]}
    types = [*(arrow.float64() for _ in names[:-1]), arrow.int32()]
    schema = arrow.schema(list(zip(names, types, strict=True)), {_KEY: json.dumps(about)})
    with arrow.parquet.ParquetWriter(file, schema) as table:
        waiting = schema.empty_table()

        def write(least: int) -> None:
            nonlocal waiting
            while len(waiting) >= least:
                table.write_table(waiting.slice(0, _GROUP).combine_chunks())
                waiting = waiting.slice(_GROUP)

        def add(chunk: SetpointChunk) -> None:
            nonlocal waiting
            columns = [*np.ascontiguousarray(values(chunk).T), np.ascontiguousarray(chunk.line, np.int32)]
            waiting = arrow.concat_tables([waiting, arrow.table(columns, schema=schema)])
            write(_GROUP)

        yield add
        write(1)


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The setpoints of a table that this format wrote. Raises InputError, MissingPackageError."""
    arrow = _package()
    with file.open("rb") as stream:
        try:
            table = arrow.parquet.read_table(stream)
            about = json.loads((table.schema.metadata or {}).get(_KEY, b"null"))
        except (arrow.ArrowException, OSError, ValueError):  # their messages have several lines
            raise InputError(f"{file} is not a whole parquet file: plan again") from None
    axes, units = (about.get("axes"), about.get("units")) if isinstance(about, dict) else (None, None)
    if not isinstance(axes, list) or not isinstance(units, list):
        raise InputError(
            f"{file} is not a file of setpoints: its metadata have no {_KEY.decode()} with axes and units: "
            "plan again"
        )
    names = column_names(axes, units) if len(axes) == len(units) else "units for its axes"
    if ",".join(table.column_names) != names:
        raise InputError(f"{file}: the columns must be named {names}")
    columns = [column.to_numpy() for column in table.columns]
    groups = np.split(np.column_stack(columns[1:-1]), len(QUANTITIES), axis=1)
    arrays = {"t": columns[0], **dict(zip(QUANTITIES, groups, strict=True)), "line": columns[-1]}
    events = about.get("events", [])
    about["events"] = from_objects(events if isinstance(events, list) else [events], file)
    tell(progress, 1.0)
    return chunk_of({**about, **arrays}, file)

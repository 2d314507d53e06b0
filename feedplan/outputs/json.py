"""Setpoints as one JSON object with the names of the npz arrays, for small plans and other languages.

`events` is a list of objects, one for each event. JSON has no infinities: a number that is not finite becomes
null.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path as FilePath
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from feedplan.errors import InputError
from feedplan.events import to_json
from feedplan.outputs import QUANTITIES, SETPOINTS, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._events import from_objects
from feedplan.progress import Listener, tell
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.json"
ROWS = SETPOINTS
_ROWS_AT_ONCE = 10_000


@contextmanager
def writer(file: FilePath, header: Header, count: int) -> Iterator[Add]:
    """Writes one object. Each array is written to its own temporary file until all are joined, so that memory
    does not grow."""
    names = ("t", *QUANTITIES, "line")
    with ExitStack() as stack:
        parts: dict[str, IO[str]] = {
            name: stack.enter_context(tempfile.TemporaryFile("w+", dir=file.parent, encoding="utf-8"))
            for name in names
        }

        def add(chunk: SetpointChunk) -> None:
            for name, part in parts.items():
                array = getattr(chunk, name)
                for first in range(0, len(array), _ROWS_AT_ONCE):
                    text = _text(array[first : first + _ROWS_AT_ONCE])
                    part.write(text if part.tell() == 0 else f",{text}")

        yield add
        stream = stack.enter_context(file.open("w", encoding="utf-8"))
        stream.write(json.dumps(header.about())[:-1])
        for name, part in parts.items():
            stream.write(f',\n"{name}":[')
            part.seek(0)
            shutil.copyfileobj(part, stream)
            stream.write("]")
        stream.write(',\n"events":[')
        for number, event in enumerate(header.events):
            stream.write(("," if number else "") + json.dumps(to_json(event)))
        stream.write("]}\n")


def _text(rows: NDArray[Any]) -> str:
    """The rows as JSON without the outer brackets."""
    if rows.dtype.kind == "f" and not np.isfinite(rows).all():
        rows = rows.astype(object)
        rows[~np.isfinite(rows.astype(np.float64))] = None
    return json.dumps(rows.tolist(), separators=(",", ":"))[1:-1]


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The setpoints of a json file."""
    try:
        table = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file} is not valid JSON ({error}): plan again") from None
    if not isinstance(table, dict) or "t" not in table:
        raise InputError(
            f"{file} is not a file of setpoints, an object with t, position, …: give setpoints.json, or the "
            "folder of a plan"
        )
    try:
        arrays: dict[str, Any] = {
            name: np.array(table[name], dtype=np.float64) for name in ("t", *QUANTITIES) if name in table
        }
        arrays |= {"line": np.array(table["line"], dtype=np.int32)} if "line" in table else {}
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{file}: t, position, … must be arrays of numbers, one row a setpoint") from None
    arrays |= {name: table[name] for name in ("format", "period", "axes", "units") if name in table}
    if "events" in table:
        objects = table["events"] if isinstance(table["events"], list) else [table["events"]]
        arrays["events"] = from_objects(objects, file)
    tell(progress, 1.0)
    return chunk_of(arrays, file)

"""Events in files: as JSON objects, or as an array of records and a list of texts."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.errors import InputError
from feedplan.events import TimedEvents, of_json
from feedplan.program.actions import KINDS

# A record; `text` is the index of its text in the list of different texts.
RECORD = np.dtype(
    [
        ("time", "<f8"),
        ("line", "<i4"),
        ("kind", f"<U{max(map(len, KINDS))}"),
        ("channel", "<f8"),
        ("value", "<f8"),
        ("stops", "?"),
        ("text", "<i4"),
    ]
)
_COLUMNS = ("time", "line", "kind", "channel", "value", "stops")


def to_records(events: TimedEvents) -> tuple[NDArray[Any], NDArray[np.uint8]]:
    """Records (m,), and their different texts as UTF-8, one a line."""
    indices = {text: index for index, text in enumerate(dict.fromkeys(events.text))}
    records = np.empty(len(events), RECORD)
    for name in _COLUMNS:
        records[name] = getattr(events, name)
    records["text"] = [indices[text] for text in events.text]
    return records, np.frombuffer("\n".join(indices).encode(), np.uint8)


def from_records(records: NDArray[Any], texts: NDArray[np.uint8], file: FilePath) -> TimedEvents:
    """The reverse of `to_records`. Raises InputError for other arrays."""
    try:
        known = np.ascontiguousarray(texts, np.uint8).tobytes().decode().split("\n")
        if records.dtype != RECORD or records.ndim != 1:
            raise ValueError(f"records of {records.dtype}")
        text = tuple(known[index] for index in records["text"].tolist())
    except (ValueError, IndexError, TypeError) as error:
        raise _refused(file, error) from None
    return TimedEvents(**{name: records[name].copy() for name in _COLUMNS}, text=text)


def from_objects(objects: Iterable[object], file: FilePath) -> TimedEvents:
    """Events from JSON objects, one for each event. Raises InputError for anything else."""
    try:
        return TimedEvents.of(map(of_json, objects))
    except (ValueError, TypeError, OverflowError) as error:
        raise _refused(file, error) from None


def _refused(file: FilePath, error: Exception) -> InputError:
    return InputError(f"{file}: its events are damaged ({error}): plan again")

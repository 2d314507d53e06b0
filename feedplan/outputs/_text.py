"""Rows of numbers as text; header and events are comments between the rows.

A comment is `# name {JSON}`; `#+` continues it on the next line if it is too long for other readers. An event
is before the first row at or after its time.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import csv_rows
from feedplan.arguments import shown
from feedplan.arrays import Floats
from feedplan.errors import InputError
from feedplan.events import TimedEvents, to_json
from feedplan.outputs import Add, Header
from feedplan.outputs._events import from_objects
from feedplan.progress import Listener, tell
from feedplan.setpoints import SetpointChunk

HEADER, EVENT, _MORE = "feedplan", "event", "#+"
# Most bytes of a line; LinuxCNC's halstreamer reads lines of 4000 bytes.
_LONGEST = 1000
_BYTES_AT_ONCE = 1_000_000
_AXIS = re.compile(r"position (\S+) \[([^\s\[\]]+)\]")


def _comment(name: str, data: object) -> bytes:
    """The lines of one comment, in ASCII."""
    text = f"# {name} {json.dumps(data)}"
    width = _LONGEST - len(_MORE)
    first, rest = text[:_LONGEST], text[_LONGEST:]
    parts = (_MORE + rest[at : at + width] for at in range(0, len(rest), width))
    return "".join(f"{line}\n" for line in (first, *parts)).encode()


@contextmanager
def row_writer(
    file: FilePath,
    kind: str,
    header: Header,
    values_of: Callable[[SetpointChunk], Floats],
    names: str = "",
    separator: bytes = b",",
    extra: dict[str, Any] | None = None,
) -> Iterator[Add]:
    """Writes a row for every setpoint: what `values_of` makes of a chunk (n, k), then the source line.

    Events are between the rows; `extra` is added to the header.
    """
    events, times, done = iter(header.events), header.events.time, 0
    with file.open("wb") as stream:
        stream.write(_comment(HEADER, {"kind": kind, **header.about(), **(extra or {})}))
        stream.write(names.encode())

        def write(values: Floats, lines: NDArray[np.int32]) -> None:
            if len(lines):
                rows = np.ascontiguousarray(values, np.float64), np.ascontiguousarray(lines, np.int32)
                stream.write(csv_rows(*rows).replace(b",", separator))

        def add(chunk: SetpointChunk) -> None:
            nonlocal done
            values, first = values_of(chunk), 0
            due = max(int(np.searchsorted(times, chunk.t[-1], side="right")), done) if len(chunk) else done
            for row in np.searchsorted(chunk.t, times[done:due], side="left").tolist():
                write(values[first:row], chunk.line[first:row])
                stream.write(_comment(EVENT, to_json(next(events))))
                first = row
            write(values[first:], chunk.line[first:])
            done = due

        yield add
        # By rounding, events may be after the last row.
        stream.writelines(_comment(EVENT, to_json(event)) for event in events)


@dataclass
class Rows:
    """The content of a file of rows: `header` as written, empty if missing; the line with the `names`, if the
    format has one; the `table` (n, k) and the `events`."""

    header: dict[str, Any] = field(default_factory=dict)
    names: str = ""
    table: Floats = field(default_factory=lambda: np.empty((0, 0)))
    events: TimedEvents = field(default_factory=TimedEvents.none)

    def of_header(self, name: str, kind: type, file: FilePath) -> Any:
        """An entry of the header. Raises InputError if it is missing or has another type."""
        value = self.header.get(name)
        if not isinstance(value, kind):
            what = "missing" if value is None else shown(value)
            raise InputError(
                f"{file}: {name} is {what} in its comment # {HEADER} {{…}}: give a file that feedplan wrote"
            )
        return value


def read_columns(
    file: FilePath, column_names: Callable[[Sequence[str], Sequence[str]], str], progress: Listener | None
) -> tuple[Rows, tuple[str, ...], tuple[str, ...]]:
    """The rows of a file, its axes and their units; `column_names` makes the expected line of names of
    these."""
    axes: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    def width_of(rows: Rows) -> int:
        nonlocal axes, units
        found = _AXIS.findall(rows.names)
        axes, units = zip(*found, strict=True) if found else (("X", "Y"), ("mm", "mm"))
        if rows.names != (names := column_names(axes, units)):
            raise InputError(f"{file}: the columns must be named {names}")
        return names.count(",") + 1

    return read_rows(file, width_of, progress=progress), axes, units


def read_rows(
    file: FilePath,
    width_of: Callable[[Rows], int],
    *,
    has_names: bool = True,
    separator: str | None = ",",
    progress: Listener | None = None,
) -> Rows:
    """The rows of a file. `width_of` gives the count of numbers in a row from the lines before the rows.

    Raises InputError with file, line and what is wrong.
    """
    rows, size = Rows(), max(file.stat().st_size, 1)
    parts: list[Floats] = []
    comments: list[str] = []
    done, read, width, waits_for_names = 0, 0, 0, has_names
    try:
        with file.open(encoding="utf-8", newline="\n") as stream:
            while lines := stream.readlines(_BYTES_AT_ONCE):
                numbers = []
                for number, line in enumerate(lines, start=done + 1):
                    if line.startswith(_MORE) and comments:
                        comments[-1] += line[len(_MORE) :].rstrip("\r\n")
                    elif line.startswith("#"):
                        comments.append(line.rstrip("\r\n"))
                    elif waits_for_names:
                        rows.names, waits_for_names = line.strip(), False
                    else:
                        numbers.append((number, line))
                if not width and not waits_for_names:
                    rows.header = _header(comments, file)
                    width = width_of(rows)
                if numbers:
                    parts.append(_table(numbers, width, separator, file))
                done += len(lines)
                read += sum(map(len, lines))
                tell(progress, min(read / size, 1.0))
    except UnicodeDecodeError:
        raise InputError(f"{file} is not text: give a file of setpoints") from None
    if not width:
        width = width_of(rows)
    rows.table = np.concatenate(parts) if parts else np.empty((0, width))
    rows.events = from_objects(_named(EVENT, comments, file), file)
    return rows


def _header(comments: list[str], file: FilePath) -> dict[str, Any]:
    """The content of the header comment; empty if there is none."""
    header: object = next(_named(HEADER, comments, file), {})
    if not isinstance(header, dict):
        raise InputError(f"{file}: the comment # {HEADER} is {shown(header)}: give a JSON object")
    return header


def _named(name: str, comments: list[str], file: FilePath) -> Iterator[Any]:
    """The contents of the comments of that name."""
    begin = f"# {name} "
    for text in comments:
        if text.startswith(begin):
            try:
                yield json.loads(text[len(begin) :])
            except (ValueError, RecursionError) as error:
                raise InputError(f"{file}: the comment {begin}… is not JSON ({error}): plan again") from None


def _table(numbered: list[tuple[int, str]], width: int, separator: str | None, file: FilePath) -> Floats:
    """The table (n, width) of lines that are given with their line numbers."""
    lines = [line for _, line in numbered]
    try:
        table = np.loadtxt(lines, delimiter=separator, ndmin=2, comments=None, dtype=np.float64)
        if table.shape == (len(lines), width):
            return table
    except ValueError:
        pass
    for number, text in numbered:
        fields = text.rstrip("\r\n").split(separator)
        if len(fields) != width:
            raise InputError(
                f"{file}, line {number}: {len(fields)} values where {width} are needed: plan again"
            )
        wrong = next((given for given in fields if not _is_number(given)), None)
        if wrong is not None:
            raise InputError(f"{file}, line {number}: '{wrong}' is not a number: plan again")
    raise InputError(f"{file}: the rows cannot be read: give one line of {width} numbers a setpoint")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

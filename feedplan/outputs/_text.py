"""Writes and reads rows of numbers as text; header and events are comments between the rows.

A comment is `# name {JSON}`; `#+` continues it on the next line if it is too long for other readers. An event
is before the first row at or after its time.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import IO, Any

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
# The greatest number of bytes of a line; LinuxCNC's halstreamer reads lines of up to 4000 bytes.
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
    """Writes a row for every setpoint: the values (n, k) that `values_of` computes from a chunk, then the
    source line.

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
        # Because of rounding, events may be after the last row.
        stream.writelines(_comment(EVENT, to_json(event)) for event in events)


@dataclass(frozen=True)
class Head:
    """The head of a file of rows: `header` as written, empty if missing; the line with the `names` of the
    columns, empty if the format has none."""

    file: FilePath
    header: dict[str, Any]
    names: str

    def entry(self, name: str, kind: type) -> Any:
        """An entry of the header. Raises InputError if it is missing or has another type."""
        value = self.header.get(name)
        if not isinstance(value, kind):
            what = "missing" if value is None else shown(value)
            place = f"{self.file}: {name} is {what} in its comment # {HEADER} {{…}}"
            raise InputError(f"{place}: give a file that feedplan wrote")
        return value


def read_head(file: FilePath, has_names: bool) -> Head:
    """The head of a file. Raises InputError."""
    comments: list[str] = []
    with _opened(file) as stream:
        first = next((line for line in stream if not _took(line, comments)), "")
    header: object = next(_named(HEADER, comments, file), {})
    if not isinstance(header, dict):
        raise InputError(f"{file}: the comment # {HEADER} is {shown(header)}: give a JSON object")
    return Head(file, header, first.strip() if has_names else "")


def read_columns(
    file: FilePath, column_names: Callable[[Sequence[str], Sequence[str]], str], progress: Listener | None
) -> tuple[Head, Floats, dict[str, Any]]:
    """The head and the table (n, columns) of a file with column names, and a dict of its axes, their units
    and its events.

    `column_names` makes the expected line of names from axes and units.
    """
    head = read_head(file, has_names=True)
    found = _AXIS.findall(head.names)
    axes, units = zip(*found, strict=True) if found else (("X", "Y"), ("mm", "mm"))
    if head.names != (names := column_names(axes, units)):
        raise InputError(f"{file}: the columns must be named {names}")
    table, events = read_rows(head, names.count(",") + 1, ",", progress)
    return head, table, {"axes": axes, "units": units, "events": events}


def read_rows(
    head: Head, width: int, separator: str | None, progress: Listener | None
) -> tuple[Floats, TimedEvents]:
    """The rows of `width` numbers after the head (n, width), and the events between them.

    Raises InputError with file, line and the mistake.
    """
    file, waits_for_names = head.file, bool(head.names)
    size = max(file.stat().st_size, 1)
    parts: list[Floats] = []
    comments: list[str] = []
    done = read = 0
    with _opened(file) as stream:
        while lines := stream.readlines(_BYTES_AT_ONCE):
            rows = [row for row in enumerate(lines, start=done + 1) if not _took(row[1], comments)]
            if rows and waits_for_names:
                rows, waits_for_names = rows[1:], False
            if rows:
                parts.append(_table(rows, width, separator, file))
            done += len(lines)
            read += sum(map(len, lines))
            tell(progress, min(read / size, 1.0))
    table = np.concatenate(parts) if parts else np.empty((0, width))
    return table, from_objects(_named(EVENT, comments, file), file)


@contextmanager
def _opened(file: FilePath) -> Iterator[IO[str]]:
    try:
        with file.open(encoding="utf-8-sig", newline="\n") as stream:
            yield stream
    except UnicodeDecodeError:
        raise InputError(f"{file} is not text: give a file of setpoints") from None


def _took(line: str, comments: list[str]) -> bool:
    """Whether a line has no values: it is blank or a comment, which is added to the comments."""
    if line.startswith(_MORE) and comments:
        comments[-1] += line[len(_MORE) :].rstrip("\r\n")
    elif line.startswith("#"):
        comments.append(line.rstrip("\r\n"))
    return line.startswith("#") or not line.strip()


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

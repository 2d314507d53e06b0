"""Events: actions of a machine that are not moves, with their time and source line."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats, Integers
from feedplan.program.actions import KINDS
from feedplan.units import counted


class Event(NamedTuple):
    """One event; see `TimedEvents`."""

    time: float
    line: int
    kind: str
    channel: float
    value: float
    stops: bool
    text: str


# Types of the columns of events, except the text.
_DTYPES = (np.float64, np.int32, np.str_, np.float64, np.float64, np.bool_)


@dataclass(frozen=True, eq=False, repr=False)
class TimedEvents:
    """Events in the order of time, one row each.

    `time` (m,) [s] is measured by the clock of the plan or of the setpoints that the events belong to; `line`
    (m,) is the source line; `kind`, `channel` and `value` (m,) are as in `feedplan.program.actions`, NaN if
    there is none; `stops` (m,) is true if the tool stops for the event; `text` (m,) is the word of the
    program, such as `M62 P3`, or the text of a message or comment. The value of a dwell is its duration [s],
    which begins at `time`.
    """

    time: Floats
    line: NDArray[np.int32]
    kind: NDArray[np.str_]
    channel: Floats
    value: Floats
    stops: Flags
    text: tuple[str, ...]

    @classmethod
    def of(cls, rows: Iterable[Event]) -> TimedEvents:
        """Makes events from rows."""
        *columns, text = list(zip(*rows, strict=True)) or [()] * len(Event._fields)
        arrays: list[Any] = [np.array(column, own) for column, own in zip(columns, _DTYPES, strict=True)]
        return cls(*[*arrays, tuple(text)])

    @classmethod
    def none(cls) -> TimedEvents:
        """No events."""
        return cls.of(())

    def __len__(self) -> int:
        return len(self.time)

    def __iter__(self) -> Iterator[Event]:
        columns = (self.time, self.line, self.kind, self.channel, self.value, self.stops)
        rows = zip(*(column.tolist() for column in columns), self.text, strict=True)
        return (Event(*row) for row in rows)

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {kind}" for kind, count in self.counts().items())
        return f"<{counted(len(self), 'event')}{': ' if counts else ''}{counts}>"

    def counts(self) -> dict[str, int]:
        """The number of events of each kind."""
        kinds, counts = np.unique(self.kind, return_counts=True)
        found = dict(zip(kinds.tolist(), counts.tolist(), strict=True))
        return {kind: found[kind] for kind in KINDS if kind in found}

    def sha256(self) -> str:
        """A hash of all columns, with all digits of the numbers."""
        digest = hashlib.sha256()
        for numbers in (self.time, self.line, self.channel, self.value, self.stops):
            values = numbers.astype("<f8")
            digest.update(np.where(np.isnan(values), np.nan, values).tobytes())
        digest.update(json.dumps([self.kind.tolist(), self.text]).encode())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False, repr=False)
class PlacedEvents:
    """The events of a plan, relative to the runs between its stops: `run` (m,) of each event, −1 before the
    first run, and its time `after` (m,) the start of that run [s]; `starts` (runs,) [s] of the runs on the
    plan's own clock. The times of `events` are not set."""

    events: TimedEvents
    run: Integers
    after: Floats
    starts: Floats

    def on(self, starts: Floats) -> TimedEvents:
        """The events on a clock on which the runs start at the times `starts` (runs,) [s]."""
        time = np.concatenate(([0.0], starts))[self.run + 1] + self.after
        # Because of rounding a run may start before the end of the run before it.
        return replace(self.events, time=np.maximum.accumulate(time))

    def timed(self) -> TimedEvents:
        """The events on the plan's own clock."""
        return self.on(self.starts)


def to_json(event: Event) -> dict[str, Any]:
    """An event as an object for JSON; a missing channel or value is None."""
    return {name: None if value != value else value for name, value in event._asdict().items()}


def of_json(row: object) -> Event:
    """The reverse of `to_json`. Raises ValueError or TypeError for anything else."""
    if not isinstance(row, dict) or set(row) != set(Event._fields):
        raise ValueError(f"the names {', '.join(Event._fields)} are needed")
    if not (isinstance(row["kind"], str) and isinstance(row["text"], str)):
        raise TypeError("kind and text are texts")
    if not isinstance(row["stops"], bool):
        raise TypeError("stops is true or false")
    number = {name: math.nan if row[name] is None else float(row[name]) for name in ("channel", "value")}
    return Event(
        time=float(row["time"]),
        line=int(row["line"]),
        kind=row["kind"],
        stops=row["stops"],
        text=row["text"],
        **number,
    )

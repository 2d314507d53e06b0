"""Writes setpoints to files, one module for each format, and reads them back.

A format is a module here whose name does not begin with an underscore and is in `FormatName`. It has

- `FILE`, the name of its file;
- `ROWS`, the kind of its rows: `SETPOINTS`, one for each servo period, or `KNOTS`, equal steps between stops;
- `writer(file, header, count)`, a context that writes `count` rows: it gives a function that takes chunks in
  the order of time, and completes the file at its end;
- `load(file)`, which reads the rows back as one chunk, a SetpointFile.

Each file contains version, axes, units, period (or longest step) and the events of the program
(`feedplan.events`).
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, Literal, Protocol, cast, get_args

from feedplan.arguments import callback, file_path, one_of, shown
from feedplan.errors import InputError, unreadable
from feedplan.events import TimedEvents
from feedplan.progress import Listener
from feedplan.setpoints import SetpointChunk

# The columns that have one value for each axis, and the text that their unit adds to the unit of the axis.
QUANTITIES = {"position": "", "velocity": "/s", "acceleration": "/s^2", "jerk": "/s^3"}

FormatName = Literal["csv", "halstreamer", "json", "npz", "npz-compressed", "parquet", "pvt"]

# The kinds of rows.
SETPOINTS, KNOTS = "setpoints", "knots"

# The version of all files of a plan. Files without a version come from other programs and are read as this
# version.
FORMAT = 1


@dataclass(frozen=True)
class Header:
    """The header of a file: names of the `axes`, their `units` (mm, deg, …), the servo `period` [s] or the
    longest step of knots, and the `events` on the clock of the rows."""

    axes: tuple[str, ...]
    units: tuple[str, ...]
    period: float
    events: TimedEvents = field(default_factory=TimedEvents.none)

    def about(self) -> dict[str, Any]:
        """Version, period, axes and units by name."""
        return {"format": FORMAT, "period": self.period, "axes": self.axes, "units": self.units}


@dataclass(frozen=True, eq=False, repr=False)
class SetpointFile(SetpointChunk):
    """Setpoints read from a `file`: `units` of the axes, empty if the file has none; `period` [s] or the
    longest step of knots, None if the file has none; `rows` as the format's `ROWS`. Velocities,
    accelerations, jerks and lines have no rows if the format lacks them. `events` are in the order of the
    file."""

    file: FilePath = FilePath()
    units: tuple[str, ...] = ()
    period: float | None = None
    rows: str = SETPOINTS
    events: TimedEvents = field(default_factory=TimedEvents.none)


Add = Callable[[SetpointChunk], None]


class Format(Protocol):
    """The interface of a module of this package."""

    FILE: str
    ROWS: str

    def writer(self, file: FilePath, header: Header, count: int) -> AbstractContextManager[Add]: ...

    def load(self, file: FilePath, progress: Listener | None = None) -> SetpointFile: ...


def formats() -> tuple[FormatName, ...]:
    """The names of all formats."""
    return get_args(FormatName)


def format_named(name: str) -> Format:
    """The format of that name. Raises InputError with the names of all formats."""
    one_of(name, "output format", formats())
    return cast(Format, importlib.import_module(f"{__name__}.{name.replace('-', '_')}"))


def formats_named(names: Iterable[str]) -> dict[str, Format]:
    """The formats of these names. Raises InputError for an unknown one, and if two write the same file."""
    found = {name: format_named(name) for name in names}
    by_file: dict[str, str] = {}
    for name, output in found.items():
        if (other := by_file.setdefault(output.FILE, name)) != name:
            raise InputError(f"{other} and {name} are both {output.FILE}: ask for one of them")
    return found


def require_format(version: object, what: str) -> None:
    """Raises InputError for a file of a version that this feedplan does not read."""
    if version != FORMAT or isinstance(version, bool):
        raise InputError(
            f"{what} has the format {shown(version)}, this feedplan reads {FORMAT}: "
            "use the feedplan that wrote it"
        )


_PLACE = "a file of setpoints or the folder of a plan"


def load_setpoints(place: str | os.PathLike[str], progress: Listener | None = None) -> SetpointFile:
    """The setpoints in a file, or in the folder of a plan, as one chunk.

    The arrays of an npz file stay on disk and are read when they are used. `progress` is called with the
    finished share of reading a text file. Raises InputError with the file and the remedy.
    """
    callback(progress, "the part done")
    file = file_path(place, "the place", _PLACE)
    try:
        found = files_in(file) if file.is_dir() else [file]
    except OSError as error:
        raise InputError(unreadable(file, error, _PLACE)) from None
    if not found:
        raise InputError(f"{file} holds no setpoints: `feedplan plan PROGRAM -o {file}` writes them there")
    file = found[0]
    endings = {FilePath(format_named(name).FILE).suffix: name for name in formats()}
    if file.suffix in endings:
        return _load(endings[file.suffix], file, progress)
    if not file.exists():
        raise _missing(file)
    known = ", ".join(sorted(endings))
    raise InputError(f"{file}: setpoints cannot be read from this kind of file: give a file in {known}")


def files_in(folder: FilePath) -> list[FilePath]:
    """The files of setpoints in a folder, the newest first."""
    files = {folder / format_named(name).FILE for name in formats()}
    return sorted((file for file in files if file.exists()), key=lambda file: -file.stat().st_mtime_ns)


def _load(name: str, file: FilePath, progress: Listener | None) -> SetpointFile:
    try:
        return format_named(name).load(file, progress)
    except FileNotFoundError:
        raise _missing(file) from None
    except OSError as error:
        raise InputError(unreadable(file, error, "the setpoints or the folder of a plan")) from None


def _missing(file: FilePath) -> InputError:
    return InputError(f"{file} does not exist: give the setpoints or the folder of a plan")

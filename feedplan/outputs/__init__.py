"""Outputs: one file a format, found by its name, and setpoints read back from them.

A format is a module here whose name does not begin with an underscore. It has

- `FILE`, the name of the file it writes;
- `writer(file, axes, count)`, a context that writes `count` setpoints of these axes: it gives a function that
  takes them chunk by chunk in the order of time, and completes the file at its end;
- `load(file)`, which reads them back as one SetpointChunk.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path as FilePath
from typing import Protocol, cast

from feedplan.errors import InputError
from feedplan.setpoints import SetpointChunk

# The columns of a setpoint that have one value an axis, with their units.
QUANTITIES = {"position": "mm", "velocity": "mm/s", "acceleration": "mm/s^2", "jerk": "mm/s^3"}


Add = Callable[[SetpointChunk], None]


class Format(Protocol):
    """What a module of this package offers."""

    FILE: str

    def writer(self, file: FilePath, axes: Sequence[str], count: int) -> AbstractContextManager[Add]: ...

    def load(self, file: FilePath) -> SetpointChunk: ...


def formats() -> tuple[str, ...]:
    """The names of all formats."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def format_named(name: str) -> Format:
    """The format of that name. Raises InputError naming those there are."""
    if name not in formats():
        raise InputError(f"there is no output format '{name}': use one of {', '.join(formats())}")
    return cast(Format, importlib.import_module(f"{__name__}.{name}"))


def load_setpoints(place: str | FilePath) -> SetpointChunk:
    """The setpoints in a file, or in the folder of a plan, as one chunk.

    The arrays of an npz file stay on disk and are read where they are used. Raises InputError naming the
    file and the remedy.
    """
    file = FilePath(place)
    if file.is_dir():
        found = files_in(file)
        if not found:
            raise InputError(
                f"{file} holds no setpoints: `feedplan plan PROGRAM -o {file}` writes them there"
            )
        file = found[0]
    for name in formats():
        if file.suffix == f".{name}":
            return _load(name, file)
    known = ", ".join(f".{name}" for name in formats())
    raise InputError(f"{file}: setpoints cannot be read from this kind of file: give a file in {known}")


def files_in(folder: FilePath) -> list[FilePath]:
    """The files of setpoints in a folder, the newest first."""
    files = [folder / format_named(name).FILE for name in formats()]
    return sorted((file for file in files if file.exists()), key=lambda file: -file.stat().st_mtime_ns)


def _load(name: str, file: FilePath) -> SetpointChunk:
    try:
        return format_named(name).load(file)
    except FileNotFoundError:
        raise InputError(f"{file} does not exist: give the setpoints or the folder of a plan") from None
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror or error}") from None

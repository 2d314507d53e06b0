"""Finds the files of subprograms, which programs call by name (O<name> call) or number (M98 P100)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from feedplan.errors import InputError, unreadable
from feedplan.program.source import MAX_BYTES

Finder = Callable[[str], tuple[str, bytes] | None]

# The endings of subprogram files, in the order of the search.
ENDINGS = (".ngc", ".nc", "")


def finder(folders: Iterable[Path], max_bytes: int = MAX_BYTES) -> Finder:
    """Returns a function that finds a subprogram's file (name and bytes), or None if no folder has it.

    The folders are searched in their order; upper and lower case are equal. The function raises OSError where
    a file cannot be read, ValueError where it is larger than `max_bytes`.
    """
    known = tuple(folders)

    def find(name: str) -> tuple[str, bytes] | None:
        # File names may have the number with leading zeros, and with the O of the program before it.
        wanted = [name, *(f"{letter}{name:0>4}" for letter in ("", "o") if name.isdigit())]
        names = [base + ending for base in wanted for ending in ENDINGS]
        for folder in known:
            files = {file.name.lower(): file for file in _files(folder)}
            found = next((files[each] for each in names if each in files), None)
            if found is not None:
                if found.stat().st_size > max_bytes:
                    raise ValueError(f"{found} has more than {max_bytes} bytes: split it")
                return found.name, found.read_bytes()
        return None

    return find


def numbered_files(folders: Iterable[Path], max_bytes: int = MAX_BYTES) -> dict[str, bytes]:
    """All files that a program may call by a computed number, by name; of files with equal names the one in
    the first folder is taken.

    Raises the errors of the function that `finder` returns.
    """
    find = finder(folders, max_bytes)
    stems = {file.name.lower().partition(".")[0] for folder in folders for file in _files(folder)}
    numbers = {stem.removeprefix("o").lstrip("0") for stem in stems if stem.removeprefix("o").isdigit()}
    return dict(file for number in sorted(numbers) if (file := find(number)) is not None)


def readable_folder(folder: Path) -> Path:
    """The folder, if its files can be listed. Raises InputError."""
    try:
        next(folder.iterdir(), None)
    except OSError as error:
        what = f"the folder {folder} of subprograms"
        raise InputError(unreadable(what, error, "the path of a folder")) from None
    return folder


def _files(folder: Path) -> list[Path]:
    # The program's own folder may have been removed, or may not allow listing.
    try:
        return sorted(file for file in folder.iterdir() if file.is_file())
    except OSError:
        return []

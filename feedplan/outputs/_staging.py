"""Writes a folder completely or not at all: files go to a temporary folder, which is then renamed."""

from __future__ import annotations

import errno
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath

from feedplan.errors import InputError


def require_folder(folder: FilePath) -> None:
    """Raises InputError if `folder` or a parent of it exists and is not a folder."""
    for part in (folder, *folder.parents):
        try:
            is_file = part.exists() and not part.is_dir()
        except (OSError, ValueError) as error:  # a name that the file system does not allow
            raise InputError(_sentence(folder, error)) from None
        if is_file:
            raise InputError(f"{part} is a file, not a folder: choose another folder with -o")


@contextmanager
def staged(folder: FilePath, last: str) -> Iterator[FilePath]:
    """A temporary folder to write into; its files move to `folder` when the block ends without an error.

    If `folder` does not exist, it appears by one rename. Otherwise each file replaces the one of the same
    name: the old file `last` is removed before the others are replaced, and the new one is moved after them,
    so while it exists, all files belong to one plan. Other files stay. After an error no temporary file is
    left. Raises InputError if the files cannot be written.
    """
    require_folder(folder)
    # It is made in `folder` or its nearest existing parent, so that both are on the same file system.
    home = folder
    while not home.exists():
        home = home.parent
    stage = home / f".feedplan-{secrets.token_hex(6)}"
    try:
        stage.mkdir()
        yield stage
        _move(stage, folder, last)
    except OSError as error:
        raise InputError(_sentence(folder, error)) from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _move(stage: FilePath, folder: FilePath, last: str) -> None:
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        stage.rename(folder)
        return
    others = sorted(file.name for file in stage.iterdir() if file.name != last)
    for name in (*others, last):
        if (folder / name).is_dir():
            raise IsADirectoryError(errno.EISDIR, f"{name} is a folder")
    if others:
        (folder / last).unlink(missing_ok=True)
    for name in others:
        # If one file replaces another, some file systems wait until the new one is on the disk.
        (folder / name).unlink(missing_ok=True)
        (stage / name).rename(folder / name)
    (stage / last).replace(folder / last)


def _sentence(folder: FilePath, error: OSError | ValueError) -> str:
    reason = (getattr(error, "strerror", None) or str(error)).lower()
    remedy = "choose another folder with -o"
    if getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT):
        remedy = f"free some space or {remedy}"
    return f"{folder} cannot be written ({reason}): {remedy}"

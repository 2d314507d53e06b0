"""A folder of outputs that appears whole or not at all: written beside, then renamed."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath

from feedplan.errors import InputError


def require_folder(folder: FilePath) -> None:
    """Raises InputError where `folder` or a part of its path is something else than a folder."""
    for place in (folder, *folder.parents):
        try:
            is_file = place.exists() and not place.is_dir()
        except (OSError, ValueError) as error:  # a name that no file can have
            raise InputError(_sentence(folder, error)) from None
        if is_file:
            raise InputError(f"{place} is a file, not a folder: choose another folder with -o")


@contextmanager
def staged(folder: FilePath, last: str) -> Iterator[FilePath]:
    """A fresh folder to write into; what it holds moves to `folder` when the block ends without an error.

    A new `folder` is one rename. In one that exists each file replaces its namesake, `last` after the others,
    so that its presence tells that all are there; other files stay. After an error nothing is left behind.
    Raises InputError where the file system refuses.
    """
    require_folder(folder)
    # Inside an existing folder, else in the nearest parent that exists: the same file system either way.
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
    for file in sorted(stage.iterdir(), key=lambda file: (file.name == last, file.name)):
        os.replace(file, folder / file.name)


def _sentence(folder: FilePath, error: OSError | ValueError) -> str:
    reason = (getattr(error, "strerror", None) or str(error)).lower()
    remedy = "choose another folder with -o"
    if getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT):
        remedy = f"free some space or {remedy}"
    return f"{folder} cannot be written ({reason}): {remedy}"

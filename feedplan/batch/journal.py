"""The rows of finished plans, one a line, in the order in which they end; a stopped batch continues from
it."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from contextlib import suppress
from pathlib import Path as FilePath
from typing import IO, Any

from feedplan.batch.sweep import JOURNAL
from feedplan.errors import InputError
from feedplan.outputs._staging import require_folder


class Journal:
    """The journal in a folder, locked against other batches.

    Raises InputError if it cannot be used.
    """

    def __init__(self, folder: FilePath) -> None:
        require_folder(folder)
        self._folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file: IO[str] = (folder / JOURNAL).open("a+", encoding="utf-8")
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise InputError(
                f"{folder} cannot be written ({reason}): choose another folder with -o"
            ) from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._file.close()
            raise InputError(f"another batch works on {folder}: choose another folder with -o") from None
        # Removes temporary folders of a batch that was killed.
        for left in folder.glob(".feedplan-*"):
            shutil.rmtree(left, ignore_errors=True)
        self._known = self._read()

    def _read(self) -> dict[str, dict[str, Any]]:
        self._file.seek(0)
        known: dict[str, dict[str, Any]] = {}
        torn = False
        for line in self._file:
            torn = not line.endswith("\n")
            with suppress(ValueError, KeyError, TypeError):  # a line may be incomplete after a kill
                row = json.loads(line)
                known[row["folder"]] = row
        if torn:
            self._file.write("\n")
        return known

    def close(self) -> None:
        self._file.close()

    def done(self, folder: str, fingerprint: str) -> dict[str, Any] | None:
        """The row of a finished plan that was written into the folder of that name, or None."""
        row = self._known.get(folder)
        return row if row is not None and row.get("fingerprint") == fingerprint else None

    def remove(self, folder: str) -> None:
        """Removes the folder of that name if the journal has it from an earlier plan."""
        if self._known.pop(folder, None) is not None:
            shutil.rmtree(self._folder / folder, ignore_errors=True)

    def add(self, row: dict[str, Any]) -> None:
        """Adds the row of a finished plan."""
        try:
            self._file.write(json.dumps(row, ensure_ascii=False) + "\n")
            self._file.flush()
        except OSError as error:
            reason = os.strerror(error.errno or 0).lower()
            raise InputError(
                f"{self._folder / JOURNAL} cannot be written ({reason}): free some space, and start again"
            ) from None

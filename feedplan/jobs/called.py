"""Finds the files that a program calls from its text, to send them to other computers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path as FilePath

from feedplan.program.source import MAX_BYTES
from feedplan.program.subprograms import finder, numbered_files

# `O<name> call`, `O100 call`; M98 P100, G65 P100. M97 calls within the file.
_BY_NAME = re.compile(rb"O\s*(?:<([^>]*)>|(\d+))\s*call", re.IGNORECASE)
_BY_NUMBER = re.compile(rb"(?:M\s*98|G\s*65|G\s*66)[^\n\r]*?P\s*(?:(\d+)|[#\[])", re.IGNORECASE)
_COMPUTED = re.compile(rb"O\s*[#\[][^\n\r]*call", re.IGNORECASE)


def called_files(content: bytes, folders: Sequence[FilePath]) -> dict[str, bytes]:
    """The files in these folders that a program of this content may call, and the files that these call.

    If a number is computed, all numbered files are in the result. Raises OSError if a file cannot be read,
    ValueError if it is too large.
    """
    find = finder(folders, MAX_BYTES)
    found: dict[str, bytes] = {}
    texts = [content] if folders else []
    while texts:
        text = texts.pop()
        new: dict[str, bytes] = {}
        for name in sorted(_names(text)):
            if (file := find(name)) is not None:
                new[file[0]] = file[1]
        if _COMPUTED.search(text) or b"" in _BY_NUMBER.findall(text):
            new |= numbered_files(folders, MAX_BYTES)
        texts += [own for name, own in new.items() if name not in found]
        found = {**new, **found}
    return found


def _names(text: bytes) -> set[str]:
    by_name = {name or number for name, number in _BY_NAME.findall(text)}
    numbers = {number for number in _BY_NUMBER.findall(text) if number}
    return {b"".join(name.split()).decode("utf-8", "replace").lower() for name in by_name | numbers}

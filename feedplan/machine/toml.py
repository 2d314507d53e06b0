"""Converts TOML text to tables and back, for machine files; the size of the text is limited."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from typing import Any

from feedplan.arguments import shown
from feedplan.errors import MachineError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# The greatest size of a machine file, and the greatest depth of keys within keys: reading time grows with the
# square of this depth.
MAX_LETTERS = 1 << 17
MAX_LEVELS = 20
_NOT_OF_KEYS = re.compile(r"[^\w\-\"'. \t]+")


def table_of(text: str) -> dict[str, Any]:
    """The table in a TOML text.

    Raises MachineError for a text that is too long or too deep; ValueError and RecursionError, from the TOML
    package, for a text that is not valid, such as integers of thousands of digits.
    """
    if len(text) > MAX_LETTERS:
        raise MachineError(f"it has more than {MAX_LETTERS} letters: give fewer")
    for part in _NOT_OF_KEYS.split(text):
        if sum(bool(key.strip()) for key in part.split(".")) > MAX_LEVELS:
            raise MachineError(f"{shown(part)} has more than {MAX_LEVELS} levels: give fewer")
    # Windows editors put a byte order mark before a text in UTF-8.
    return tomllib.loads(text.removeprefix("\ufeff"))


def table_lines(head: str, rows: Mapping[str, Any]) -> list[str]:
    """A table as lines of TOML; the first line is its head, such as `[offsets]`."""
    return [head, *(f"{_key(key)} = {toml_value(value)}" for key, value in rows.items())]


def toml_value(value: Any) -> str:
    """A value in TOML; JSON writes texts in the same way, except for one control character."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key(key)} = {toml_value(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml_value, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _key(key: str) -> str:
    plain = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if plain else toml_value(key)

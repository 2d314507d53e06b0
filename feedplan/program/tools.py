"""Reads tool tables of LinuxCNC (.tbl): lengths for G43, diameters for G41 and G42.

A line is a tool: `T1 P2 Z50.3 D6 ;6 mm end mill`. T is its number, P its pocket, X to W its offset [mm, deg],
D its diameter [mm], I and J are the angles of a lathe tool, which no path needs, Q its orientation. Text
after `;` is a comment. A number given to two tools is an error: LinuxCNC silently takes the first one, where
most people expect the last.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from feedplan.errors import InputError, unreadable
from feedplan.machine.axis import AXIS_LETTERS

MAX_BYTES = 1 << 20
_GREATEST = 2**32 - 1  # of T, P and Q

_WORD = re.compile(r"\s*([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))", re.IGNORECASE)
_KNOWN = frozenset("TPDQIJ").union(AXIS_LETTERS)


class Tool(NamedTuple):
    """A tool: `number`, `pocket`, `offset` (9,) along XYZABCUVW [mm, deg], `diameter` [mm] (negative if it is
    smaller than the tool for which the path was made), `orientation` (1 to 9 for lathe tools, else 0)."""

    number: int
    pocket: int
    offset: tuple[float, ...]
    diameter: float
    orientation: int


def read_tools(file: Path) -> tuple[Tool, ...]:
    """The tools of a table. Raises InputError naming file, line and word where it cannot be read."""
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(unreadable(f"the tool table {file}", error, "the path of a .tbl file")) from None
    if len(content) > MAX_BYTES:
        raise InputError(f"{file} has more than {MAX_BYTES} bytes: give a tool table")
    lines = content.decode("utf-8-sig", "replace").splitlines()
    tools: list[Tool] = []
    line_of: dict[int, int] = {}
    for number, line in enumerate(lines, 1):
        place = f"{file.name} line {number}"
        words = _words(line, place)
        if words:
            tool = _tool(words, place)
            first = line_of.setdefault(tool.number, number)
            if first != number:
                raise InputError(
                    f"{place}: T{tool.number} is the tool of line {first} already: keep one of them"
                )
            tools.append(tool)
    return tuple(tools)


def _words(line: str, place: str) -> dict[str, float]:
    text = line.split(";", 1)[0].rstrip()
    words: dict[str, float] = {}
    at = 0
    while at < len(text):
        match = _WORD.match(text, at)
        if match is None or match[1].upper() not in _KNOWN:
            raise InputError(
                f"{place}: {text[at:].strip()[:24]!r} is no word of a tool table: give lines such as "
                "T1 P1 Z50.3 D6 ;comment"
            )
        letter = match[1].upper()
        if letter in words:
            word = match[0].strip()
            raise InputError(f"{place}: {word} is the second {letter} of its tool: keep one of them")
        words[letter] = float(match[2])
        at = match.end()
    return words


def _tool(words: dict[str, float], place: str) -> Tool:
    if "T" not in words:
        raise InputError(f"{place}: the tool has no number: give a whole T from 0")

    def whole(letter: str, least: int = 0) -> int:
        value = words.get(letter, 0.0)
        if not least <= value <= _GREATEST or value != int(value):
            raise InputError(f"{place}: {letter} is {value:g}: give a whole number from 0 to {_GREATEST}")
        return int(value)

    return Tool(
        number=whole("T"),
        pocket=max(whole("P", least=-1), 0),  # LinuxCNC has -1 for none
        offset=tuple(words.get(letter, 0.0) for letter in AXIS_LETTERS),
        diameter=words.get("D", 0.0),
        orientation=whole("Q"),
    )

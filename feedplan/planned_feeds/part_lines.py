"""Writes the parts of a split line, with new ends and centres, and the line's other words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from feedplan.arrays import Floats
from feedplan.machine.axis import AXIS_LETTERS
from feedplan.planned_feeds.number import place_text
from feedplan.planned_feeds.parts import Parts
from feedplan.planned_feeds.text import blank_of, code_end, line_end
from feedplan.units import MM_PER_INCH

_WORD = re.compile(rb"([A-Za-z])([ \t]*)([-+]?[ \t]*(?:\d+\.?\d*|\.\d+))")
_REST = re.compile(rb"[ \t]*(?:\([^()\r\n]*\))?")
# Codes that a split line may have: they may be in every part, or in the first part alone.
_CODES = {1.0, 2.0, 3.0, 17.0, 18.0, 19.0, 20.0, 21.0, 40.0, 61.0, 90.0, 91.0, 90.1, 91.1, 94.0}
_ROTARY = b"ABC"


@dataclass(frozen=True)
class Word:
    """A word of a line: its letter, its number as text, and the offsets where the word starts, its number
    begins and it ends."""

    letter: bytes
    text: bytes
    start: int
    begin: int
    end: int

    @property
    def number(self) -> Decimal:
        return Decimal(re.sub(rb"[ \t]", b"", self.text).decode())


@dataclass(frozen=True)
class Sense:
    """The modes of a line: whether ends and centres are absolute, and whether lengths are in inches."""

    absolute: bool
    absolute_centres: bool
    inches: bool

    def unit(self, letter: bytes) -> float:
        """The unit of a word with that letter in mm or deg."""
        return MM_PER_INCH if self.inches and letter not in _ROTARY else 1.0


def words_of(line: bytes) -> list[Word] | None:
    """The words of a plain line or arc, which may be split; None for other lines."""
    end, at, words = code_end(line), 0, []
    while at < end:
        rest = _REST.match(line, at)
        if rest is not None and rest.end() > at:
            at = rest.end()
            continue
        found = _WORD.match(line, at)
        if found is None or found.end() > end:
            return None
        words.append(Word(found[1].upper(), found[3], found.start(), *found.span(3)))
        at = found.end()
    letters = [word.letter for word in words if word.letter != b"G"]
    known = all(letter in b"NXYZABCUVWIJKRPFS" for letter in letters)
    codes = all(float(word.number) in _CODES for word in words if word.letter == b"G")
    return words if known and codes and len(set(letters)) == len(letters) else None


def may_be_split(line: bytes, axes: Sequence[str], moving: Sequence[bool]) -> bool:
    """Whether a line is a plain line or arc with a word for each of the `axes` that it moves."""
    words = words_of(line)
    named = {word.letter.decode() for word in words or ()}
    return words is not None and all(name in named for name, moves in zip(axes, moving, strict=True) if moves)


def part_lines(
    line: bytes,
    sense: Sense,
    axes: Sequence[str],
    start: Floats,
    parts: Parts,
    centre: dict[str, float] | None,
    texts: Sequence[bytes | None],
    usual: bytes,
) -> bytes:
    """The lines for the parts of a line that may be split, each with its F where `texts` has one.

    `start` (axes,) is the start of the move; `centre` are the coordinates of an arc's centre in its plane, by
    axis; `usual` is the blank between words in the program. The first part has the line's other words and
    comments.
    """
    words = words_of(line) or []
    ends = np.concatenate([start[None, :], parts.ends])
    rows: list[dict[bytes, bytes]] = []
    summed: dict[bytes, Decimal] = {}
    for k in range(len(parts)):
        row: dict[bytes, bytes] = {}
        for word in words:
            if word.letter.decode() in AXIS_LETTERS:
                row[word.letter] = _end(word, sense, axes, ends, k, summed)
        for name, value in (centre or {}).items():
            letter = b"IJK"["XYZ".index(name) : "XYZ".index(name) + 1]
            given = next((word for word in words if word.letter == letter), None)
            if given is not None and (k == 0 or sense.absolute_centres):
                row[letter] = given.text
            else:
                from_start = (value - ends[k, axes.index(name)]) / sense.unit(letter)
                row[letter] = place_text(from_start)
        rows.append(row)
    stop = line_end(line) or b"\n"
    body, blank = line.rstrip(b"\r\n"), blank_of(line[: code_end(line)], usual)
    lines = [_first(body, words, rows[0], texts[0], blank)]
    for row, text in zip(rows[1:], texts[1:], strict=True):
        more = [letter + number for letter, number in row.items()]
        if text is not None:
            more.append(b"F" + text)
        lines.append(blank.join(more))
    return stop.join(lines) + line_end(line)


def _end(
    word: Word, sense: Sense, axes: Sequence[str], ends: Floats, k: int, summed: dict[bytes, Decimal]
) -> bytes:
    """The number of an axis word in part k; increments add up exactly to the program's increment."""
    column, last = axes.index(word.letter.decode()), len(ends) - 1
    unit = sense.unit(word.letter)
    if sense.absolute:
        if k + 1 == last:
            return word.text
        return place_text(float(word.number) + (ends[k + 1, column] - ends[last, column]) / unit)
    before = summed.get(word.letter, Decimal(0))
    # Positions are rounded instead of increments, so that errors do not add up.
    if k + 1 == last:
        return place_text(word.number - before)
    done = place_text((ends[k + 1, column] - ends[0, column]) / unit)
    summed[word.letter] = Decimal(done.decode())
    return place_text(summed[word.letter] - before)


def _first(
    body: bytes, words: Sequence[Word], row: dict[bytes, bytes], text: bytes | None, blank: bytes
) -> bytes:
    """The line itself with the first part's numbers; radii and numbers of turns are replaced by centres."""
    rest, pieces, at = dict(row), [], 0
    if text is not None:
        rest[b"F"] = text
    for word in words:
        number = rest.pop(word.letter, None)
        if word.letter in (b"R", b"P"):
            # The word is removed, with the blanks before it.
            before = body[at : word.start]
            pieces.append(before.rstrip(b" \t") if blank else before)
            at = word.end
        elif number is not None:
            pieces += [body[at : word.begin], number]
            at = word.end
    end = max(code_end(body), at)
    pieces.append(body[at:end])
    code = b"".join(pieces)
    more = b"".join(blank + letter + number for letter, number in rest.items())
    return code + more + body[end:]

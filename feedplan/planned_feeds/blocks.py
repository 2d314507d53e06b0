"""Finds in the text of a program, line by line, all words that concern feeds.

These are F words, the modes that decide the meaning of F, and the lines that do not run once and in order.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats, Integers

_NUMBER = rb"[-+]?[ \t]*(?:\d+\.?\d*|\.\d+)"
# Brackets, three deep; parameters by number or name; functions.
_INNER = rb"\[(?:[^\[\]\r\n]|\[[^\[\]\r\n]*\])*\]"
_BRACKETS = rb"\[(?:[^\[\]\r\n]|" + _INNER + rb")*\]"
_COMPUTED = (
    rb"[-+]?[ \t]*(?:\#[\# \t]*(?:<[^>\r\n]*>|\d+|"
    + _BRACKETS
    + rb")|[A-Za-z]*[ \t]*"
    + _BRACKETS
    + rb"(?:[ \t]*/[ \t]*"
    + _BRACKETS
    + rb")?)"
)
# Comments, texts for the operator and names of parameters contain no words.
_NO_WORDS = rb"\([^()\r\n]*\)?|;[^\r\n]*|[Mm][ \t]*0*11[78](?![\d.])[^\r\n]*|\#?<[^>\r\n]*>"
_LINE = rb"(?<![^\r\n])[ \t]*(?:[Nn][ \t]*\d+[ \t]*)?"
_CODES = rb"93|94|95|20|21|90\.1|91\.1|90|91|40|41\.1|42\.1|41|42|15|16|7|8|33\.1|33|76|74|84|43\.5|49|68|69"
_TOKENS = (
    _NO_WORDS
    + rb"|"
    + _LINE
    + rb"(?:%[^\r\n]*|(?P<deleted>/)|[Oo](?P<flow>[^\r\n]*)|(?P<jump>(?i:IF|GOTO|WHILE|END)[^\r\n]*))"
    + rb"|(?P<macro>[Gg][ \t]*0*65(?![\d.])[^\r\n]*)"
    + rb"|[Ff][ \t]*(?:(?P<feed>"
    + _NUMBER
    + rb")|(?P<computed>"
    + _COMPUTED
    + rb"))"
    + rb"|[Gg][ \t]*0*(?P<code>"
    + _CODES
    + rb")(?![\d.])"
    + rb"|[Mm][ \t]*0*(?P<switch>2|30|7[0-3]|9[789])(?![\d.])"
)
_TOKEN = re.compile(_TOKENS)
_KEYWORD = re.compile(
    rb"[ \t]*(?:<[^>\r\n]*>|\[[^\r\n]*?\]|\d+|\#[ \t]*(?:<[^>\r\n]*>|\d+))[ \t]*(?P<word>[A-Za-z]+)"
)
_MOTION = re.compile(rb"[Gg][ \t]*0*(?:[0-3]|5(?:\.[12])?|6\.2|33(?:\.1)?|7[346]|8[0-9])(?![\d.])")
_AT_ONCE = 1 << 16
_OPENS = (b"SUB", b"WHILE", b"DO", b"REPEAT", b"IF")
_CLOSES = (b"ENDSUB", b"ENDWHILE", b"ENDREPEAT", b"ENDIF")


class Exclusion(IntEnum):
    """The reason why the F of a line cannot be changed."""

    NO = 0
    FLOW = 1  # in a subroutine, loop or branch, a call of one, or after the end of the program
    THREAD = 2  # G33, G76 and tapping: the feed follows the spindle
    MODES = 3  # M70 to M73 save and restore the feed
    DELETED = 4  # after /
    REPEATED = 5  # runs more than once, or in another order


REASONS = {
    Exclusion.FLOW: "in a subroutine, loop or branch, or calls one",
    Exclusion.THREAD: "feed of a thread or a tap, which follows the spindle",
    Exclusion.MODES: "M70 to M73 save and restore the feed",
    Exclusion.DELETED: "after /, left out",
    Exclusion.REPEATED: "runs more than once, or out of order",
}


@dataclass(frozen=True, eq=False)
class Blocks:
    """The n lines of a text.

    - `start` (n + 1,): offsets of the lines in the text; `exclusion` (n,): an `Exclusion`;
    - `feed_at` (n, 2): where the number of its F begins and ends, −1 without F; `feed` (n,): that number, NaN
      without F or if it is computed;
    - `modes` (n, 2): where the number of a code G93 to G95 begins and ends, −1 without one;
    - `voids` (n,): a change of units or of the feed mode on the line changes the meaning of the F in force;
    - in force on the line (n,): `inverse` (G93), `per_minute` (G94), `absolute`, `absolute_centres`,
      `inches`, and `plain`: axis words are positions of the tool, without compensation, polar words and
      diameters.

    `calls_set_feed`: after a line of FLOW or MODES the feed in force is not known.
    """

    content: bytes
    start: Integers
    exclusion: NDArray[np.uint8]
    feed_at: Integers
    feed: Floats
    inverse: Flags
    per_minute: Flags
    voids: Flags
    modes: Integers
    absolute: Flags
    absolute_centres: Flags
    inches: Flags
    plain: Flags
    calls_set_feed: bool

    def __len__(self) -> int:
        return len(self.start) - 1

    def line(self, index: int) -> bytes:
        """The line with an index from 0, including its line end."""
        return self.content[self.start[index] : self.start[index + 1]]


def line_starts(content: bytes) -> Integers:
    """Offsets of the lines (n + 1,); the last one is the end of the text. Lines end with LF, CR LF or CR."""
    data = np.frombuffer(content, dtype=np.uint8)
    ends = data == ord("\n")
    returns = np.flatnonzero(data == ord("\r"))
    lone = returns[data[np.minimum(returns + 1, len(data) - 1)] != ord("\n")]
    ends[lone] = True
    starts = np.concatenate([[0], np.flatnonzero(ends) + 1])
    return starts if starts[-1] == len(data) else np.append(starts, len(data))


class _Modes:
    """The modes in force, and the lines where they change."""

    def __init__(self) -> None:
        self.now = {
            "inverse": False,
            "per_minute": True,
            "absolute": True,
            "absolute_centres": False,
            "inches": False,
        }
        self.beside: set[bytes] = set()
        # The modes in force from a line on; if a line has several entries, the last one counts.
        self._given = [(0, {**self.now, "plain": True})]
        self.units = self.feed_mode = b""

    def take(self, line: int, code: bytes) -> bool:
        """Applies a code; returns whether it changes the meaning of the F in force."""
        voids = False
        if code in (b"93", b"94", b"95"):
            voids = code != (self.feed_mode or b"94")
            self.feed_mode = code
            self.now["inverse"], self.now["per_minute"] = code == b"93", code == b"94"
        elif code in (b"20", b"21"):
            voids, self.units = code != self.units, code
            self.now["inches"] = code == b"20"
        elif code in (b"90", b"91"):
            self.now["absolute"] = code == b"90"
        elif code in (b"90.1", b"91.1"):
            self.now["absolute_centres"] = code == b"90.1"
        elif code in (b"41", b"42", b"41.1", b"42.1"):
            self.beside.add(b"40")
        elif code in (b"16", b"7", b"43.5", b"68"):
            self.beside.add({b"16": b"15", b"7": b"8", b"43.5": b"49", b"68": b"69"}[code])
        else:
            self.beside.discard(code)
        self._given.append((line, {**self.now, "plain": not self.beside}))
        return voids

    def columns(self, count: int) -> dict[str, Flags]:
        """The modes on each line (count,), by name."""
        lines, modes = zip(*self._given, strict=True)
        at = np.searchsorted(lines, np.arange(count), side="right") - 1
        return {name: np.array([own[name] for own in modes])[at] for name in modes[0]}


def blocks_of(content: bytes, block_delete: bool = True) -> Blocks:
    """The lines of a program; with `block_delete` those after `/` are excluded."""
    start = line_starts(content)
    count = len(start) - 1
    exclusion = np.zeros(count, dtype=np.uint8)
    feed_at, modes = np.full((count, 2), -1, dtype=np.int64), np.full((count, 2), -1, dtype=np.int64)
    feed, voids = np.full(count, np.nan), np.zeros(count, dtype=np.bool_)
    now, depth, opened, calls, subs, ended = _Modes(), 0, 0, False, False, False
    dos, jumps = 0, False
    for token, line in _tokens(content, start):
        kind = token.lastgroup
        if kind is None or exclusion[line] == Exclusion.DELETED:
            continue
        if kind == "feed":
            feed_at[line] = token.span("feed")
            feed[line] = float(re.sub(rb"[ \t]", b"", token["feed"]))
        elif kind == "code":
            code = token["code"]
            if code in (b"33", b"33.1", b"76", b"74", b"84"):
                exclusion[line] = Exclusion.THREAD
                continue
            voids[line] |= now.take(line, code)
            if code in (b"93", b"94", b"95"):
                modes[line] = token.span("code")
        elif kind == "jump":
            jumps = True
        elif kind == "macro":
            calls = True
            exclusion[line] = Exclusion.FLOW
        elif kind == "computed":
            feed_at[line] = token.span("computed")
        elif kind == "deleted":
            if block_delete:
                exclusion[line] = Exclusion.DELETED
        elif kind == "switch":
            number = int(token["switch"])
            if number in (2, 30):
                if not ended and depth == 0:
                    ended = True
                    exclusion[line + 1 :] = Exclusion.FLOW
            elif number < 90:
                exclusion[line] = Exclusion.MODES
            else:
                calls = True
                exclusion[line] = Exclusion.FLOW
        else:
            keyword = _KEYWORD.match(token["flow"])
            word = keyword["word"].upper() if keyword else b""
            # A `while` that ends a `do` closes it; any other `while` opens a loop.
            closes_do = word == b"WHILE" and dos > 0
            if word in _CLOSES or closes_do:
                depth, dos = max(depth - 1, 0), dos - int(closes_do)
                if depth == 0:
                    exclusion[opened : line + 1] = Exclusion.FLOW
            elif word in _OPENS:
                opened = line if depth == 0 else opened
                depth, dos = depth + 1, dos + int(word == b"DO")
                subs |= word == b"SUB"
            elif word:
                exclusion[line] = Exclusion.FLOW
                calls |= word == b"CALL"
            elif token["flow"].strip():
                subs |= ended
    if depth:
        exclusion[opened:] = Exclusion.FLOW
    if jumps:
        # Fanuc's GOTO may jump to any line.
        exclusion[exclusion != Exclusion.DELETED] = Exclusion.FLOW
    if (exclusion == Exclusion.THREAD).any():
        _follow_threads(content, start, exclusion)
    away = (exclusion == Exclusion.FLOW) | (exclusion == Exclusion.MODES)
    return Blocks(
        content=content,
        start=start,
        exclusion=exclusion,
        feed_at=feed_at,
        feed=feed,
        voids=voids,
        modes=modes,
        **now.columns(count),
        calls_set_feed=bool((feed_at[away, 0] >= 0).any() or (calls and not subs)),
    )


def _tokens(content: bytes, start: Integers) -> Iterator[tuple[re.Match[bytes], int]]:
    """The tokens of a text with the index of their line; a part at a time, as there may be millions."""
    found = _TOKEN.finditer(content)
    while tokens := list(islice(found, _AT_ONCE)):
        at = np.searchsorted(start, [token.start() for token in tokens], side="right") - 1
        yield from zip(tokens, at.tolist(), strict=True)


def _follow_threads(content: bytes, start: Integers, exclusion: NDArray[np.uint8]) -> None:
    """Marks lines after a thread as threads too, until another motion code."""
    threading = False
    for line in range(len(exclusion)):
        if exclusion[line] == Exclusion.THREAD:
            threading = True
        elif threading:
            text = re.sub(_NO_WORDS, b"", content[start[line] : start[line + 1]])
            if _MOTION.search(text):
                threading = False
            elif exclusion[line] == Exclusion.NO:
                exclusion[line] = Exclusion.THREAD

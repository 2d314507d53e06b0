"""Events between a program's moves: spindle, coolant, tools, outputs, dwells, stops, messages, comments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats, Integers

MESSAGE, COMMENT = "(", ";"
# The M codes whose channel is given by the letter E.
_ANALOG = (67, 68)


@dataclass(frozen=True, eq=False)
class Events:
    """The words that cause events, in the order of the program, one row each.

    `move` (m,) is the number of moves before the event, `line` (m,) its 1-based source line; `letter` (m,)
    and `number` (m,) are the word: M3, S1000, T5, M62, M0, G4. `p` and `q` (m,) are the values of the words
    that belong to it, NaN without one; `p` is the tool's number for M6, the seconds for G4, and the word E
    for M66 to M68. A message (MSG, DEBUG, PRINT and LOG of LinuxCNC, M117) has the letter `(`, a comment `;`;
    its number is the index of its text in `texts`.
    """

    move: Integers
    line: NDArray[np.int32]
    letter: NDArray[np.uint8]
    number: Floats
    p: Floats
    q: Floats
    texts: tuple[str, ...] = ()

    @classmethod
    def none(cls) -> Events:
        """No events."""
        empty = np.empty(0)
        return cls(
            empty.astype(np.int64), empty.astype(np.int32), empty.astype(np.uint8), empty, empty, empty
        )

    def __len__(self) -> int:
        return len(self.move)

    def words(self) -> tuple[str, ...]:
        """Each event as words, such as `M62 P3`; messages and comments as their text in brackets."""
        return tuple(f"({text})" if said else text for text, said in zip(*self.said(), strict=True))

    def said(self) -> tuple[list[str], list[bool]]:
        """The text of each event, and whether the event is a message or a comment."""
        is_text = np.isin(self.letter, [ord(MESSAGE), ord(COMMENT)])
        texts = [""] * len(self)
        words = np.flatnonzero(~is_text)
        first, place = _different(self.letter[words], self.number[words], self.p[words], self.q[words])
        rows = words[first]
        columns = (self.letter[rows], self.number[rows], self.p[rows], self.q[rows])
        spelt = [_word(*row) for row in np.stack(columns, axis=1).tolist()]
        for row, own in zip(words.tolist(), place.tolist(), strict=True):
            texts[row] = spelt[own]
        for row in np.flatnonzero(is_text).tolist():
            texts[row] = self.texts[int(self.number[row])]
        return texts, is_text.tolist()


def _word(letter: float, number: float, p: float, q: float) -> str:
    """An event's word with the words that belong to it."""
    first = "E" if letter == ord("M") and number in _ANALOG else "P"
    others = "".join(f" {name}{value:g}" for name, value in ((first, p), ("Q", q)) if not math.isnan(value))
    return f"{chr(int(letter))}{number:g}{others}"


def _different(*columns: NDArray[Any]) -> tuple[Integers, Integers]:
    """The first row of each kind, and the kind of each row (m,). Rows are of one kind if all their `columns`
    (m,) are equal bit by bit, so NaN equals the same NaN."""
    kind = np.zeros(len(columns[0]), np.int64)
    for column in columns:
        _, own = np.unique(column.astype(np.float64).view(np.int64), return_inverse=True)
        _, first, kind = np.unique(kind * len(kind) + own, return_index=True, return_inverse=True)
    return first, kind

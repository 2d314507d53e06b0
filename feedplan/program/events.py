"""What happens between the moves of a program: spindle, coolant, tools, outputs, dwells, stops, messages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MESSAGE = "("


@dataclass(frozen=True, eq=False)
class Events:
    """Words that switch something, in the order of the program, one row each.

    `move` (m,) is how many moves come before it, `line` (m,) its 1-based source line, `letter` (m,) and
    `number` (m,) the word: M3, S1000, T5, M62, M0, G4. `p` and `q` (m,) are the words that go with it, NaN
    where there is none: of M6 `p` is the tool's number, of G4 the seconds, of M66 to M68 the word E. A
    message (MSG, DEBUG, PRINT and LOG of LinuxCNC, M117) has the letter `(` and as its number the place of
    its text in `texts`.
    """

    move: NDArray[np.int64]
    line: NDArray[np.int32]
    letter: NDArray[np.uint8]
    number: NDArray[np.float64]
    p: NDArray[np.float64]
    q: NDArray[np.float64]
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
        """Each event as it would be written, such as `M62 P3`; messages as their text in brackets."""
        return tuple(self._word(row) for row in range(len(self)))

    def _word(self, row: int) -> str:
        letter = chr(self.letter[row])
        if letter == MESSAGE:
            return f"({self.texts[int(self.number[row])]})"
        with_it = ((name, column[row]) for name, column in (("P", self.p), ("Q", self.q)))
        others = "".join(f" {name}{value:g}" for name, value in with_it if not np.isnan(value))
        return f"{letter}{self.number[row]:g}{others}"

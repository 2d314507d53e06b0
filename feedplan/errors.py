"""The errors feedplan raises: one sentence with the place, the value, the limit and the remedy."""

from __future__ import annotations

# Longest sentence, and longest word in it if it is too long: the middle of long words, such as paths, is left
# out first, then the middle of the sentence.
LONGEST, LONGEST_WORD = 300, 60


class FeedplanError(Exception):
    """Base of every error that feedplan raises on purpose; its text, one line, is meant for the user."""

    def __init__(self, message: str = "") -> None:
        line = " ".join(message.splitlines())
        if len(line) > LONGEST:
            line = " ".join(_shortened(word, LONGEST_WORD) for word in line.split(" "))
        super().__init__(_shortened(line, LONGEST))


def _shortened(text: str, most: int) -> str:
    """The text; if it has more than `most` characters, its start and a longer part of its end."""
    start = (most - 3) // 3
    return text if len(text) <= most else f"{text[:start]}...{text[start + 3 - most :]}"


class InputError(FeedplanError):
    """An argument, file or array cannot be used as it is."""


class ProgramError(InputError):
    """A part program cannot be understood.

    `line` is the line of the file, from 1, or None for the whole file.
    """

    def __init__(self, message: str, line: int | None = None) -> None:
        super().__init__(message)
        self.line = line


class MachineError(InputError):
    """A machine file is incomplete or contradictory, or the machine does not suit the program."""


class InfeasibleError(FeedplanError):
    """No profile meets the limits.

    `line` is the source line, `reachable` the greatest speed that is possible there [mm/s].
    """

    def __init__(self, message: str, line: int | None = None, reachable: float | None = None) -> None:
        super().__init__(message)
        self.line = line
        self.reachable = reachable


class SolverError(FeedplanError):
    """A numerical solver failed, or a method cannot plan this kind of path; the text has reason and
    remedy."""


class MissingPackageError(FeedplanError):
    """An optional package is not installed; the text carries the command that installs it."""

"""The errors feedplan raises: one sentence with the place, the value, the limit and the remedy."""

from __future__ import annotations

# No sentence is longer: the middle of its longest words, such as paths, is left out, and then its own.
LONGEST, LONGEST_WORD = 300, 60


class FeedplanError(Exception):
    """Base of every error that feedplan raises on purpose; its text, one line, is meant for the user."""

    def __init__(self, message: str = "") -> None:
        line = " ".join(message.splitlines())
        if len(line) > LONGEST:
            line = " ".join(_shortened(word, LONGEST_WORD) for word in line.split(" "))
        super().__init__(_shortened(line, LONGEST))


def _shortened(text: str, most: int) -> str:
    """The text, or its start and its end where it has more than `most` characters, the end the longer one."""
    start = (most - 3) // 3
    return text if len(text) <= most else f"{text[:start]}...{text[start + 3 - most :]}"


class InputError(FeedplanError):
    """An argument, file or array cannot be used as it is."""


class ProgramError(InputError):
    """A part program cannot be understood.

    `line` is the 1-based line of the file, or None where the whole file is meant.
    """

    def __init__(self, message: str, line: int | None = None) -> None:
        super().__init__(message)
        self.line = line


class MachineError(InputError):
    """A machine description is incomplete, contradictory or does not suit the program."""


class InfeasibleError(FeedplanError):
    """No profile meets the limits.

    `line` is the source line of the place, `reachable` the greatest speed [mm/s] that can be had there.
    """

    def __init__(self, message: str, line: int | None = None, reachable: float | None = None) -> None:
        super().__init__(message)
        self.line = line
        self.reachable = reachable


class SolverError(FeedplanError):
    """A numerical solver gave up, or a method is not made for the path; the text says why and the remedy."""


class MissingPackageError(FeedplanError):
    """An optional package is not installed; the text carries the command that installs it."""

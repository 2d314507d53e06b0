"""The errors that feedplan raises: one sentence with the place, the value, the limit and the remedy."""

from __future__ import annotations

from typing import ClassVar, Literal

ErrorKind = Literal["program", "machine", "package", "infeasible", "solver", "input"]

# The greatest lengths of a sentence, and of a word in a sentence that is too long: the middle of long words,
# such as paths, is left out first, then the middle of the sentence.
LONGEST, LONGEST_WORD = 300, 60


class FeedplanError(Exception):
    """Base class of every error that feedplan raises on purpose; its text is one line for the user.

    `line` is the source line of the program that the error is about, from 1, or None. `kind` is the name of
    the class in the outcomes of jobs and in the problems of the service.
    """

    kind: ClassVar[ErrorKind] = "input"

    def __init__(self, message: str = "", line: int | None = None) -> None:
        self.line = line or None
        text = " ".join(message.splitlines())
        if len(text) > LONGEST:
            text = " ".join(_shortened(word, LONGEST_WORD) for word in text.split(" "))
        super().__init__(_shortened(text, LONGEST))


def at_line(line: int) -> str:
    """`line 7: `, the beginning of a sentence about a source line; empty for 0, a path without a program."""
    return f"line {line}: " if line else ""


def _shortened(text: str, most: int) -> str:
    """The text; if it is longer than `most` characters, only its start and a longer part of its end."""
    start = (most - 3) // 3
    return text if len(text) <= most else f"{text[:start]}...{text[start + 3 - most :]}"


def unreadable(what: object, error: Exception, remedy: str) -> str:
    """The sentence for a file that cannot be read: `part.ngc cannot be read (no such file): give …`."""
    return f"{what} cannot be read ({getattr(error, 'strerror', None) or error}): give {remedy}"


class InputError(FeedplanError):
    """An argument, file or array cannot be used as it is."""


class ProgramError(InputError):
    """A part program cannot be understood; `line` is None if the error is about the whole file."""

    kind = "program"


class MachineError(InputError):
    """A machine file is incomplete or contradictory, or the machine does not suit the program."""

    kind = "machine"


class InfeasibleError(FeedplanError):
    """No profile meets the limits; `reachable` is the greatest speed that is possible at the line [mm/s]."""

    kind = "infeasible"

    def __init__(self, message: str, line: int | None = None, reachable: float | None = None) -> None:
        super().__init__(message, line)
        self.reachable = reachable


class SolverError(FeedplanError):
    """A numerical solver failed, or a method cannot plan this kind of path; the text has reason and
    remedy."""

    kind = "solver"


class MissingPackageError(FeedplanError):
    """An optional package is not installed; the text has the command that installs it."""

    kind = "package"

"""The errors feedplan raises: one sentence with the place, the value, the limit and the remedy."""

from __future__ import annotations


class FeedplanError(Exception):
    """Base of every error that feedplan raises on purpose; its text is meant for the user."""


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

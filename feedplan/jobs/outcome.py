"""The outcome of a job, as plain values."""

from __future__ import annotations

import json
import traceback
from dataclasses import asdict, dataclass
from typing import Any, Literal

from feedplan.errors import ErrorKind, FeedplanError

Kind = ErrorKind | Literal["disk", "limit", "worker", "defect"]


@dataclass(frozen=True)
class Failure:
    """The reason why a job has no plan: its kind, one sentence, the line of the program, and, for a defect of
    feedplan, the `trace`."""

    kind: Kind
    sentence: str
    line: int | None = None
    trace: str = ""


@dataclass(frozen=True)
class Outcome:
    """The outcome of a job that took `seconds` and made files of `size` bytes.

    A job that is `done` has the key figures of its plan, a `failed` one has a failure; a `stopped` job was
    told to stop; a `lost` job has lost its executor and may run again.
    """

    state: Literal["done", "failed", "stopped", "lost"]
    figures: dict[str, Any] | None = None
    failure: Failure | None = None
    seconds: float = 0.0
    size: int = 0

    def text(self) -> str:
        """The outcome as JSON."""
        return json.dumps(asdict(self))

    @staticmethod
    def of(text: str) -> Outcome:
        """The outcome from a text made by `text`."""
        table = json.loads(text)
        failure = table.pop("failure")
        return Outcome(**table, failure=failure and Failure(**failure))

    @staticmethod
    def failed(kind: Kind, sentence: str) -> Outcome:
        """The outcome of a job that failed."""
        return Outcome("failed", failure=Failure(kind, sentence))

    @staticmethod
    def of_error(error: Exception, seconds: float = 0.0) -> Outcome:
        """The outcome of a job that raised this error after some time."""
        return Outcome("failed", failure=_failure_of(error), seconds=seconds)


def _failure_of(error: Exception) -> Failure:
    """The failure of a job that raised this error."""
    if isinstance(error, MemoryError):
        said = "the memory of the computer does not suffice below max_memory: split the program"
        return Failure("limit", said)
    if not isinstance(error, FeedplanError):
        told = f"{type(error).__name__}: {error}"[:500]
        sentence = f"this is a defect in feedplan ({told}): please report it with the program"
        return Failure("defect", sentence, trace=traceback.format_exc()[-4000:])
    is_disk = isinstance(error.__cause__, OSError)
    return Failure("disk" if is_disk else error.kind, str(error), error.line)

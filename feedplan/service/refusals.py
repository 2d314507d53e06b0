"""Refused requests and failed jobs as problems of RFC 9457.

The sentence of a problem ends with the remedy, as all errors of feedplan do: `place: what is wrong: remedy`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from feedplan.errors import FeedplanError
from feedplan.service.limits import Limits

MEDIA_TYPE = "application/problem+json"
TYPE = "urn:feedplan:"


@dataclass(frozen=True)
class Kind:
    """A kind of problem: the end of its type, its HTTP status and its title."""

    name: str
    status: int
    title: str


PROGRAM = Kind("program", 422, "The program cannot be used")
MACHINE = Kind("machine", 422, "The machine cannot be used")
INPUT = Kind("input", 422, "The request cannot be used")
INFEASIBLE = Kind("infeasible", 422, "No plan keeps the limits")
SOLVER = Kind("solver", 422, "The method found no plan")
PACKAGE = Kind("package", 501, "The service lacks a package")
LIMIT = Kind("limit", 422, "A limit of the service is exceeded")
TOO_LARGE = Kind("limit", 413, "The request is too large")
TOO_SLOW = Kind("limit", 408, "The request took too long")
MEDIA = Kind("input", 415, "The type of the request is not known")
BUSY = Kind("limit", 429, "The queue is full")
DISK = Kind("limit", 507, "The disk is full")
UNKNOWN = Kind("unknown", 404, "There is no such thing")
METHOD = Kind("method", 405, "The address does not take this method")
STATE = Kind("state", 409, "The job has no such thing at this time")
TOKEN = Kind("token", 401, "The token is missing or wrong")
FOREIGN = Kind("foreign", 403, "The request comes from elsewhere")
WORKER = Kind("worker", 500, "The process of the job ended")
CANCELLED = Kind("cancelled", 409, "The job was cancelled")
DEFECT = Kind("defect", 500, "A defect in feedplan")

# The kind of problem for each kind of failure of a job.
_OF_FAILURES = (PROGRAM, MACHINE, INPUT, INFEASIBLE, SOLVER, PACKAGE, LIMIT, WORKER, DEFECT)
KINDS: dict[str, Kind] = {**{kind.name: kind for kind in _OF_FAILURES}, "disk": DISK}


class Refusal(Exception):  # noqa: N818 (it is an answer)
    """A request that is refused, or the reason why a job has no plan.

    `detail` is the sentence; `file` and `line` locate it in the program; `limit` is the limit of the service
    that it names, with value and unit.
    """

    def __init__(
        self,
        kind: Kind,
        detail: str,
        *,
        file: str | None = None,
        line: int | None = None,
        limit: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(detail)
        self.kind, self.detail, self.file, self.line, self.limit = kind, detail, file, line, limit

    def to_json(self) -> dict[str, Any]:
        """The members of the problem; unknown ones are None."""
        what, _, remedy = self.detail.rpartition(": ")
        return {
            "type": TYPE + self.kind.name,
            "title": self.kind.title,
            "status": self.kind.status,
            "detail": self.detail,
            "file": self.file,
            "line": self.line,
            "limit": self.limit,
            "remedy": remedy if what else None,
        }

    def text(self) -> str:
        """The problem as JSON."""
        return json.dumps(self.to_json(), ensure_ascii=False)


def over(limits: Limits, kind: Kind, sentence: str) -> Refusal:
    """The refusal of a request that exceeds the limit in the sentence."""
    return Refusal(kind, sentence, limit=limits.named_in(sentence))


def refusal_of(error: FeedplanError) -> Refusal:
    """An error of feedplan as a problem."""
    return Refusal(KINDS[error.kind], str(error))

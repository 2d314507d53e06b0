"""A place where jobs run: what batches and the service know of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event
from typing import Protocol

from feedplan.jobs.order import Job
from feedplan.jobs.outcome import Failure, Outcome

MB = 1_000_000
# Told of a job, by its place in the sequence, that part of a stage is done.
Told = Callable[[int, str, float], None]


@dataclass(frozen=True)
class JobLimits:
    """What a job may take at most: `max_time` [s], `max_memory` [MB]."""

    max_time: float
    max_memory: float

    def over_time(self) -> Outcome:
        """The end of a job that takes longer."""
        return _over(f"the job has run for {self.max_time:g} s, all of max_time: choose a quicker method")

    def over_memory(self, used: int) -> Outcome:
        """The end of a job that has `used` more bytes."""
        return _over(
            f"the job takes {used / MB:.6g} MB of memory, more than the {self.max_memory:g} of max_memory: "
            "split the program"
        )


def _over(sentence: str) -> Outcome:
    return Outcome("failed", failure=Failure("limit", sentence))


class Place(Protocol):
    """Runs jobs; all methods may be called from any thread.

    So many sequences as `depth` may be given to it for each slot: one that waits beside one that runs where
    it takes a while until a worker has news.
    """

    depth: int

    def slots(self) -> int:
        """How many sequences of jobs run at a time now; it may change."""

    def run(self, jobs: Sequence[Job], told: Told, stop: Event) -> list[Outcome]:
        """Runs these jobs one after the other and waits for them; returns what became of each.

        `told` is called from this thread. When `stop` is set the jobs that are left end as `stopped`, within
        some tenths of a second.
        """

    def close(self) -> None:
        """Nothing is called any more."""

"""The interface of executors, which run the jobs of batches and of the service."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event
from typing import Protocol

from feedplan.jobs.order import Job
from feedplan.jobs.outcome import Outcome

MB = 1_000_000
# Called with the index of a job in its sequence, a stage, and the finished share of the stage (0 to 1).
JobListener = Callable[[int, str, float], None]


@dataclass(frozen=True)
class JobLimits:
    """The limits of a job: `max_time` [s], `max_memory` [MB]."""

    max_time: float
    max_memory: float

    def over_time(self) -> Outcome:
        """The outcome of a job that takes longer than `max_time`."""
        return Outcome.failed(
            "limit", f"the job has run for {self.max_time:g} s, all of max_time: choose a quicker method"
        )

    def over_memory(self, used: int) -> Outcome:
        """The outcome of a job whose memory `used` [bytes] exceeds `max_memory`."""
        return Outcome.failed(
            "limit",
            f"the job takes {used / MB:.6g} MB of memory, more than the {self.max_memory:g} of max_memory: "
            "split the program",
        )


class Executor(Protocol):
    """Runs jobs; all methods may be called from any thread.

    `depth` is the number of sequences given to each slot at a time: 2 if a slot would wait for the next one.
    """

    depth: int

    def slots(self) -> int:
        """The number of sequences of jobs that can run at the same time; it may change. It is 0 while the
        workers cannot be reached."""

    def run(self, jobs: Sequence[Job], report: JobListener, stop: Event) -> list[Outcome]:
        """Runs these jobs in order, waits for them and returns their outcomes.

        `report` is called from this thread. When `stop` is set the remaining jobs end as `stopped`, within
        some tenths of a second.
        """

    def close(self) -> None:
        """Ends the executor; no method may be called after it."""

"""Chooses the number of jobs that are sent as one task, because a task costs more than a small job."""

from __future__ import annotations

import threading

from feedplan.jobs.outcome import Outcome

# Jobs of one task: about LONG time [s] and LARGE files [bytes] together, and at most MOST jobs.
LONG, LARGE, MOST = 0.5, 32_000_000, 200
# Weight of a new job in the running mean of times and sizes.
NEWS = 0.1


class Packing:
    """Chooses the number of jobs of a task from the times and sizes of earlier jobs."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._seconds: float | None = None
        self._size = 0.0

    def add(self, outcome: Outcome) -> None:
        """Takes the time [s] and the size of the files [bytes] of a job that has ended."""
        with self._lock:
            if self._seconds is None:
                self._seconds, self._size = outcome.seconds, float(outcome.size)
            self._seconds += NEWS * (outcome.seconds - self._seconds)
            self._size += NEWS * (outcome.size - self._size)

    def count(self, left: int, slots: int) -> int:
        """The number of jobs of the next task if `left` jobs remain; small enough to keep all slots busy."""
        with self._lock:
            if self._seconds is None:
                return 1
            most = min(
                LONG / max(self._seconds, 1e-6), LARGE / max(self._size, 1.0), left / (2 * slots), MOST
            )
            return max(int(most), 1)

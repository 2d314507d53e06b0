"""How many jobs go together, so that small ones do not drown in what each task costs."""

from __future__ import annotations

import threading

from feedplan.jobs.outcome import Outcome

# Jobs that go together take about so long [s], their files about so much [bytes], and are no more.
LONG, LARGE, MOST = 0.5, 32_000_000, 200
# The part of what is known of a job that each new one changes.
NEWS = 0.1


class Packing:
    """Tells how many jobs go together, from what those so far have taken."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._seconds: float | None = None
        self._size = 0.0

    def add(self, outcome: Outcome) -> None:
        """A job has taken so long and made files so large."""
        with self._lock:
            if self._seconds is None:
                self._seconds, self._size = outcome.seconds, float(outcome.size)
            self._seconds += NEWS * (outcome.seconds - self._seconds)
            self._size += NEWS * (outcome.size - self._size)

    def count(self, left: int, slots: int) -> int:
        """How many of the jobs that are left go together, on so many slots: all of these shall have work to
        the end."""
        with self._lock:
            if self._seconds is None:
                return 1
            most = min(
                LONG / max(self._seconds, 1e-6), LARGE / max(self._size, 1.0), left / (2 * slots), MOST
            )
            return max(int(most), 1)

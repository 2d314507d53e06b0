"""Wall time and processor time of calls."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Taken:
    """`wall` time [s] and `processor` time of all threads [s].

    On a computer with other work only the processor time measures the cost of a call.
    """

    wall: float
    processor: float


def taken(call: Callable[[], object]) -> Taken:
    """Times one call."""
    wall, processor = time.perf_counter(), time.process_time()
    call()
    return Taken(time.perf_counter() - wall, time.process_time() - processor)


def best_of(call: Callable[[], object], times: int) -> Taken:
    """The least wall time and the least processor time of `times` calls, but of 3 to 50."""
    return best_of_each([call], min(max(times, 3), 50))[0]


def best_of_each(calls: Sequence[Callable[[], object]], times: int) -> list[Taken]:
    """The least times of several calls. Calls alternate, so that other work of the computer affects all."""
    rounds = [[taken(call) for call in calls] for _ in range(times)]
    return [
        Taken(min(t.wall for t in measured), min(t.processor for t in measured))
        for measured in zip(*rounds, strict=True)
    ]

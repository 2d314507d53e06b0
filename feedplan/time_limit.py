"""A time limit for all that becomes of a program: how much of it is left, and what is kept for the end."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from feedplan.arguments import number
from feedplan.setpoints import Setpoints

# Audit, setpoints and report take about so many times as long as computing the setpoints once.
FOLLOWING = 8.0
# The part of the setpoints whose computing is timed for that.
SAMPLE = 1 / 64


@dataclass
class TimeLimit:
    """`seconds` from the making of this object on, by a `clock` [s]; `kept` of them are for what follows a
    plan in any case: its audit, setpoints and report."""

    seconds: float
    clock: Callable[[], float] = time.perf_counter
    kept: float = 0.0
    start: float = field(init=False)

    def __post_init__(self) -> None:
        self.seconds = number(self.seconds, "the time limit", "0 or more", lambda limit: limit >= 0, "s")
        self.start = self.clock()

    @property
    def left(self) -> float:
        """What is left beside what is kept [s], 0 or more."""
        return max(self.seconds - self.kept - (self.clock() - self.start), 0.0)

    def keep_for(self, setpoints: Setpoints) -> float:
        """Keeps what will follow a plan with such setpoints, and returns it [s]."""
        begin = self.clock()
        next(setpoints.chunks(max(int(SAMPLE * setpoints.count), 1)))
        self.kept = FOLLOWING / SAMPLE * (self.clock() - begin)
        return self.kept

"""A time limit for the whole work on a program, and the part of it that is reserved for audit and files."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from feedplan.arguments import number
from feedplan.setpoints import Setpoints

# Approximate ratio of the time of audit, setpoints and report to the time of computing the setpoints once.
FOLLOWING = 8.0
# The share of the setpoints that is computed to measure this time.
SAMPLE = 1 / 64


@dataclass
class TimeLimit:
    """A limit of `seconds` from the creation of this object, measured by a `clock` [s]; `kept` of them are
    reserved for the audit, the setpoints and the report, which follow every plan."""

    seconds: float
    clock: Callable[[], float] = time.perf_counter
    kept: float = 0.0
    start: float = field(init=False)

    def __post_init__(self) -> None:
        self.seconds = number(self.seconds, "the time limit", "0 or more", lambda limit: limit >= 0, "s")
        self.start = self.clock()

    @property
    def left(self) -> float:
        """The time left for planning, without the reserved time [s], 0 or more."""
        return max(self.seconds - self.kept - (self.clock() - self.start), 0.0)

    def keep_for(self, setpoints: Setpoints) -> float:
        """Reserves the estimated time of the work after a plan with these setpoints, and returns it [s]."""
        begin = self.clock()
        next(setpoints.chunks(max(int(SAMPLE * setpoints.count), 1)))
        self.kept = FOLLOWING / SAMPLE * (self.clock() - begin)
        return self.kept

"""Knots of a plan: its states at equal time steps between stops, and exactly at every stop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from feedplan.arguments import number, positive
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.profile import SpeedProfile
from feedplan.setpoints import MAX_SETPOINTS, SetpointChunk, chunks

# Least number of steps of a run: with two steps, the knot between its ends can have a speed.
LEAST_STEPS = 2


class Knots:
    """The states on the plan's own clock, computed when they are read.

    A run is divided into equal steps, none longer than `step` [s] and at least two; a pause is one step. The
    last of the `count` knots is at the plan's time, `duration` [s]. At a stop velocity, acceleration and jerk
    are 0. Raises InputError for a step that cannot be used, or that makes more than `most` knots.
    """

    def __init__(
        self, problem: Problem, profile: SpeedProfile, step: float, most: int = MAX_SETPOINTS
    ) -> None:
        self.step = number(step, "the step", "a positive number", positive, "s")
        self.axes = problem.axes
        self._sampler = profile.sampler(problem)
        self._origin = problem.joint_origin
        self._ends_at_rest = problem.end_speed == 0.0
        begins, _, times = self._sampler.runs.T
        # Pauses and runs in turn; a pause or run of duration 0 has no step.
        self._begin, self._time = np.zeros((2, 2 * len(times) + 1))
        self._begin[1::2], self._begin[2::2] = begins, begins + times
        self._time[0::2] = np.append(problem.path.start_dwell, problem.path.dwell)
        self._time[1::2] = times
        steps = np.ones(len(self._time))
        steps[1::2] = np.maximum(np.ceil(times / self.step), LEAST_STEPS)
        steps[self._time == 0.0] = 0.0
        if not 1.0 + steps.sum() <= most:
            raise InputError(
                f"a step of {step:g} s makes more than {most} knots: choose a longer one, or ask for so many "
                "by max_setpoints"
            )
        self._steps = steps.astype(np.int64)
        self._ends = np.cumsum(self._steps)
        self.count = 1 + int(self._ends[-1])
        self.duration = float(self._begin[-1] + self._time[-1])

    def __repr__(self) -> str:
        return f"<Knots: {self.count} of {' '.join(self.axes)}, one every {self.step:g} s at most>"

    def chunks(self, size: int = 100_000) -> Iterator[SetpointChunk]:
        """The knots in chunks of `size`, the last one shorter: memory does not grow with their number."""
        return chunks(self._chunk, self.count, size)

    def _chunk(self, start: int, stop: int) -> SetpointChunk:
        index = np.arange(start, stop)
        # The part whose step ends at the knot; the very first knot belongs to the first part.
        part = np.searchsorted(self._ends, np.maximum(index, 1), side="left")
        left, steps = self._ends[part] - index, self._steps[part]
        begin, time = self._begin[part], self._time[part]
        t = begin + time * ((steps - left) / steps)
        # During a pause the position is that at its beginning.
        pausing = part % 2 == 0
        states = self._sampler.at(np.where(pausing, begin, t))
        _, position, velocity, acceleration, jerk, line, piece, u, *_ = states
        if self._origin is not None:
            position += self._origin[piece]
        stops = (left == 0) & (self._ends_at_rest | (index < self.count - 1))
        moving = ~(pausing | stops)[:, None]
        rates = (velocity * moving, acceleration * moving, jerk * moving)
        return SetpointChunk(t, position, *rates, line, self.axes, piece, u)

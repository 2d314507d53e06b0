"""State-to-state profiles along the path: optimises speed and acceleration where segments meet, with the
fastest motions between these states.

The segments are those of the S-curve, with its limits along the path: one acceleration for speeding up and
slowing down, by the smaller limit where those of an axis differ by direction. At first the acceleration is 0
where segments meet, and the speeds there are the greatest that look-ahead over the whole subrun allows. Then
speed and acceleration are improved at one joint after the other, forward and backward, with the fastest
motions to both neighbours, which the package ruckig finds: Berscheid and Kröger, "Jerk-limited real-time
trajectory generation with arbitrary target states" (2021). No step makes the profile slower, so it is at
least as fast as the S-curve.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from feedplan._solvers import PlanError, path_segments, profile_of_sections
from feedplan.arguments import number
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.errors import MissingPackageError
from feedplan.geometry.corners import Corners
from feedplan.lazy import cached_property
from feedplan.planners import s_curve
from feedplan.planners._faults import error_of
from feedplan.planners._jerk import jerk_limits
from feedplan.planners._runs import fastest_runs, within_both
from feedplan.profile import SpeedProfile

# Speed [mm/s] and acceleration [mm/s²] along the path.
State = tuple[float, float]
# A section of constant jerk: duration; position along the subrun, speed and acceleration at its start; jerk.
Section = tuple[float, float, float, float, float]

# The profile keeps the jerk limits; only where the curvature of the path jumps, its acceleration may jump.
LIMITS_JERK = True
CORNERS = Corners.SMOOTH
# The greatest number of rounds over all joints; steps are halved if a round saves less than the share GAIN of
# the time.
ROUNDS, GAIN = 24, 3e-4
# First and least step of speed and acceleration as shares of their limits. All steps are multiples of GRID,
# so that rounding does not decide between states.
STEP, LEAST_STEP, GRID = 0.25, 0.002, 2.0**-30
# The first speeds are reduced by the first of these shares for which all motions are found: the package
# ruckig misses some motions that are only just possible.
MARGINS = [2.0**-k for k in range(24, -1, -1)]
# A motion may exceed its limits by this share (rounding), and counts as faster than another one only by more
# than this share.
ROUNDING = 1e-9
# Number of bisections that find a reachable speed to the last digit.
HALVINGS = 60


@dataclass(frozen=True)
class Segment:
    """A part of the path: `length` [mm], greatest `speed`, `acceleration` and `jerk` along it."""

    length: float
    speed: float
    acceleration: float
    jerk: float

    def stands(self, speed: float, change: float) -> bool:
        """Whether, at the speed `speed`, an acceleration `change` can be built up from 0 or reduced to 0
        within the speed limits."""
        beyond = change * abs(change) / (2 * self.jerk)
        return 0 <= speed + beyond <= self.speed

    @cached_property
    def unit(self) -> float:
        """A unit of time [s] in which no limit is below 1, with the segment's length as the unit of length.

        The package ruckig treats very small numbers as 0.
        """
        by_acceleration, by_jerk = self.length / self.acceleration, self.length / self.jerk
        return max(self.length / self.speed, math.sqrt(by_acceleration), math.pow(by_jerk, 1 / 3))

    def highest(self, speed: float) -> float:
        """The greatest speed that can be reached from `speed`, with acceleration 0 at both ends."""

        def way(high: float) -> float:
            change = high - speed
            full = self.acceleration**2 / self.jerk
            if change <= full:
                duration = 2 * math.sqrt(change / self.jerk)
            else:
                duration = change / self.acceleration + self.acceleration / self.jerk
            return (speed + high) / 2 * duration

        low, high = speed, max(self.speed, speed)
        if way(high) <= self.length:
            return high
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            if way(middle) <= self.length:
                low = middle
            else:
                high = middle
        return low


@dataclass(frozen=True)
class Subrun:
    """Segments from rest to rest, and the greatest speeds (n + 1,) [mm/s] at their ends."""

    segments: list[Segment]
    speeds: list[float]

    def state(self, i: int, share: State) -> State:
        """Speed and acceleration at the start of segment i, from their shares of the limits there."""
        before, after = self.segments[i - 1], self.segments[i]
        return share[0] * self.speeds[i], share[1] * min(before.acceleration, after.acceleration)

    def first_shares(self, margin: float) -> list[State]:
        """The first states as shares of the limits: the greatest speeds that can be reached from each other
        with acceleration 0, reduced by the share `margin`."""
        v = list(self.speeds)
        for i, segment in enumerate(self.segments):
            v[i + 1] = min(v[i + 1], segment.highest(v[i]))
        for i, segment in reversed(list(enumerate(self.segments))):
            v[i] = min(v[i], segment.highest(v[i + 1]))
        parts = (speed / most if most > 0 else 0.0 for speed, most in zip(v, self.speeds, strict=True))
        return [(GRID * math.floor((1 - margin) * part / GRID), 0.0) for part in parts]


class Motions:
    """The fastest motions on segments between states at their ends."""

    def __init__(self) -> None:
        try:
            from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory
        except ImportError:
            raise MissingPackageError(
                "the method ruckig needs the package ruckig: `pip install ruckig`"
            ) from None
        self._generator, self._input, self._trajectory = Ruckig(1), InputParameter(1), Trajectory(1)
        self._done, self._fault = Result.Working, RuckigError
        self._input.current_position, self._input.target_position = [0.0], [1.0]

    def duration(self, segment: Segment, start: State, end: State) -> float:
        """The least time [s]; infinite where no motion keeps the limits."""
        if not (
            segment.stands(start[0], start[1]) and segment.stands(end[0], -end[1])
        ) or not self._calculate(segment, start, end):
            return math.inf
        profile = self._trajectory.profiles[0][0]
        v, a, j = profile.v, profile.a, profile.j
        speed = segment.speed * segment.unit / segment.length
        low, high = -ROUNDING * speed, (1 + ROUNDING) * speed
        for k in range(7):
            turns = a[k] * a[k + 1] < 0
            for met in (v[k + 1], v[k] - a[k] ** 2 / (2 * j[k]) if turns else v[k]):
                if not low <= met <= high:
                    return math.inf
        return segment.unit * float(self._trajectory.duration) if profile.brake.duration == 0 else math.inf

    def sections(self, segment: Segment, start: State, end: State, position: float) -> list[Section]:
        """The sections of a motion that is known to exist; the first begins at `position`."""
        self._calculate(segment, start, end)
        profile = self._trajectory.profiles[0][0]
        length, unit = segment.length, segment.unit
        return [
            (
                t * unit,
                position + p * length,
                max(v, 0.0) * length / unit,
                a * length / unit**2,
                j * length / unit**3,
            )
            for t, p, v, a, j in zip(profile.t, profile.p, profile.v, profile.a, profile.j, strict=False)
            if t > 0
        ]

    def _calculate(self, segment: Segment, start: State, end: State) -> bool:
        given = self._input
        speed, acceleration = segment.unit / segment.length, segment.unit**2 / segment.length
        given.current_velocity, given.current_acceleration = [speed * start[0]], [acceleration * start[1]]
        given.target_velocity, given.target_acceleration = [speed * end[0]], [acceleration * end[1]]
        given.max_velocity = [speed * segment.speed]
        given.max_acceleration = [acceleration * segment.acceleration]
        given.max_jerk = [segment.jerk * segment.unit**3 / segment.length]
        try:
            return bool(self._generator.calculate(given, self._trajectory) == self._done)
        except self._fault:
            return False


def plan(problem: Problem, *, time_limit: float | None = None) -> SpeedProfile:
    """The profile; after `time_limit` [s] the best one so far.

    Raises SolverError for an axis without a jerk limit, MissingPackageError.
    """
    if time_limit is not None:
        time_limit = number(time_limit, "the time limit", "0 or more", lambda limit: limit >= 0, "s")
        time_limit *= 1.0 if problem.even is problem else 0.5
    own = within_both(problem, lambda problem, _: _planned(problem, time_limit), None)
    return fastest_runs([own, s_curve.plan(problem)])


def _planned(problem: Problem, time_limit: float | None) -> SpeedProfile:
    motions = Motions()
    limits = jerk_limits(problem)
    deadline = math.inf if time_limit is None else time.perf_counter() + time_limit
    try:
        subruns = _subruns(problem, limits)
        found = [_improved(subrun, motions, deadline) for subrun in subruns]
        offsets = np.cumsum([0] + [len(sections) for sections in found])
        rows = np.array([section for sections in found for section in sections]).reshape(-1, 5)
        native = profile_of_sections(problem, limits, offsets, rows)
    except PlanError as fault:
        raise error_of(problem, fault) from None
    return SpeedProfile.of(native)


def _subruns(problem: Problem, limits: Floats) -> list[Subrun]:
    """The subruns of the path. Subruns that are left to the jerk-limited planner have no segments."""
    subruns = []
    for rows in path_segments(problem, limits, s_curve.CUTTINGS, s_curve.LOOK_AHEAD):
        speed, junction = rows[:, 1], rows[:, 4]
        ends = np.zeros(len(rows) + 1)
        ends[1:-1] = np.minimum(np.minimum(speed[:-1], speed[1:]), junction[:-1])
        subruns.append(Subrun([Segment(*row) for row in rows[:, :4].tolist()], ends.tolist()))
    return subruns


def _improved(subrun: Subrun, motions: Motions, deadline: float) -> list[Section]:
    """The sections of the fastest profile found; empty without segments, or if none is found."""
    segments, inner = subrun.segments, range(1, len(subrun.segments))
    for margin in MARGINS:
        shares = subrun.first_shares(margin)
        states = [(0.0, 0.0)] * len(shares)
        for i in inner:
            states[i] = subrun.state(i, shares[i])
        durations = [
            motions.duration(segment, *ends) for segment, ends in zip(segments, pairwise(states), strict=True)
        ]
        if math.isfinite(sum(durations)):
            break
    else:
        return []
    step = STEP
    for count in range(ROUNDS):
        before = sum(durations)
        for i in inner if count % 2 == 0 else reversed(inner):
            if time.perf_counter() >= deadline:
                break
            _improve(subrun, motions, shares, states, durations, i, step)
        if before - sum(durations) < GAIN * before:
            step /= 2
        if step < LEAST_STEP or time.perf_counter() >= deadline:
            break
    sections: list[Section] = []
    position = 0.0
    for segment, ends in zip(segments, pairwise(states), strict=True):
        sections += motions.sections(segment, *ends, position)
        position += segment.length
    return sections


def _improve(
    subrun: Subrun,
    motions: Motions,
    shares: list[State],
    states: list[State],
    durations: list[float],
    i: int,
    step: float,
) -> None:
    """Changes the state between segments i − 1 and i by the first step that makes both faster together."""
    before, after = subrun.segments[i - 1], subrun.segments[i]
    speed, acceleration = shares[i]
    for dv, da in ((1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1), (-1, 0)):
        share = min(max(speed + dv * step, 0.0), 1.0), min(max(acceleration + da * step, -1.0), 1.0)
        if share == shares[i]:
            continue
        state = subrun.state(i, share)
        most_time = (1 - ROUNDING) * (durations[i - 1] + durations[i])
        first = motions.duration(before, states[i - 1], state)
        if first >= most_time:
            continue
        second = motions.duration(after, state, states[i + 1])
        if first + second < most_time:
            shares[i], states[i], durations[i - 1], durations[i] = share, state, first, second
            return

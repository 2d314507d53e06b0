"""Computes setpoints at the servo period from a problem and its speed profile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import Sampler
from feedplan.arguments import is_whole, number, one_of, positive, shown
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.events import PlacedEvents, TimedEvents
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener
from feedplan.units import counted

Interpolator = Literal["sarfraz", "newton"]
INTERPOLATORS: tuple[Interpolator, ...] = get_args(Interpolator)

# The greatest number of setpoints in memory at once: with six axes they take 5 GB.
MAX_CHUNK = 20_000_000
# The greatest number of setpoints of a plan, unless the user allows more: a day at 1 kHz.
MAX_SETPOINTS = 100_000_000


@dataclass(frozen=True, eq=False)
class SetpointChunk:
    """Consecutive setpoints: `t` (n,) [s]; `position` [mm], `velocity` [mm/s], `acceleration` [mm/s²] and
    `jerk` [mm/s³], each (n, axes); `line` (n,) source line; `axes` names.

    `piece` (n,) and `u` (n,) are the places on the path; they are empty if unknown.
    """

    t: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    line: NDArray[np.int32]
    axes: tuple[str, ...]
    piece: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    u: Floats = field(default_factory=lambda: np.empty(0))

    def __len__(self) -> int:
        return len(self.t)

    def part(self, rows: slice, axes: Sequence[str]) -> SetpointChunk:
        """Some rows with the given axes, without their places on the path."""
        columns = [self.axes.index(name) for name in axes]
        names = ("position", "velocity", "acceleration", "jerk")
        of_axes = {name: np.asarray(getattr(self, name)[rows][:, columns]) for name in names}
        t, line = np.asarray(self.t[rows]), np.asarray(self.line[rows])
        return SetpointChunk(t=t, **of_axes, line=line, axes=tuple(axes))

    def __repr__(self) -> str:
        span = f", {self.t[0]:.6g} to {self.t[-1]:.6g} s" if len(self) else ""
        return f"<SetpointChunk of {counted(len(self), 'setpoint')} of {' '.join(self.axes)}{span}>"


@dataclass(frozen=True)
class SamplingStats:
    """The worst of all setpoints computed so far: the number of `iterations` of the interpolator (0: only
    closed forms) and the `length_error` as a share of a step, including the proven error of the length table.
    """

    iterations: int = 0
    length_error: float = 0.0


# A function that takes setpoints chunk by chunk.
Sink = Callable[[SetpointChunk], None]


class Setpoints:
    """Setpoints of the joints at every `period` [s] along a problem's path, by its profile, computed when
    they are read; iterating gives chunks.

    Setpoint 0 is the start of the path. A pause D before the first run takes ceil(D/period) periods there. A
    run with time T and pause D takes ceil((T + D)/period) periods: each stop is reached exactly and the
    stream waits less than one period there, so `duration` [s], the time of the last of `count` setpoints, is
    a little longer than the plan's time. A path that ends in motion ends at its true time, after a shorter
    last step. At a stop velocity, acceleration and jerk are 0; at a switch, where the acceleration jumps, a
    setpoint has the values of the phase that begins there. `computing` [s] is the computing time of the
    setpoints so far, `passing` [s] the time of the sinks that they were passed to.

    The `interpolator` "sarfraz" finds the place from the displacement of an axis where that axis moves at
    constant acceleration or speed, in closed form on quadratic pieces; elsewhere from a table of length or
    time, with Sarfraz's predictor and corrector. Where the jerk along the path is constant, the length at a
    time is known in closed form. "newton" takes steps of speed × period, to third order, and Newton–Raphson
    steps. Pieces may have any degree, polynomial or rational.

    `progress` is called with the finished share of computing the times; `events` are those of the plan
    (`feedplan.event_places`). Raises InputError for a period or an interpolator that cannot be used, a
    profile of another path, or more setpoints than `max_setpoints`.
    """

    def __init__(
        self,
        problem: Problem,
        profile: SpeedProfile,
        period: float,
        interpolator: Interpolator = "sarfraz",
        max_setpoints: int = MAX_SETPOINTS,
        progress: Listener | None = None,
        events: Callable[[Sampler], PlacedEvents] | None = None,
    ) -> None:
        one_of(interpolator, "interpolator", INTERPOLATORS)
        period = number(period, "the period", "a positive number", positive, "s")
        self._sampler = (
            profile.sampler(problem, progress)
            if period == problem.period
            else Sampler(problem, profile, period, progress)
        )
        self._source = (problem, profile, period, interpolator, max_setpoints, None, events)
        self._events = events
        if self.count > max_setpoints:
            raise InputError(
                f"{self.count} setpoints, one every {period:g} s, are more than {max_setpoints}: "
                "choose a longer period, or ask for so many by max_setpoints"
            )
        self.period = period
        self.axes = problem.axes
        self.interpolator: Interpolator = interpolator
        self.stats = SamplingStats()
        self.computing = self.passing = 0.0
        self._origin = problem.joint_origin
        self._sinks: tuple[Sink, ...] = ()

    @property
    def count(self) -> int:
        """Number of setpoints, including the start of the path."""
        return self._sampler.count

    @property
    def duration(self) -> float:
        """Time of the last setpoint [s]."""
        return self._sampler.duration

    @property
    def events(self) -> TimedEvents:
        """The events of the plan, on the clock of these setpoints.

        An event at a stop comes before the wait for a whole period: the first setpoint at or after its time
        rests at the place of the stop; both hold up to rounding.
        """
        if self._events is None:
            return TimedEvents.none()
        return self._events(self._sampler).on(self.run_starts)

    @property
    def run_starts(self) -> Floats:
        """The start time of each run between stops (runs,) [s]."""
        return self._sampler.runs[:, 1]

    def __len__(self) -> int:
        return self.count

    def __iter__(self) -> Iterator[SetpointChunk]:
        return self.chunks()

    def __repr__(self) -> str:
        return f"<Setpoints: {self.count} of {' '.join(self.axes)}, one every {self.period:g} s>"

    def __reduce__(self) -> tuple[type[Setpoints], tuple[object, ...]]:
        return Setpoints, self._source

    def chunks(self, size: int = 100_000) -> Iterator[SetpointChunk]:
        """The stream in chunks of `size` setpoints, the last one shorter: memory does not grow with the
        length of the stream.

        The setpoints do not depend on the size. Raises InputError for a size out of range.
        """
        return chunks(self._passed, self.count, size)

    def teed(self, sinks: Sequence[Sink]) -> Setpoints:
        """The same stream; chunks that are read by `chunks` are also passed to `sinks`."""
        other = object.__new__(Setpoints)
        vars(other).update(vars(self), _sinks=(*self._sinks, *sinks))
        return other

    def around(self, t: float) -> SetpointChunk:
        """The setpoints next to a time [s]: the last one at or before it, and the next one."""
        before = min(max(int(t / self.period), 0), self.count - 1)
        return self._chunk(before, min(before + 2, self.count))

    def _passed(self, start: int, stop: int) -> SetpointChunk:
        chunk = self._chunk(start, stop)
        begin = time.perf_counter()
        for sink in self._sinks:
            sink(chunk)
        self.passing += time.perf_counter() - begin
        return chunk

    def all(self) -> SetpointChunk:
        """The whole stream at once. Raises InputError if it is too long."""
        if self.count > MAX_CHUNK:
            raise InputError(f"{self.count} setpoints are too many to hold at once: read them by chunks()")
        return self._chunk(0, self.count)

    def _chunk(self, start: int, stop: int) -> SetpointChunk:
        begin = time.perf_counter()
        t, position, velocity, acceleration, jerk, line, piece, u, iterations, error = self._sampler.chunk(
            start, stop, self.interpolator == "newton"
        )
        self.stats = SamplingStats(
            max(self.stats.iterations, iterations), max(self.stats.length_error, error)
        )
        if self._origin is not None:
            position += self._origin[piece]
        self.computing += time.perf_counter() - begin
        return SetpointChunk(t, position, velocity, acceleration, jerk, line, self.axes, piece, u)


def chunks(chunk: Callable[[int, int], SetpointChunk], count: int, size: int) -> Iterator[SetpointChunk]:
    """`count` rows in chunks of `size`; `chunk` makes each from its first row and the row after its last.

    Raises InputError for a size out of range.
    """
    if not is_whole(size, most=MAX_CHUNK):
        raise InputError(f"chunks of {shown(size)} setpoints: give a size from 1 to {MAX_CHUNK}")
    return (chunk(start, min(start + size, count)) for start in range(0, count, size))

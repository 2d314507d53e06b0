"""A plan as functions of time and of length, computed exactly from its profile's phases, not setpoints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan.array_arguments import within
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem, speed_square
from feedplan.curves.length import CurveLength
from feedplan.lazy import cached_property
from feedplan.profile import SpeedProfile


@dataclass(frozen=True, eq=False)
class State:
    """The motion at times `t` [s]: `position` [mm, deg], `velocity`, `acceleration` and `jerk` of the axes,
    and the source `line`. For one time the first four are (axes,) and `line` is a number; for (n,) times they
    are (n, axes) and (n,)."""

    t: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    line: NDArray[np.int32]


class Trajectory:
    """A profile on its path, on the plan's own clock: with pauses, but without waits for whole periods.

    Lengths `s` are measured along the path from its start, in its `unit` (mm, or that of the joints).
    """

    def __init__(self, problem: Problem, profile: SpeedProfile) -> None:
        self._problem, self._profile = problem, profile
        self.sampler = profile.sampler(problem)
        self.axes, self.unit = problem.axes, problem.unit
        self.duration = profile.time + problem.path.pauses

    def __repr__(self) -> str:
        return f"<Trajectory of {' '.join(self.axes)}: {self.duration:.6g} s>"

    def __reduce__(self) -> tuple[type[Trajectory], tuple[Problem, SpeedProfile]]:
        return Trajectory, (self._problem, self._profile)

    @cached_property
    def _lengths(self) -> CurveLength:
        curve = self._problem.tip_curve
        return self._problem.path.lengths if curve is None else CurveLength(curve)

    @property
    def length(self) -> float:
        """Length of the tool's path [mm]."""
        return self._lengths.total

    def at(self, t: ArrayLike) -> State:
        """The state at one time or at times (n,) [s].

        At a stop the tool rests; where the acceleration jumps, the values after the jump are given.
        """
        times = within(t, "time", self.duration, "s")
        _, position, velocity, acceleration, jerk, line, piece, *_ = self.sampler.at(np.atleast_1d(times))
        if self._problem.joint_origin is not None:
            position += self._problem.joint_origin[piece]
        row = 0 if times.ndim == 0 else slice(None)
        return State(times, position[row], velocity[row], acceleration[row], jerk[row], line[row])

    def distance(self, t: ArrayLike) -> Floats:
        """s(t): the length along the path [mm] at one time or at times (n,) [s]. Raises as `at`."""
        times = within(t, "time", self.duration, "s")
        piece, u = self.sampler.at(np.atleast_1d(times))[6:8]
        return self._lengths.length(piece, u).reshape(times.shape)

    def time(self, s: ArrayLike) -> Floats:
        """t(s): the time at which the tool is at one length or at lengths (n,) [mm]; at a stop the time
        before the pause [s].

        Raises InputError for a length that is not on the path.
        """
        lengths = within(s, "length", self.length, self._problem.unit)
        return self.sampler.along(*self._lengths.locate(np.atleast_1d(lengths)))[0].reshape(lengths.shape)

    def speed(self, s: ArrayLike) -> Floats:
        """v(s): the speed of the tool [mm/s] at one length or at lengths (n,) [mm]. Raises as `time`."""
        lengths = within(s, "length", self.length, self._problem.unit)
        piece, u = self._lengths.locate(np.atleast_1d(lengths))
        velocity = self.sampler.along(piece, u)[2]
        speed = np.linalg.norm(velocity, axis=1)
        if self._problem.joints is not None:
            # Converts the joints' speed to the tool's: the ratio of their squares is the same for all u̇.
            joints = self._problem.curve.evaluate(piece, u, 1)[1]
            ratio = speed_square(self._problem, piece, u) / (joints**2).sum(axis=1)
            speed = speed * np.sqrt(ratio)
        return np.asarray(speed.reshape(lengths.shape))

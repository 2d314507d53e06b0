"""The planning problem: a path with every limit that holds on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.feed import feed_limit
from feedplan.constraints.junction import junction_limit
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.machine.words import AxisWords


@dataclass(frozen=True)
class TipSpeed:
    """|C'|² of the tool tip as a polynomial of u on each piece: Bernstein `coefficients` (total,), those of
    piece i from `offsets[i]` to `offsets[i + 1]`."""

    coefficients: NDArray[np.float64]
    offsets: NDArray[np.int64]


@dataclass(frozen=True)
class Problem:
    """Minimise the time along `path` under these limits.

    Where the path's axes are not the joints of the machine, `joints` is the motion of the joints [mm, deg],
    one piece for each of the path and over the same parameter; `tip_speed` the square of the speed that the
    feed is about, per u̇²; and `words` (one a run) the kinematics from the path to the joints. Per joint,
    `axes` names them: `max_velocity` [mm/s], `max_acceleration` [mm/s²], `max_jerk` [mm/s³] (may be
    infinite). Per piece: `feed` (n,) greatest speed [mm/s], finite. At piece ends: `junction_speed` (n + 1,)
    greatest speed [mm/s]: 0 at a stop, infinite where nothing but the other limits holds. `chord_tolerance`
    [mm] and `period` [s] limit the speed on a curve of radius ρ to (2/T)·√(2ρδ − δ²); an infinite tolerance
    switches that off. `start_speed` and `end_speed` [mm/s] hold at the two ends of the path.
    """

    path: Path
    max_velocity: NDArray[np.float64]
    max_acceleration: NDArray[np.float64]
    max_jerk: NDArray[np.float64]
    feed: NDArray[np.float64]
    junction_speed: NDArray[np.float64]
    chord_tolerance: float
    period: float
    start_speed: float = 0.0
    end_speed: float = 0.0
    joint_axes: tuple[str, ...] = ()
    joints: CompositeCurve | None = None
    tip_speed: TipSpeed | None = None
    words: tuple[AxisWords, ...] = ()

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the joints that the limits belong to."""
        return self.joint_axes or self.path.axes

    @property
    def curve(self) -> CompositeCurve:
        """The motion of the joints."""
        return self.path.curve if self.joints is None else self.joints


def build_problem(
    path: Path,
    machine: Machine,
    *,
    feed: float | None = None,
    feed_override: float = 1.0,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
) -> Problem:
    """The path on the machine.

    `feed` [mm/s] replaces the programmed feeds, `feed_override` multiplies them (rapids keep the axes'
    limits), `start_speed` and `end_speed` [mm/s] hold at the ends of the whole path.
    Raises InputError for a value out of range.
    """
    for name, value in (("start speed", start_speed), ("end speed", end_speed)):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"{name} is {value} mm/s: give a finite speed of 0 or more")
    axes = [machine.axis(name) for name in path.axes]
    max_velocity = np.array([axis.max_velocity for axis in axes])
    junction_speed = junction_limit(path, np.array([axis.max_velocity_jump for axis in axes]))
    junction_speed[0], junction_speed[-1] = start_speed, end_speed
    return Problem(
        path=path,
        max_velocity=max_velocity,
        max_acceleration=np.array([axis.max_acceleration for axis in axes]),
        max_jerk=np.array([axis.max_jerk for axis in axes]),
        feed=feed_limit(path, max_velocity, feed, feed_override),
        junction_speed=junction_speed,
        chord_tolerance=machine.chord_tolerance,
        period=machine.period,
        start_speed=start_speed,
        end_speed=end_speed,
    )

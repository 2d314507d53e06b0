"""Machines with limits at the ends of the accepted ranges, and programs for them."""

from __future__ import annotations

import math
import random

from feedplan import Axis, Machine
from feedplan.machine.axis import GREATEST_ACCELERATION
from feedplan.machine.machine import CHORD_TOLERANCES, LEAST_CHORD_SHARE, LEAST_PERIOD_SHARE, PERIODS

# Ranges of machines that exist; feedplan accepts some more, where a limit has no effect.
VELOCITIES, MOST_TIMES = (1e-5, 1e7), 1e6
RISE_TIMES, JERK_TIMES, LEAST_JERK_SHARE, LEAST_WAY = (1e-5, 1e2), (1e-5, 1e2), 1e-5, 1e-9
# Keeps products of rounded numbers inside the ranges.
_INSIDE = 1.0 + 1e-9

PROGRAMS = {
    "lines": "G21 G90 F3000\nG1 X10 Y5\nX0\nX3 Y4 Z1\nG0 X0 Y0 Z0\nG1 X0.01\nX0.02 Y0.001\nX5\nM2\n",
    "arcs": "G21 G90 F3000 G64 P0.02\nG1 X10\nG2 X20 Y10 I0 J10\nG3 X20.5 Y9 R2\nG2 X20.5 Y9 I1 J0\n"
    "G1 X0 Y0\nM2\n",
    "short": "G21 G90 F3000 G64 P0.02\n"
    + "".join(f"G1 X{0.1 * i:.3f} Y{0.04 * (7 * i % 5):.3f}\n" for i in range(1, 30))
    + "M2\n",
}


def extreme_machine(seed: int) -> Machine:
    """A machine with values at or between the ends of the ranges; for odd seeds each axis has its own."""
    draw = random.Random(seed)
    speeds = [draw.choice((VELOCITIES[0], 0.01, 250.0, VELOCITIES[1])) for _ in "XYZ"]
    speeds = [max(speed, max(speeds) / MOST_TIMES * _INSIDE) for speed in speeds]
    first = _axis(draw, "X", speeds[0])
    own = seed % 2 == 1
    others = zip("YZ", speeds[1:], strict=True)
    axes = [first, *(_axis(draw, name, speed) if own else _like(first, name) for name, speed in others)]
    rise = max(axis.max_velocity / axis.max_acceleration for axis in axes)
    period = max(draw.choice((PERIODS[0], 1e-3, 0.05, PERIODS[1])), LEAST_PERIOD_SHARE * rise * _INSIDE)
    greatest = max(axis.max_acceleration for axis in axes)
    least = max(LEAST_CHORD_SHARE / 8.0 * greatest * period**2 * _INSIDE, CHORD_TOLERANCES[0])
    chord = draw.choice((least, max(least, 0.05), max(least, CHORD_TOLERANCES[1]), math.inf))
    chord = chord if chord <= CHORD_TOLERANCES[1] else math.inf
    return Machine(f"extreme {seed}", tuple(axes), period=period, chord_tolerance=chord)


def _axis(draw: random.Random, name: str, velocity: float) -> Axis:
    rise = draw.choice((RISE_TIMES[0] * _INSIDE, 0.1, RISE_TIMES[1] / _INSIDE))
    rise = max(rise, velocity / GREATEST_ACCELERATION, LEAST_WAY / velocity * _INSIDE)
    acceleration = velocity / rise
    shortest = max(JERK_TIMES[0], LEAST_JERK_SHARE * rise, math.sqrt(LEAST_WAY / acceleration)) * _INSIDE
    jerk = acceleration / draw.choice((shortest, max(shortest, 0.05), JERK_TIMES[1] / _INSIDE))
    jump = draw.choice((0.0, 0.1, 1.0)) * velocity
    return Axis(name, velocity, acceleration, jerk, max_velocity_jump=jump)


def _like(axis: Axis, name: str) -> Axis:
    limits = (axis.max_velocity, axis.max_acceleration, axis.max_jerk)
    return Axis(name, *limits, max_velocity_jump=axis.max_velocity_jump)

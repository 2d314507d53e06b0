"""Machines whose limits differ by direction, and paths for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis, Limit, range_of, size_of
from feedplan.machine.machine import Machine

Pair = tuple[float, float]
KNOTS = [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4]
JERK = 80.0


def names_of(count: int) -> tuple[str, ...]:
    return tuple(f"j{k + 1}" for k in range(count))


def arm(velocity: list[Pair], acceleration: list[Pair]) -> Machine:
    rows = zip(names_of(len(velocity)), velocity, acceleration, strict=True)
    return Machine("arm", tuple(Axis(*row, JERK) for row in rows), period=0.002)


def pairs(rng: np.random.Generator, count: int, most: float) -> list[Pair]:
    """Random limits (negative, positive); most differ by direction, by up to ten times."""
    sides = most * 10.0 ** rng.uniform(-1.0, 0.0, (count, 2))
    even = rng.random(count) < 0.2
    return [(-float(a), float(a if same else b)) for (a, b), same in zip(sides, even, strict=True)]


def random_path(rng: np.random.Generator, count: int, kind: str) -> Path:
    points = rng.standard_normal((7, count))
    if kind == "lines":
        return Path.from_points(points, 0.0, axes=names_of(count))
    if kind == "rounded":
        return Path.from_points(points, 0.05, axes=names_of(count))
    if kind == "rational":
        weights = rng.uniform(0.4, 2.0, 7)
        return Path.from_nurbs(points, KNOTS, 3, weights, axes=names_of(count))
    return Path.from_bspline(points, KNOTS, 3, axes=names_of(count))


def with_sides(machine: Machine, rng: np.random.Generator) -> Machine:
    """The machine with each limit reduced in each direction, at most to a fifth."""

    def parts(limit: Limit) -> Pair:
        least, most = range_of(limit)
        low, high = 10.0 ** rng.uniform(-0.7, 0.0, 2)
        return float(low * least), float(high * most)

    return _changed(machine, parts)


def even(machine: Machine) -> Machine:
    """The machine with the lesser of both directions' limits in both directions."""
    return _changed(machine, size_of)


def swapped(machine: Machine) -> Machine:
    """The machine with the limits of both directions exchanged."""

    def turned(limit: Limit) -> Pair:
        least, most = range_of(limit)
        return -most, -least

    return _changed(machine, turned)


def _changed(machine: Machine, limit: Callable[[Limit], Limit]) -> Machine:
    axes = (
        replace(axis, max_velocity=limit(axis.max_velocity), max_acceleration=limit(axis.max_acceleration))
        for axis in machine.axes
    )
    return replace(machine, axes=tuple(axes))

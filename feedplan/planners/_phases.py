"""Computes from p at the stations the phases between them, their use of limits, and the profile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Flags, Floats
from feedplan.constraints.problem import Problem
from feedplan.planners._mesh import EVEN, INTEGRATION, PLACES, TAIL, Mesh
from feedplan.profile import NO_AXIS, OF_PHASES, PhaseLaw, SpeedProfile

# A joint may be chosen for a phase of constant joint acceleration only if its |q'| varies by less than this
# factor in the cell,
_VARIES = 1e3
# and if it exceeds this share of the greatest |q'| of all joints: then the relative rounding error of q',
# from which the duration is computed, is below 1e-9.
_MOVES = 1e-6


@dataclass(frozen=True)
class Phases:
    """One phase for each cell: `kind`, `axis`, `value`, p at both `ends` (2, n) and `duration` (n,) [s].

    `acceleration` (n, joints) and `speed` (n,) are upper bounds of the use of the acceleration limits and of
    the squared use of the speed limits. `used` (n,) is the mean over the cell of the greatest use at each
    place.
    """

    kind: NDArray[np.uint8]
    axis: NDArray[np.uint8]
    value: Floats
    ends: Floats
    duration: Floats
    acceleration: Floats
    speed: Floats
    used: Floats

    @property
    def worst(self) -> Floats:
        """Divisor of p that keeps every limit in each cell (n,); at most 1 if the limits hold already."""
        return np.asarray(np.maximum(self.acceleration.max(axis=1), self.speed))

    @property
    def feasible_time(self) -> float:
        """The duration if the greatest factor `worst` scaled all p down [s]."""
        return float(self.duration.sum()) * math.sqrt(max(float(self.worst.max()), 1.0))

    def scaled(self, factor: float) -> Phases:
        """These phases with p multiplied by a factor."""
        return Phases(
            self.kind,
            self.axis,
            self.value * factor,
            self.ends * factor,
            self.duration / np.sqrt(factor),
            self.acceleration * factor,
            self.speed * factor,
            self.used * factor,
        )


def phases_between(problem: Problem, mesh: Mesh, p: Floats, by_axis: bool) -> Phases:
    """The phases through p at the stations (n + 1,): with p linear in u, or with constant acceleration of one
    joint.

    If `by_axis` is true, each cell takes the phase with the least greatest use of a limit; else p is linear
    in u in all cells.
    """
    start, end = mesh.gain * p[:-1], p[1:]
    own = start + (end - start) * PLACES[:, None]
    s = (end - start) / (2.0 * mesh.width)
    motion = _Motion(own, np.broadcast_to(s, own.shape))
    worst = motion.worst(problem, mesh)
    kind = np.full(len(mesh), PhaseLaw.PARAMETER_ACCELERATION, np.uint8)
    axis = np.full(len(mesh), NO_AXIS, np.uint8)
    value, duration = s.copy(), 2.0 * mesh.width / (np.sqrt(start) + np.sqrt(end))
    least = _MOVES * np.abs(mesh.slope).max(axis=(0, 2))
    for k in range(len(problem.axes)):
        slope, way = mesh.slope[:, :, k], mesh.way[:, :, k]
        size = np.abs(slope)
        steady = (slope * np.sign(way[-1]) > 0.0).all(axis=0) & by_axis
        steady &= (size.max(axis=0) < _VARIES * size.min(axis=0)) & (size.min(axis=0) > least)
        if not steady.any():
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            change = slope[-1] ** 2 * end - slope[0] ** 2 * start
            a = change / (2.0 * way[-1])
            own = (slope[0] ** 2 * start + change * (way / way[-1])) / slope**2
            own[0], own[-1] = start, end
            other = _Motion(own, (a - mesh.bend[:, :, k] * own) / slope)
            others = other.worst(problem, mesh)
            better = steady & (others < worst)
            time = 2.0 * np.abs(way[-1]) / (size[0] * np.sqrt(start) + size[-1] * np.sqrt(end))
        motion, worst = motion.where(better, other), np.where(better, others, worst)
        kind[better], axis[better] = PhaseLaw.AXIS_ACCELERATION, k
        value, duration = np.where(better, a, value), np.where(better, time, duration)
    ends = np.stack([start, end])
    acceleration, speed = motion.acceleration(mesh), motion.speed(mesh)
    used = np.maximum(problem.use("acceleration", acceleration).max(axis=2), speed.max(axis=2))
    # Each direction separately, because the use of a limit has a kink where the acceleration changes sign.
    peaks = [_peak(acceleration / limit) for limit in (problem.max_acceleration, problem.min_acceleration)]
    return Phases(
        kind,
        axis,
        value,
        ends,
        duration,
        np.maximum(*peaks),
        _peak(speed).max(axis=1),
        INTEGRATION[-1] @ np.minimum(used, 1.0),
    )


def _peak(values: Floats) -> Floats:
    """The greatest value in each cell (n, …), estimated from values at the places (places, n, …).

    It is the greatest value at the places or of parabolas through equally spaced places, plus an error
    estimate from the last two Legendre coefficients.
    """
    even = np.einsum("ij,jck->ick", EVEN, values)
    bent = np.abs(even[2:] - 2.0 * even[1:-1] + even[:-2]) / 8.0
    inside = (even[1:-1] + bent).max(axis=0)
    tail = np.abs(np.einsum("ij,jck->ick", TAIL, values)).sum(axis=0)
    return np.asarray(np.maximum(inside, values.max(axis=0)) + tail)


@dataclass(frozen=True)
class _Motion:
    """p and s of phases at the places of their cells (places, n)."""

    p: Floats
    s: Floats

    def acceleration(self, mesh: Mesh) -> Floats:
        """The acceleration of every joint (places, n, joints)."""
        return mesh.slope * self.s[..., None] + mesh.bend * self.p[..., None]

    def speed(self, mesh: Mesh) -> Floats:
        """The squared use of every speed limit (places, n, limits)."""
        return np.asarray(mesh.speed * self.p[..., None])

    def worst(self, problem: Problem, mesh: Mesh) -> Floats:
        """The greatest use of any limit at the places of each cell (n,)."""
        acceleration = problem.use("acceleration", self.acceleration(mesh)).max(axis=(0, 2))
        return np.asarray(np.maximum(acceleration, self.speed(mesh).max(axis=(0, 2))))

    def where(self, better: Flags, other: _Motion) -> _Motion:
        return _Motion(np.where(better, other.p, self.p), np.where(better, other.s, self.s))


def profile(parts: list[tuple[Mesh, Phases]], runs: list[int]) -> SpeedProfile:
    """The phases of all subruns as one profile; `runs` are the offsets of the runs in the phases."""
    rows = (
        (mesh.piece, phases.kind, phases.axis, phases.value, *mesh.ends, *phases.ends, phases.duration)
        for mesh, phases in parts
    )
    columns: list[Any] = [np.concatenate(column) for column in zip(*rows, strict=True)]
    return SpeedProfile(**dict(zip(OF_PHASES, columns, strict=False)), runs=np.array(runs))

"""The arcs between the stations of a mesh: from p in the stations to a profile and its use of every limit."""

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

# The joint of an arc of constant joint acceleration has a q' that varies by at most this factor.
_VARIES = 1e3
# Its q' is at least this part of the greatest of all joints: of such a q' less than 1e-9 is rounding, and the
# duration follows from it.
_MOVES = 1e-6


@dataclass(frozen=True)
class Arcs:
    """One arc a cell: `kind`, `axis`, `value`, p at both `ends` (2, n) and `duration` (n,).

    `acceleration` (n, joints) and `speed` (n,) are upper bounds of the used shares of limits, that of the
    speed squared. `used` (n,) is the mean over the cell of the greatest used share at each place.
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
        """By how much p must fall to keep every limit of a cell (n,)."""
        return np.asarray(np.maximum(self.acceleration.max(axis=1), self.speed))

    @property
    def feasible_time(self) -> float:
        """The time if p were scaled so far [s]."""
        return float(self.duration.sum()) * math.sqrt(max(float(self.worst.max()), 1.0))

    def scaled(self, factor: float) -> Arcs:
        """The same with p times a factor."""
        return Arcs(
            self.kind,
            self.axis,
            self.value * factor,
            self.ends * factor,
            self.duration / np.sqrt(factor),
            self.acceleration * factor,
            self.speed * factor,
            self.used * factor,
        )


def arcs_between(problem: Problem, mesh: Mesh, p: Floats, by_axis: bool) -> Arcs:
    """The arcs through p in the stations (n + 1,): p linear in u, or one joint's acceleration constant.

    Where `by_axis` allows it, of all such arcs of a cell the one that uses the limits least is taken.
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
    # Each direction by itself, because the used share of a limit has a kink where the sign changes.
    peaks = [_peak(acceleration / limit) for limit in (problem.max_acceleration, problem.min_acceleration)]
    return Arcs(
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
    """The greatest values in the cells (n, …), from values at the places (places, n, …).

    It is that of parabolas through even places, and an estimate of the error between the places.
    """
    even = np.einsum("ij,jck->ick", EVEN, values)
    bent = np.abs(even[2:] - 2.0 * even[1:-1] + even[:-2]) / 8.0
    inside = (even[1:-1] + bent).max(axis=0)
    tail = np.abs(np.einsum("ij,jck->ick", TAIL, values)).sum(axis=0)
    return np.asarray(np.maximum(inside, values.max(axis=0)) + tail)


@dataclass(frozen=True)
class _Motion:
    """p and s of arcs at the places of their cells (places, n)."""

    p: Floats
    s: Floats

    def acceleration(self, mesh: Mesh) -> Floats:
        """The acceleration of every joint (places, n, joints)."""
        return mesh.slope * self.s[..., None] + mesh.bend * self.p[..., None]

    def speed(self, mesh: Mesh) -> Floats:
        """The share of every limit of a speed, squared (places, n, limits)."""
        return np.asarray(mesh.speed * self.p[..., None])

    def worst(self, problem: Problem, mesh: Mesh) -> Floats:
        """The greatest of all at the places (n,)."""
        acceleration = problem.use("acceleration", self.acceleration(mesh)).max(axis=(0, 2))
        return np.asarray(np.maximum(acceleration, self.speed(mesh).max(axis=(0, 2))))

    def where(self, better: Flags, other: _Motion) -> _Motion:
        return _Motion(np.where(better, other.p, self.p), np.where(better, other.s, self.s))


def profile(parts: list[tuple[Mesh, Arcs]], runs: list[int]) -> SpeedProfile:
    """The arcs of all subruns as one profile; `runs` are the arcs' offsets of the runs."""
    rows = (
        (mesh.piece, arcs.kind, arcs.axis, arcs.value, *mesh.ends, *arcs.ends, arcs.duration)
        for mesh, arcs in parts
    )
    columns: list[Any] = [np.concatenate(column) for column in zip(*rows, strict=True)]
    return SpeedProfile(**dict(zip(OF_PHASES, columns, strict=False)), runs=np.array(runs))

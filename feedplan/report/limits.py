"""Speed and the limits on it over the path's length: the velocity limit curve and the caps.

Written from the definitions, not from the planner's code: q = C(u) per axis, ' is d/du, p = (du/dt)².
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from feedplan.audit.joint_along import constant_jerk, cubic
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.profile import ArcKind, SpeedProfile

Floats = NDArray[np.float64]

_SAMPLES = 400_000
_SAMPLES_AT_ONCE = 100_000
_SAMPLES_PER_ARC = 33
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class LimitSamples:
    """Samples in the order of the path: `length` [mm], and speeds [mm/s], infinite where nothing limits.

    `speed` is planned; `acceleration` the velocity limit curve of the axis accelerations; `feed`; `velocity`
    of the axes; `chord`, from the chord error between two setpoints. `arc` is the arc of each sample.
    """

    length: Floats
    speed: Floats
    acceleration: Floats
    feed: Floats
    velocity: Floats
    chord: Floats
    arc: NDArray[np.int64]


def samples_per_arc(profile: SpeedProfile) -> int:
    """How many samples `limit_samples` takes on each arc, both ends among them."""
    return int(np.clip(_SAMPLES // max(len(profile), 1), 2, _SAMPLES_PER_ARC))


def limit_samples(problem: Problem, profile: SpeedProfile) -> Iterator[LimitSamples]:
    """Samples of every arc, a block of arcs at a time. Length is measured through all axes."""
    count = samples_per_arc(profile)
    # Denser towards both ends, where speed changes most on the way from and to a stop.
    fraction = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
    step = max(1, _SAMPLES_AT_ONCE // count)
    start = 0.0
    for first in range(0, len(profile), step):
        arcs = np.arange(first, min(first + step, len(profile)))
        block = _sample(problem, profile, arcs, fraction, start)
        start = float(block.length[-1])
        yield block


def arc_lengths(problem: Problem, profile: SpeedProfile) -> Floats:
    """The length of each arc [mm], shape (arcs,)."""
    parts = [
        _lengths(problem, profile, np.arange(first, min(first + _SAMPLES_AT_ONCE, len(profile))))
        for first in range(0, len(profile), _SAMPLES_AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.empty(0)


def least_times(problem: Problem, profile: SpeedProfile) -> Floats:
    """The time of each arc if only its feed and the axis velocities held [s], shape (arcs,)."""
    piece = profile.piece.astype(np.int64)
    (start,), (end,) = (problem.curve.evaluate(piece, u) for u in (profile.u0, profile.u1))
    at_velocity = (np.abs(end - start) / problem.max_velocity).max(axis=1, initial=0.0)
    return np.asarray(np.maximum(arc_lengths(problem, profile) / problem.feed[piece], at_velocity))


def _lengths(problem: Problem, profile: SpeedProfile, arcs: NDArray[np.int64]) -> Floats:
    return _integral(problem, profile.piece[arcs].astype(np.int64), profile.u0[arcs], profile.u1[arcs])


def _integral(problem: Problem, piece: NDArray[np.int64], u0: Floats, u1: Floats) -> Floats:
    """Length between two parameters of a piece by Gauss–Legendre with eight nodes."""
    curve = problem.tip_curve or problem.curve
    total = np.zeros(len(piece))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        u = np.minimum(u0 + 0.5 * (1.0 + node) * (u1 - u0), u1)
        total += weight * np.linalg.norm(curve.evaluate(piece, u, 1)[1], axis=1)
    return np.asarray(0.5 * (u1 - u0) * total)


def _sample(
    problem: Problem, profile: SpeedProfile, arcs: NDArray[np.int64], fraction: Floats, start: float
) -> LimitSamples:
    count = len(fraction)
    u0, u1 = profile.u0[arcs], profile.u1[arcs]
    # The last sample is the end itself: u0 + 1·(u1 − u0) may miss it by a rounding.
    u = u0[:, None] * (1.0 - fraction) + u1[:, None] * fraction
    u = np.clip(u, u0[:, None], u1[:, None]).ravel()
    arc = np.repeat(arcs, count)
    piece = profile.piece[arc].astype(np.int64)
    place, tangent, second = problem.curve.evaluate(piece, u, 2)
    tip = problem.tip_curve
    rate = np.linalg.norm(tangent if tip is None else tip.evaluate(piece, u, 1)[1], axis=1)
    before = np.concatenate((u[:1], u[:-1]))
    before[::count] = u[::count]
    within = np.cumsum(_integral(problem, piece, before, u).reshape(-1, count), axis=1)
    # Arc by arc, so that rounding does not add up over the samples.
    length = (start + np.cumsum(within[:, -1]) - within[:, -1])[:, None] + within
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        p = _profile_at(problem.curve, profile, arc, u, place, tangent, rate)
        line = np.flatnonzero(profile.kind[arc] == ArcKind.SPEED_LINE)
        p[line] = _speed_line(problem, profile, arc[line], u[line]) / rate[line] ** 2
        p = _along(profile, arcs, within, rate.reshape(within.shape), p.reshape(within.shape)).ravel()
        return LimitSamples(
            length=length.ravel(),
            speed=rate * np.sqrt(np.maximum(p, 0.0)),
            acceleration=rate * np.sqrt(limit_curve(tangent, second, problem.max_acceleration)),
            feed=problem.feed[piece],
            velocity=rate * np.min(_quotient(problem.max_velocity, np.abs(tangent)), axis=1),
            chord=_chord_speed(problem, tangent, second, rate),
            arc=arc,
        )


def _profile_at(
    curve: CompositeCurve,
    profile: SpeedProfile,
    arc: NDArray[np.int64],
    u: Floats,
    place: Floats,
    tangent: Floats,
    rate: Floats,
) -> Floats:
    """p at a parameter of an arc, from what is constant on it."""
    kind, axis, value = profile.kind[arc], profile.axis[arc].astype(np.int64), profile.value[arc]
    p0, p1, u0, u1 = profile.p0[arc], profile.p1[arc], profile.u0[arc], profile.u1[arc]
    row = np.arange(len(u))
    column = np.where(axis < tangent.shape[1], axis, 0)
    q = tangent[row, column]
    # q'² p grows by 2·value·Δq from the start and from the end of the arc: the nearer end rounds less.
    near_start = u - u0 <= u1 - u
    at, known = np.where(near_start, u0, u1), np.where(near_start, p0, p1)
    place_known, tangent_known = curve.evaluate(profile.piece[arc], at, 1)[:, row, column]
    change = (q - tangent_known) * (q + tangent_known)
    arc_p = known + (2.0 * value * (place[row, column] - place_known) - known * change) / (q * q)
    p = np.select(
        [
            kind == ArcKind.PARAMETER_ACCELERATION,
            kind == ArcKind.FEED,
            kind == ArcKind.AXIS_VELOCITY,
            kind == ArcKind.CHORD,
        ],
        [known + 2.0 * value * (u - at), value / (rate * rate), value / (q * q), value * rate],
        default=arc_p,
    )
    p = np.where(u == u0, p0, np.where(u == u1, p1, p))
    return np.asarray(p)


def _speed_line(problem: Problem, profile: SpeedProfile, arc: NDArray[np.int64], u: Floats) -> Floats:
    """v² at a parameter of arcs on which it is linear."""
    curve, piece = problem.tip_curve or problem.curve, profile.piece[arc]
    u0, u1 = profile.u0[arc], profile.u1[arc]
    start, end = (
        (curve.evaluate(piece, at, 1)[1] ** 2).sum(axis=1) * p
        for at, p in ((u0, profile.p0[arc]), (u1, profile.p1[arc]))
    )
    return np.asarray(start + (end - start) * (u - u0) / (u1 - u0))


def _along(profile: SpeedProfile, arcs: NDArray[np.int64], way: Floats, rate: Floats, p: Floats) -> Floats:
    """p (arcs, samples), replaced on arcs of limited jerk by what the length from their start makes of it."""
    p = p.copy()
    for kind in (ArcKind.PATH_JERK, ArcKind.SPEED_CUBIC):
        rows = np.flatnonzero(profile.kind[arcs] == kind)
        some = arcs[rows]
        v0, v1 = (rate[rows, end] * np.sqrt(x[some]) for end, x in ((0, profile.p0), (-1, profile.p1)))
        ends = (v0, v1, profile.a0[some], profile.a1[some])
        if kind == ArcKind.PATH_JERK:
            pace = constant_jerk(way[rows], *ends, profile.value[some], profile.duration[some])
        else:
            pace = cubic(way[rows], *ends)
        p[rows] = (pace.v / rate[rows]) ** 2
    return p


def limit_curve(tangent: Floats, second: Floats, max_acceleration: Floats) -> Floats:
    """The greatest p that some acceleration within all axis limits allows, from C' and C'' (n, axes).

    min over pairs of axes of (A_j |q'_k| + A_k |q'_j|) / |q''_j q'_k − q''_k q'_j|, infinite on straight
    pieces (Zhang et al. 2010, eqs. 7–8, signs resolved).
    """
    best = np.full(len(tangent), np.inf)
    if tangent.shape[1] == 1:
        return best
    with np.errstate(divide="ignore", invalid="ignore"):
        for j, k in combinations(range(tangent.shape[1]), 2):
            turn = np.abs(second[:, j] * tangent[:, k] - second[:, k] * tangent[:, j])
            room = max_acceleration[j] * np.abs(tangent[:, k]) + max_acceleration[k] * np.abs(tangent[:, j])
            best = np.fmin(best, _quotient(room, turn))
    return best


def _quotient(top: Floats, bottom: Floats) -> Floats:
    """top / bottom, infinite where bottom is 0."""
    return np.asarray(np.where(bottom > 0, top / np.where(bottom > 0, bottom, 1.0), np.inf))


def _chord_speed(problem: Problem, tangent: Floats, second: Floats, rate: Floats) -> Floats:
    """(2/T)·√(2ρδ − δ²) with the radius of curvature ρ; infinite where the tolerance does not limit.

    Below ρ = δ it stays 2δ/T: no shorter part of the path can leave its chord by δ.
    """
    tolerance = problem.chord_tolerance
    if not np.isfinite(tolerance):
        return np.full(len(rate), np.inf)
    dot = np.einsum("ij,ij->i", tangent, second)
    cross = np.sqrt(np.maximum(rate**2 * np.einsum("ij,ij->i", second, second) - dot**2, 0.0))
    radius = np.maximum(_quotient(rate**3, cross), tolerance)
    return np.asarray(2.0 / problem.period * np.sqrt(2.0 * radius * tolerance - tolerance**2))

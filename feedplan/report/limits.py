"""Computes samples of the speed and its limits over the path's length: the limit curve and the speed caps.

The formulas follow the definitions, independently of the planner's code: q = C(u) for each axis, ' is d/du, p
= (du/dt)².
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from feedplan._solvers import Sampler
from feedplan.arrays import Floats, Integers
from feedplan.constraints.problem import Problem, feed_square
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener, part, tell

# The greatest number of samples in total: about 16 for every two of the 12 000 points that the page keeps of
# a curve.
_SAMPLES = 100_000
_SAMPLES_AT_ONCE = 10_000
_SAMPLES_PER_PHASE = 33


@dataclass(frozen=True)
class LimitSamples:
    """Samples in the order of the path: `length` [mm] and speeds [mm/s], infinite where a limit is absent.

    Lengths and speeds are those of the tool's motion, in degrees instead of mm if only rotary axes move.
    `speed` is the planned one, `acceleration` the limit curve of the axis accelerations; `feed`, `velocity`
    (of the axes) and `chord` (error between two setpoints) are speed caps. `phase` is the sample's phase.
    """

    length: Floats
    speed: Floats
    acceleration: Floats
    feed: Floats
    velocity: Floats
    chord: Floats
    phase: Integers


def samples_per_phase(profile: SpeedProfile) -> int:
    """Number of samples that `limit_samples` takes in each phase, including both ends."""
    return int(np.clip(_SAMPLES // max(len(profile), 1), 2, _SAMPLES_PER_PHASE))


def drawn_phases(problem: Problem, profile: SpeedProfile) -> Integers:
    """The phases that have samples: those that move the tool, or all if the path only turns it.

    Only every second, third … of them if there would be too many samples.
    """
    drawn = np.flatnonzero(problem.tool_motion.drawn[profile.piece.astype(np.int64)])
    return drawn[:: 1 + len(drawn) * samples_per_phase(profile) // (_SAMPLES + 1)]


def limit_samples(
    problem: Problem, profile: SpeedProfile, progress: Listener | None = None
) -> Iterator[LimitSamples]:
    """Samples of the phases that have samples, computed for a block of phases at a time."""
    count = samples_per_phase(profile)
    drawn = drawn_phases(problem, profile)
    states = profile.sampler(problem, part(progress, 0.0, 0.2))
    report = part(progress, 0.2, 1.0)
    tell(report, 0.0)
    # Denser towards both ends, because the speed changes most next to a stop.
    fraction = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count))
    step = max(1, _SAMPLES_AT_ONCE // count)
    for first in range(0, len(drawn), step):
        yield _sample(problem, profile, states, drawn[first : first + step], fraction)
        tell(report, min(first + step, len(drawn)) / len(drawn))


def _sample(
    problem: Problem,
    profile: SpeedProfile,
    states: Sampler,
    phases: Integers,
    fraction: Floats,
) -> LimitSamples:
    count = len(fraction)
    u0, u1 = profile.u0[phases], profile.u1[phases]
    # Weighted by both ends, so that the last sample is u1: u0 + 1·(u1 − u0) may differ from it by rounding.
    u = u0[:, None] * (1.0 - fraction) + u1[:, None] * fraction
    u = np.clip(u, u0[:, None], u1[:, None]).ravel()
    phase = np.repeat(phases, count)
    piece = profile.piece[phase].astype(np.int64)
    _, tangent, second = problem.curve.evaluate(piece, u, 2)
    slope = problem.tool_motion.slope(piece, u)
    # u̇ at both ends of each phase is known from the profile.
    ends = np.empty((len(phases), count))
    ends[:, 0], ends[:, -1] = np.sqrt(profile.p0[phases]), np.sqrt(profile.p1[phases])
    rate = ends.ravel()
    inside = np.arange(len(u)) % count % (count - 1) > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        velocity = states.along(piece[inside].astype(np.uint32), u[inside])[2]
        rate[inside] = parameter_speed(tangent[inside], velocity)
        joint = np.linalg.norm(tangent, axis=1)
        feed = _quotient(problem.feed[piece], np.sqrt(feed_square(problem, piece, u)))
        return LimitSamples(
            length=problem.tool_motion.drawn_length(piece, u),
            speed=slope * rate,
            acceleration=slope
            * np.sqrt(limit_curve(tangent, second, problem.max_acceleration, problem.min_acceleration)),
            feed=slope * feed,
            velocity=slope * np.min(_quotient(np.ones(1), problem.use("velocity", tangent)), axis=1),
            chord=slope * _quotient(chord_speed(problem, tangent, second), joint),
            phase=phase,
        )


def parameter_speed(tangent: Floats, velocity: Floats) -> Floats:
    """u̇ (n,) from q' and q̇ (n, joints), computed from the joint that moves most, which is accurate next to
    a cusp too."""
    own = np.abs(tangent).argmax(axis=1)[:, None]
    slope, rate = np.take_along_axis(tangent, own, 1), np.take_along_axis(velocity, own, 1)
    return np.asarray(np.abs(rate) / np.where(slope == 0.0, np.inf, np.abs(slope)))[:, 0]


def limit_curve(tangent: Floats, second: Floats, most: Floats, least: Floats) -> Floats:
    """The greatest p that accelerations from `least` to `most` (axes,) allow, from C' and C'' (n, axes).

    For two axes j, k and W = q''_j q'_k − q''_k q'_j, W p = a_j q'_k − a_k q'_j. The result is the least over
    all pairs of (greatest right side) / |W|; it is infinite on straight pieces (Zhang et al. 2010, eqs. 7–8).
    """
    best = np.full(len(tangent), np.inf)
    if tangent.shape[1] == 1:
        return best
    with np.errstate(divide="ignore", invalid="ignore"):
        for j, k in combinations(range(tangent.shape[1]), 2):
            turn = second[:, j] * tangent[:, k] - second[:, k] * tangent[:, j]
            sign = np.sign(turn)
            by_j, by_k = sign * tangent[:, k], -sign * tangent[:, j]
            room = np.where(by_j < 0.0, least[j], most[j]) * by_j
            room = room + np.where(by_k < 0.0, least[k], most[k]) * by_k
            best = np.fmin(best, _quotient(room, np.abs(turn)))
    return best


def _quotient(top: Floats, bottom: Floats) -> Floats:
    """top / bottom, infinite where bottom is 0."""
    return np.asarray(np.where(bottom > 0, top / np.where(bottom > 0, bottom, 1.0), np.inf))


def chord_speed(problem: Problem, tangent: Floats, second: Floats) -> Floats:
    """Speed cap of the chord error: (2/T)·√(2ρδ − δ²) [mm/s], by radius of curvature ρ, period T, tolerance
    δ.

    The speed is that along all axes of `tangent`. It is infinite without a tolerance. For ρ < δ it is 2δ/T:
    no shorter part of the path can leave its chord by δ.
    """
    tolerance, rate = problem.chord_tolerance, np.linalg.norm(tangent, axis=1)
    if not np.isfinite(tolerance):
        return np.full(len(rate), np.inf)
    dot = np.einsum("ij,ij->i", tangent, second)
    cross = np.sqrt(np.maximum(rate**2 * np.einsum("ij,ij->i", second, second) - dot**2, 0.0))
    radius = np.maximum(_quotient(rate**3, cross), tolerance)
    return np.asarray(2.0 / problem.period * np.sqrt(2.0 * radius * tolerance - tolerance**2))

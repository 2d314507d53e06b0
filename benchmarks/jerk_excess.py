"""Greatest excess of a jerk-limited profile over its limits, by exact derivatives inside its phases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem, speed_square
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.report.limits import chord_speed

Array = NDArray[np.float64]
NODES, WEIGHTS = leggauss(20)
# Distance of the outermost samples from the ends of a phase, as a share of its length in u.
INSET = 1e-7
# Lengths are integrated over parts that get shorter towards both ends, where the path may turn sharply.
DECADES = 10.0 ** np.arange(-6, -1)


@dataclass(frozen=True)
class Excess:
    """Greatest relative excess of axis velocity, acceleration and jerk, of the feed and of the chord speed.

    `gaps` is the greatest of: jumps of speed, acceleration and u between phases, and differences of the
    profile's lengths and durations from integrated ones; each relative to the greatest speed or acceleration,
    the whole length or the whole time (jumps of u are absolute).
    """

    velocity: float
    acceleration: float
    jerk: float
    feed: float
    chord: float
    gaps: float

    @property
    def worst(self) -> float:
        return max(self.velocity, self.acceleration, self.jerk, self.feed, self.chord)


def jerk_excess(problem: Problem, profile: SpeedProfile, samples: int = 20) -> Excess:
    """The excess at `samples` points of each phase and at its ends."""
    # Both ends, and the samples; the outermost ones are a little inside, because a curve may have no
    # direction at its ends.
    t = np.concatenate([[0.0], np.linspace(INSET, 1 - INSET, samples), [1.0]])
    fine = np.unique(np.concatenate([t, DECADES, 1 - DECADES]))
    along = profile.u0[:, None] + (profile.u1 - profile.u0)[:, None] * fine
    looked_at = np.searchsorted(fine, t)
    u = along[:, looked_at]
    s = lengths(problem, profile.piece, profile.u0, along)[:, looked_at]
    pace = _motion(problem, profile, s)
    piece, inside = np.repeat(profile.piece, samples), u[:, 1:-1]
    q1, q2, q3 = derivatives_by_length(problem, piece, inside.ravel())
    v, a, j = (x[:, 1:-1] for x in pace)
    v, a, j = (x.ravel()[:, None] for x in (v, a, j))
    velocity = np.abs(q1 * v) / problem.max_velocity
    acceleration = np.abs(q2 * v**2 + q1 * a) / problem.max_acceleration
    jerk = np.abs(q3 * v**3 + 3 * q2 * v * a + q1 * j) / problem.max_jerk
    tool_v = v[:, 0] * _tool_share(problem, piece, inside.ravel())
    feed = tool_v / problem.feed[piece]
    _, tangent, second = (problem.tip_curve or problem.path.curve).evaluate(piece, inside.ravel(), 2)
    chord = tool_v / chord_speed(problem, tangent, second)
    v, a, _ = pace
    joined = np.ones(len(profile) - 1, dtype=bool)
    joined[profile.runs[1:-1] - 1] = False
    off_length, off_time = _misfits(profile, v, s)
    gaps = [
        np.abs(v[1:, 0] - v[:-1, -1])[joined] / v.max(),
        np.abs(profile.a0[1:] - profile.a1[:-1])[joined] / np.abs(a).max(),
        off_length / s[:, -1].sum(),
        off_time / profile.time,
        np.abs(profile.u0[1:] - np.where(profile.piece[1:] == profile.piece[:-1], profile.u1[:-1], 0.0)),
    ]
    return Excess(
        *(float(used.max()) - 1 for used in (velocity, acceleration, jerk, feed, chord)),
        max(float(gap.max(initial=0.0)) for gap in gaps),
    )


def derivatives_by_length(
    problem: Problem, piece: NDArray[np.integer], u: Array
) -> tuple[Array, Array, Array]:
    """First to third derivative of the axes by the length of the tool's path, each (samples, axes)."""
    _, c1, c2, c3 = problem.derivatives(piece, u, 3)
    if problem.way_speed is None:
        # T is the direction, P = I − T Tᵀ: on a straight path the result is exactly 0 at any parameter speed.
        d = (c1**2).sum(axis=1, keepdims=True)
        tangent = c1 / np.sqrt(d)
        along = (tangent * c2).sum(axis=1, keepdims=True)
        bent = c2 - tangent * along
        twisted = c3 - tangent * (tangent * c3).sum(axis=1, keepdims=True)
        curvature = bent / d
        turning = (curvature**2).sum(axis=1, keepdims=True)
        return tangent, curvature, (twisted - 3 * bent * along / np.sqrt(d)) / d**1.5 - turning * tangent
    d, d1, d2 = (rate[:, None] for rate in _speed_sq(problem, piece, u))
    u1, u2 = 1 / np.sqrt(d), -d1 / (2 * d**2)
    u3 = u1 * (d1**2 / d**3 - d2 / (2 * d**2))
    return c1 * u1, c2 * u1**2 + c1 * u2, c3 * u1**3 + 3 * c2 * u1 * u2 + c1 * u3


def _motion(problem: Problem, profile: SpeedProfile, s: Array) -> tuple[Array, Array, Array]:
    """Speed, acceleration and jerk along the path at lengths (phases, samples) from each phase's start."""
    d0 = _speed_sq(problem, profile.piece, profile.u0)[0]
    d1 = _speed_sq(problem, profile.piece, profile.u1)[0]
    with np.errstate(invalid="ignore"):
        v0, v1 = (np.nan_to_num(np.sqrt(d * p)) for d, p in ((d0, profile.p0), (d1, profile.p1)))
    h = s[:, -1:]
    x = s / h
    # Phases of the law SPEED_CUBIC: v² is a cubic of the length.
    w0, w1, s0, s1 = (
        column[:, None] for column in (v0**2, v1**2, 2 * profile.a0 * h[:, 0], 2 * profile.a1 * h[:, 0])
    )
    y = 1 - x
    w = y**2 * ((1 + 2 * x) * w0 + x * s0) + x**2 * ((1 + 2 * y) * w1 - y * s1)
    slope = (6 * x * y * (w1 - w0) + y * (1 - 3 * x) * s0 + x * (3 * x - 2) * s1) / h
    bend = ((6 - 12 * x) * (w1 - w0) + (6 * x - 4) * s0 + (6 * x - 2) * s1) / h**2
    v = np.sqrt(np.maximum(w, 0.0))
    a, j = slope / 2, v * bend / 2
    # Phases of constant jerk: the time at each length by bisection, from the slower end (less rounding).
    rows = profile.kind == PhaseLaw.PATH_JERK
    back = (v1 < v0)[rows, None]
    way = np.where(back, h[rows] - s[rows], s[rows])
    low, high = np.zeros_like(way), np.repeat(profile.duration[rows, None], s.shape[1], axis=1)
    value = profile.value[rows, None]
    a0 = np.where(back, -profile.a1[rows, None], profile.a0[rows, None])
    start = np.where(back, v1[rows, None], v0[rows, None])
    for _ in range(60):
        t = (low + high) / 2
        before = t * (start + t * (a0 / 2 + t * value / 6)) < way
        low, high = np.where(before, t, low), np.where(before, high, t)
    v[rows] = np.maximum(start + t * (a0 + t * value / 2), 0.0)
    a[rows], j[rows] = np.where(back, -1.0, 1.0) * (a0 + value * t), value + 0 * t
    return v, a, j


def _misfits(profile: SpeedProfile, v: Array, s: Array) -> tuple[Array, Array]:
    """Differences (phases,) of integrated lengths and durations from those of the profile."""
    t, length = profile.duration, s[:, -1]
    constant = profile.kind == PhaseLaw.PATH_JERK
    way = t * (v[:, 0] + t * (profile.a0 / 2 + t * profile.value / 6))
    # The same parts as for the lengths, because 1/v is nearly singular next to rest.
    ends = np.concatenate([[0.0], DECADES, [0.5], 1 - DECADES[::-1], [1.0]])
    half = np.diff(ends)[:, None] / 2
    nodes, weights = (ends[:-1, None] + half * (NODES + 1)).ravel(), (half * WEIGHTS).ravel()
    w0, w1, s0, s1 = v[:, 0] ** 2, v[:, -1] ** 2, 2 * profile.a0 * length, 2 * profile.a1 * length
    x, y = nodes, 1 - nodes
    w = np.outer(w0, y**2 * (1 + 2 * x)) + np.outer(s0, y**2 * x)
    w += np.outer(w1, x**2 * (1 + 2 * y)) - np.outer(s1, x**2 * y)
    with np.errstate(invalid="ignore", divide="ignore"):
        time = length * ((1 / np.sqrt(w)) @ weights)
    return np.where(constant, np.abs(way - length), 0.0), np.where(constant, 0.0, np.abs(time - t))


def lengths(problem: Problem, piece: NDArray[np.uint32], start: Array, u: Array) -> Array:
    """Lengths of the tool's path (phases, samples) from the start of each phase [mm]."""
    low = np.concatenate([start[:, None], u[:, :-1]], axis=1)
    half = (u - low) / 2
    places = low[..., None] + half[..., None] * (NODES + 1)
    rows = np.repeat(piece, places[0].size)
    speed = np.sqrt(_speed_sq(problem, rows, places.ravel())[0]).reshape(places.shape)
    return np.cumsum(half * (speed @ WEIGHTS), axis=1)


def _tool_share(problem: Problem, piece: NDArray[np.integer], u: Array) -> Array:
    """Speed that the feed limits, divided by the speed along the path, at the samples."""
    if problem.way_speed is None:
        return np.ones(len(u))
    return np.sqrt(speed_square(problem, piece, u) / _speed_sq(problem, piece, u)[0])


def _speed_sq(problem: Problem, piece: NDArray[np.integer], u: Array) -> tuple[Array, Array, Array]:
    """|C'|² of the path at the samples, and its first two derivatives by u."""
    curve = problem.path.curve if problem.way_curve is None else problem.way_curve
    _, c1, c2, c3 = curve.evaluate(piece, u, 3)
    return (c1**2).sum(axis=1), 2 * (c1 * c2).sum(axis=1), 2 * (c2**2 + c1 * c3).sum(axis=1)

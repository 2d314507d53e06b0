"""The motion along the path on arcs of limited jerk, from the length of the way from the start of each arc.

At constant jerk the time of a length is found by Newton's method within a bracket that is halved; where v² is
a cubic polynomial of the length the time is integrated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from feedplan.audit.joint_path import EPS, Array, JointPath, Numbers
from feedplan.profile import ArcKind, SpeedProfile

GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)

# Steps of Newton's method and halvings: a bracket of doubles is closed by then. A step by so small a share of
# the time is rounding.
ROUNDS = 100
SETTLED = 4.0 * EPS


@dataclass(frozen=True)
class Pace:
    """Speed `v` along the path, its change `a`, that one's change `j`; the `time` since the arc's start."""

    v: Array
    a: Array
    j: Array
    time: Array


def ways(path: JointPath, piece: Numbers, u: Array) -> Array:
    """Length of the path (a, places) from the first place of each row to every one."""

    def rule(a: Array, b: Array) -> Array:
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        at = middle[..., None] + half[..., None] * GAUSS
        speed = path.way_slope(np.repeat(piece, at[0].size), at.ravel()).reshape(at.shape)
        return np.asarray((speed @ GAUSS_WEIGHTS) * half)

    a, b = u[:, :-1], u[:, 1:]
    middle = 0.5 * (a + b)
    steps = rule(a, middle) + rule(middle, b)
    return np.concatenate([np.zeros((len(u), 1)), np.cumsum(steps, axis=1)], axis=1)


def paces(path: JointPath, profile: SpeedProfile, arcs: Numbers, way: Array) -> Pace:
    """The motion of arcs of kind PATH_JERK or SPEED_CUBIC at lengths (a, places) from end to end."""
    piece = profile.piece[arcs].astype(np.int64)
    ends = [path.way_slope(piece, u[arcs]) for u in (profile.u0, profile.u1)]
    v0, v1 = (slope * np.sqrt(p[arcs]) for slope, p in zip(ends, (profile.p0, profile.p1), strict=True))
    a0, a1 = profile.a0[arcs], profile.a1[arcs]
    value, duration = profile.value[arcs], profile.duration[arcs]
    has_jerk = (profile.kind[arcs] == ArcKind.PATH_JERK)[:, None]
    by_jerk = constant_jerk(way, v0, v1, a0, a1, value, duration)
    by_cubic = cubic(way, v0, v1, a0, a1)
    return Pace(
        *(
            np.where(has_jerk, getattr(by_jerk, name), getattr(by_cubic, name))
            for name in ("v", "a", "j", "time")
        )
    )


def constant_jerk(
    way: Array, v0: Array, v1: Array, a0: Array, a1: Array, jerk: Array, duration: Array
) -> Pace:
    """The motion at lengths `way` (a, places) from end to end of arcs (a,) of constant jerk.

    Counted from the slower end, where nothing cancels: from the end time runs back.
    """
    back = (v1 < v0)[:, None]
    v, a, j = np.where(back[:, 0], v1, v0), np.where(back[:, 0], -a1, a0), jerk
    v, a, j, most = (x[:, None] for x in (v, a, j, duration))
    wanted = np.where(back, way[:, -1:] - way, way)

    def length(t: Array) -> Array:
        return np.asarray(t * (v + t * (a / 2.0 + t * j / 6.0)))

    whole = length(most)
    low, high = np.zeros_like(way), most + 0.0 * way
    t = most * np.cbrt(np.clip(wanted / whole, 0.0, 1.0))
    for _ in range(ROUNDS):
        miss = length(t) - wanted
        low, high = np.where(miss > 0.0, low, t), np.where(miss > 0.0, t, high)
        new = t - miss / (v + t * (a + t * j / 2.0))
        new = np.where((low <= new) & (new <= high), new, 0.5 * (low + high))
        settled = np.abs(new - t) <= SETTLED * new
        t = new
        if settled.all():
            break
    # A way beyond the arc's own at its mean speed.
    t = np.where(wanted >= whole, most * wanted / whole, t)
    pull = a + t * j
    return Pace(
        v + t * (a + t * j / 2.0), np.where(back, -pull, pull), j + 0.0 * way, np.where(back, most - t, t)
    )


def cubic(way: Array, v0: Array, v1: Array, a0: Array, a1: Array) -> Pace:
    """The motion at lengths `way` (a, places) from end to end of arcs (a,) with v² a cubic of the length."""
    length = way[:, -1:]
    w0, w1, slope0, slope1 = (
        x[:, None] for x in (v0**2, v1**2, 2.0 * a0 * length[:, 0], 2.0 * a1 * length[:, 0])
    )
    c2, c3 = 3.0 * (w1 - w0) - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * (w1 - w0)
    x = way / length

    def speed(x: Array) -> Array:
        return np.asarray(np.sqrt(w0 + x * (slope0 + x * (c2 + x * c3))))

    v = speed(x)
    a = (slope0 + x * (2.0 * c2 + x * 3.0 * c3)) / (2.0 * length)
    j = v * (c2 + 3.0 * x * c3) / length**2
    middle, half = 0.5 * (x[:, 1:] + x[:, :-1]), 0.5 * np.diff(x, axis=1)
    steps = np.zeros_like(middle)
    for node, weight in zip(GAUSS, GAUSS_WEIGHTS, strict=True):
        for share in (-0.5, 0.5):
            steps += 0.5 * weight * half / speed(middle + half * (share + 0.5 * node))
    time = np.concatenate([np.zeros_like(length), np.cumsum(steps * length, axis=1)], axis=1)
    return Pace(v, a, j, time)

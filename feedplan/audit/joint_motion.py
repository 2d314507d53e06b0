"""How the joints move on arcs of a profile, from what each arc holds constant and the kinematics' positions.

On an arc of constant acceleration of joint k: v_k² = v_k(slower end)² + 2 a Δq_k, u̇ = |v_k| / |dq_k/du|,
and a way Δq_k takes 2 Δq_k over the sum of the speeds at its ends. Where a joint's speed is constant: the
way over it; where p is linear in u: Δu over the mean √p; along a speed limit: ∫ |C'| du over the speed, by
Gauss's rule; where jerk is limited, speed and time follow from the length of the way along the path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.audit.joint_along import Pace, paces, ways
from feedplan.audit.joint_path import EPS, ROUNDINGS, Array, JointPath, Numbers
from feedplan.profile import ArcKind, SpeedProfile

SPEED_LINE = 5

# Kinds whose speed follows from the length of the way.
BY_WAY = (ArcKind.PATH_JERK, ArcKind.SPEED_CUBIC)

# Places of an arc, as shares of the variable in which √p would be linear if p were: close at the ends, where
# accelerations have their extremes.
PLACES = np.concatenate([[0.0, 1.0 / 64.0], np.arange(1.0, 8.0) / 8.0, [63.0 / 64.0, 1.0]])

# So much of a speed may be uncertain before it is taken from the recorded ends of the arc.
HIDDEN = 1e-3

GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Motion:
    """Some arcs at their places `u` (a, places).

    Per joint (a, places, joints): `position` [mm, deg], `way` from the start of the arc, dq/du `slope` and
    `velocity` [mm/s, deg/s], both with at most how wrong they are. `root_p` (a, places); the `time` [s] of
    every step (a, places − 1) and the share of it that may be wrong.
    """

    arcs: Numbers
    u: Array
    position: Array
    way: Array
    slope: Array
    slope_error: Array
    root_p: Array
    velocity: Array
    velocity_error: Array
    time: Array
    time_error: Array

    @property
    def elapsed(self) -> Array:
        """Time from the start of the arc (a, places)."""
        return np.concatenate([np.zeros((len(self.arcs), 1)), np.cumsum(self.time, axis=1)], axis=1)


def places(profile: SpeedProfile, arcs: Numbers) -> Array:
    """u (a, places) on arcs."""
    u0, u1 = profile.u0[arcs, None], profile.u1[arcs, None]
    near, far = (np.sqrt(p[arcs, None]) for p in (profile.p0, profile.p1))
    near, far = np.where(np.isfinite(near), near, far), np.where(np.isfinite(far), far, near)
    both = near + far
    good = np.isfinite(both) & (both > 0.0)
    near, both = np.where(good, near, 1.0), np.where(good, both, 2.0)
    share = PLACES * (2.0 * near + (both - 2.0 * near) * PLACES) / both
    return np.where(PLACES == 1.0, u1, u0 + (u1 - u0) * np.minimum(share, 1.0))


def motion(path: JointPath, profile: SpeedProfile, arcs: Numbers, u: Array | None = None) -> Motion:
    """The joints on arcs, whose numbers must be good, at places `u` (a, places) from end to end."""
    u = places(profile, arcs) if u is None else u
    count, width = u.shape
    piece = profile.piece[arcs].astype(np.int64)
    kind, value = profile.kind[arcs], profile.value[arcs][:, None]
    # Arcs are asked for again and again, as by setpoints: each place is measured once.
    spots, again = np.unique(np.repeat(piece, width) + 1j * u.ravel(), return_inverse=True)
    many, at = spots.real.astype(np.int64), spots.imag.copy()
    again = again.reshape(count, width)
    slope, error, unknown = (x[again] for x in path.slopes(many, at))
    position = path.at(many, at)[again]
    steps = path.between(piece, position[:, :-1], position[:, 1:])
    way = np.concatenate([np.zeros((count, 1, steps.shape[2])), np.cumsum(steps, axis=1)], axis=1)
    tip_speed, way_speed = path.feed_slope(many, at)[again], path.way_slope(many, at)[again]
    p = np.stack([profile.p0[arcs], profile.p1[arcs]], axis=1)
    with np.errstate(all="ignore"):
        own = np.where(profile.axis[arcs] < slope.shape[2], profile.axis[arcs], 0).astype(np.int64)
        rows = np.arange(count)
        g, g_error = np.abs(slope[rows, :, own]), error[rows, :, own]
        g_way, g_unknown = way[rows, :, own], unknown[rows, :, own].max(axis=1)[:, None]
        # The speed of the arc's own joint, from the slower end where it accelerates.
        ends = g[:, [0, -1]] ** 2 * p
        slower = np.where(np.isfinite(ends[:, 0]) & ~(ends[:, 1] < ends[:, 0]), 0, width - 1)
        start_sq = np.where(slower == 0, ends[:, 0], ends[:, 1])[:, None]
        way_from = g_way - g_way[rows, slower][:, None]
        speed_sq = np.where(
            kind[:, None] == ArcKind.AXIS_ACCELERATION, start_sq + 2.0 * value * way_from, value
        )
        at_start = np.arange(width) == slower[:, None]
        sq_error = np.where(
            kind[:, None] == ArcKind.AXIS_ACCELERATION,
            4.0 * np.abs(value) * g_unknown + 2.0 * np.sqrt(start_sq) * g_error[rows, slower][:, None]
            * np.sqrt(np.where(slower == 0, p[:, 0], p[:, 1]))[:, None],
            0.0,
        )  # fmt: skip
        speed_sq = np.where((speed_sq < 0.0) & (speed_sq >= -sq_error), 0.0, speed_sq)
        speed = np.sqrt(speed_sq)
        speed_error = sq_error / (speed + np.sqrt(sq_error))
        speed_error = np.where(sq_error > 0.0, speed_error, 0.0) + ROUNDINGS * EPS * speed
        line = _speed_line(tip_speed, p, u)
        by_way = np.isin(kind, BY_WAY)
        pace = _by_way(path, profile, arcs, u, by_way)
        p_slow, u_slow = np.where(p[:, :1] <= p[:, 1:], [p[:, :1], u[:, :1]], [p[:, 1:], u[:, -1:]])
        laws = [kind[:, None] == number for number in (0, 1, 2, 3, 4, SPEED_LINE)]
        laws.append(by_way[:, None] & np.ones(width, dtype=bool))
        slow = np.sqrt(np.where(slower == 0, p[:, 0], p[:, 1]))[:, None]
        by_joint = np.where(at_start & laws[0], slow, speed / g)
        root_p = np.select(
            laws,
            [
                by_joint,
                np.sqrt(p_slow + 2.0 * value * (u - u_slow)),
                np.sqrt(value) / tip_speed,
                speed / g,
                np.sqrt(value * tip_speed),
                line / tip_speed,
                pace.v / way_speed,
            ],
            np.nan,
        )
        relative = np.where(
            (laws[0] & ~at_start) | laws[3], speed_error / speed + g_error / g, ROUNDINGS * EPS
        )
        # Where rounding hides how the arc's own joint moves, its recorded ends tell: p changes little there.
        share = (u - u[:, :1]) / (u[:, -1:] - u[:, :1])
        known = 0.5 * np.abs(p[:, 1] - p[:, 0])[:, None] / p.max(axis=1)[:, None] + ROUNDINGS * EPS
        hidden = ~(relative <= HIDDEN) & (known < HIDDEN)
        between = np.sqrt(p[:, :1] + (p[:, 1:] - p[:, :1]) * share)
        root_p, relative = np.where(hidden, between, root_p), np.where(hidden, known, relative)
        velocity = slope * root_p[..., None]
        velocity_error = (
            error * root_p[..., None]
            + np.abs(velocity) * relative[..., None]
            + ROUNDINGS * EPS * np.abs(velocity)
        )
        velocity_error = np.where(velocity == 0.0, error * root_p[..., None], velocity_error)
        held = (laws[0] | laws[3])[:, :, None] & (np.arange(slope.shape[2]) == own[:, None, None])
        own_velocity = np.sign(slope) * speed[..., None]
        velocity = np.where(held & ~at_start[..., None], own_velocity, velocity)
        velocity_error = np.where(held & ~at_start[..., None], speed_error[..., None], velocity_error)
        time, time_error = _times(
            path, piece, kind, value, u, g_way, g_unknown, speed, speed_error, root_p, relative, p
        )
        time = np.where(by_way[:, None], np.diff(pace.time, axis=1), time)
        # The rounding of a time, not only of a step.
        late = ROUNDINGS * EPS * (1.0 + np.abs(pace.time[:, 1:]).max(axis=1, keepdims=True) / time)
        time_error = np.where(by_way[:, None] & (time > 0.0), late, time_error)
    return Motion(arcs, u, position, way, slope, error, root_p, velocity, velocity_error, time, time_error)


def _by_way(
    path: JointPath, profile: SpeedProfile, arcs: Numbers, u: Array, by_way: NDArray[np.bool_]
) -> Pace:
    """The motion along the path (a, places) on arcs on which it follows from the length, 0 on the others."""
    pace = Pace(*(np.zeros(u.shape) for _ in range(4)))
    if by_way.any():
        piece = profile.piece[arcs[by_way]].astype(np.int64)
        some = paces(path, profile, arcs[by_way], ways(path, piece, u[by_way]))
        for name in ("v", "a", "j", "time"):
            getattr(pace, name)[by_way] = getattr(some, name)
    return pace


def _speed_line(tip_speed: Array, p: Array, u: Array) -> Array:
    """The speed whose square is linear in u between both ends."""
    ends = tip_speed[:, [0, -1]] ** 2 * p
    share = (u - u[:, :1]) / (u[:, -1:] - u[:, :1])
    return np.asarray(np.sqrt(ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * share))


def _times(
    path: JointPath,
    piece: Numbers,
    kind: NDArray[np.uint8],
    value: Array,
    u: Array,
    g_way: Array,
    g_unknown: Array,
    speed: Array,
    speed_error: Array,
    root_p: Array,
    relative: Array,
    p: Array,
) -> tuple[Array, Array]:
    """The time of every step, and the share of it that may be wrong."""
    step = np.diff(u, axis=1)
    rounding = ROUNDINGS * EPS * (1.0 + path.problem.path.width[piece][:, None] / step)
    g_step = np.abs(np.diff(g_way, axis=1))
    both = speed[:, :-1] + speed[:, 1:]
    by_joint = 2.0 * g_step / both
    joint_error = 2.0 * g_unknown / g_step + (speed_error[:, :-1] + speed_error[:, 1:]) / both
    # Where the way is too short to tell: by the change of speed.
    by_change = np.abs(np.diff(speed, axis=1)) / np.abs(value)
    change_error = (speed_error[:, :-1] + speed_error[:, 1:]) / np.abs(value) / by_change
    accelerates = kind[:, None] == ArcKind.AXIS_ACCELERATION
    better = accelerates & (change_error < joint_error)
    time = np.where(better, by_change, by_joint)
    error = np.where(better, change_error, joint_error)
    # On arcs so short that no joint's way can be told from rounding: by the parameter.
    sides = root_p[:, :-1] + root_p[:, 1:]
    unknown = 0.5 * (relative[:, :-1] + relative[:, 1:])
    by_place, place_error = 2.0 * step / sides, rounding + np.abs(np.diff(root_p, axis=1)) / sides + unknown
    better = ~(error <= HIDDEN) & ~(place_error >= error)
    time, error = np.where(better, by_place, time), np.where(better, place_error, error)
    linear = kind[:, None] == ArcKind.PARAMETER_ACCELERATION
    time, error = np.where(linear, by_place, time), np.where(linear, rounding, error)
    closed = (ArcKind.AXIS_ACCELERATION, ArcKind.PARAMETER_ACCELERATION, ArcKind.AXIS_VELOCITY)
    integrated = ~np.isin(kind, (*closed, *BY_WAY))
    if integrated.any():
        some = np.flatnonzero(integrated)
        both_ways = _integrals(path, piece[some], kind[some], value[some], u[some], p[some])
        time[some] = both_ways[1]
        error[some] = np.abs(both_ways[1] - both_ways[0]) / both_ways[1] + rounding[some]
    stands = step == 0.0
    return np.where(stands, 0.0, time), np.where(stands, 0.0, error)


def _integrals(
    path: JointPath, piece: Numbers, kind: NDArray[np.uint8], value: Array, u: Array, p: Array
) -> tuple[Array, Array]:
    """∫ du/√p over every step, in one part and in two."""
    ends = np.stack([path.feed_slope(piece, u[:, end]) for end in (0, -1)], axis=1) ** 2 * p

    def rule(a: Array, b: Array) -> Array:
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        at = middle[..., None] + half[..., None] * GAUSS
        speed = path.feed_slope(np.repeat(piece, at[0].size), at.ravel()).reshape(at.shape)
        share = (at - u[:, :1, None]) / (u[:, -1:, None] - u[:, :1, None])
        line = np.sqrt(ends[:, :1, None] + (ends[:, 1:, None] - ends[:, :1, None]) * share)
        kinds = kind[:, None, None]
        rate = np.select(
            [kinds == ArcKind.FEED, kinds == ArcKind.CHORD],
            [speed / np.sqrt(value[..., None]), 1.0 / np.sqrt(value[..., None] * speed)],
            speed / line,
        )
        return np.asarray((rate @ GAUSS_WEIGHTS) * half)

    a, b = u[:, :-1], u[:, 1:]
    middle = 0.5 * (a + b)
    return rule(a, b), rule(a, middle) + rule(middle, b)

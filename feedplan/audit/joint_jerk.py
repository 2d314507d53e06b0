"""Jerk of joints that are not the path's axes, and how far their accelerations jump where arcs meet.

With g the slope of the way along the path by u: g u̇ = v, g ü = a − g' u̇², g u⃛ = j − 3 g' u̇ ü − g'' u̇³,
and a joint's jerk is q' u⃛ + 3 q'' u̇ ü + q''' u̇³. The derivatives of q and g are differences over seven
places. The step between these is chosen, for each derivative, by what two of them, one twice the other, agree
on; how far they may still be wrong is allowed for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.audit.joint_along import paces, ways
from feedplan.audit.joint_path import EPS, NODES, ROUNDINGS, Array, JointPath, Numbers
from feedplan.audit.worst import Worst
from feedplan.profile import ArcKind, SpeedProfile

# What the pass mark allows beyond a limit.
EXCESS = 1e-6

# A jerk is known closely enough where it may be off by no more than this part of its limit, or where it is
# below this part of the limit and may be off by no more than that.
CLOSE, LOW, ROUGH = 1e-9, 0.9, 1e-3

# Places of an arc: those of arcs up to so many servo periods long.
PLACES = ((10, 10.0), (80, 80.0), (640, np.inf))

# Places measured at once: seven of each, on as many widths of them.
BLOCK = 1 << 14

# Steps as shares of the piece, each half of the one before; what half the step leaves of the error of a third
# derivative: a sixteenth by the theory.
WIDEST, STEPS, LEFT = 2.0**-4, 7, 0.25

# Joints that leave a joint at a smaller angle than this, in rad, pass without a corner.
SMOOTH = 1e-6

KINDS = (ArcKind.PATH_JERK, ArcKind.SPEED_CUBIC)


def _stencils() -> tuple[Array, ...]:
    """Derivatives of the polynomials that are 1 at one place and 0 at the others, by powers of the place."""
    rows = []
    for j, node in enumerate(NODES):
        others = np.delete(NODES, j)
        rows.append(np.polynomial.polynomial.polyfromroots(others) / np.prod(node - others))
    derivatives = (np.polynomial.polynomial.polyder(rows, order, axis=1) for order in (1, 2, 3))
    return tuple(np.asarray(stencil, np.float64) for stencil in derivatives)


STENCILS = _stencils()


@dataclass(frozen=True)
class Slopes:
    """First to third derivatives by u of joints and way at places, and how far each may be wrong.

    `joints` and `joints_error` (3, n, joints); `way` and `way_error` (3, n).
    """

    joints: Array
    joints_error: Array
    way: Array
    way_error: Array


def slopes(
    path: JointPath,
    piece: Numbers,
    u: Array,
    is_enough: Callable[[Slopes, Numbers], NDArray[np.bool_]] = lambda at, rows: np.zeros(len(rows), bool),
) -> Slopes:
    """The derivatives at places (n,); `is_enough` says of some rows (m,) whether what is known will do."""
    joints = len(path.problem.axes)
    speed = path.way_slope(piece, u)

    def known(best: Array, error: Array, speed: Array) -> Slopes:
        # The last column is the slope of the way: its derivatives are the second and third of the way.
        way = np.stack([speed, best[0, :, joints], best[1, :, joints]])
        way_error = np.stack([ROUNDINGS * EPS * speed, error[0, :, joints], error[1, :, joints]])
        return Slopes(best[:, :, :joints], error[:, :, :joints], way, way_error)

    coarse = _differences(path, piece, u, WIDEST)
    best, error = coarse[0].copy(), np.full_like(coarse[0], np.inf)
    rows = np.arange(len(piece))
    for number in range(1, STEPS):
        fine = _differences(path, piece[rows], u[rows], WIDEST * 0.5**number)
        apart = np.abs(fine[0] - coarse[0])
        value, least = best[:, rows], error[:, rows]
        for (found, rounding), left in ((coarse, 1.0), (fine, LEFT)):
            bound = left * apart + rounding
            better = bound < least
            value, least = np.where(better, found, value), np.where(better, bound, least)
        best[:, rows], error[:, rows] = value, least
        open_ = ~is_enough(known(value, least, speed[rows]), rows)
        rows, coarse = rows[open_], (fine[0][:, open_], fine[1][:, open_])
        if not len(rows):
            break
    return known(best, error, speed)


def _differences(path: JointPath, piece: Numbers, u: Array, share: float) -> tuple[Array, Array]:
    """Derivatives (3, n, joints + 1) by places a share of the piece apart, and what may be rounding.

    The places are whole steps from the start of the piece: many rows have them in common.
    """
    count, steps = len(piece), round(1.0 / share)
    width = path.problem.path.width[piece]
    step = share * width
    centre = np.clip(np.rint(u / step).astype(np.int64), 3, steps - 3)
    numbers = (piece * (steps + 1) + centre)[:, None] + NODES.astype(np.int64)
    places, again = np.unique(numbers, return_inverse=True)
    many, number = np.divmod(places, steps + 1)
    tip, slope = path.tip(many, path.problem.path.width[many] * (share * number))
    again = again.reshape(count, len(NODES))
    q, speed = path.joints(many, tip)[again], path.way_of(slope)[again][:, :, None]
    change = path.between(piece, q[:, 3:4], q)
    values = np.concatenate([change, speed - speed[:, 3:4]], axis=2)
    # A joint feels the rounding of the tip as much as it moves with it.
    size = np.abs(tip).max(axis=1)[again].max(axis=1)
    fast = np.linalg.norm(slope, axis=1)[again].max(axis=1)
    moved = np.abs(change).max(axis=1) / (3.0 * step)[:, None]
    with np.errstate(all="ignore"):
        felt = np.nan_to_num(moved * (size / fast)[:, None], posinf=0.0)
    rounding = ROUNDINGS * EPS * np.concatenate([np.abs(q).max(axis=1) + felt, speed.max(axis=1)], axis=1)
    x = u / step - centre
    found, doubt = [], []
    for order, stencil in enumerate(STENCILS, start=1):
        weights = x[:, None] ** np.arange(stencil.shape[1]) @ stencil.T
        scale = step[:, None] ** order
        found.append(np.einsum("nj,njk->nk", weights, values) / scale)
        doubt.append(rounding * np.abs(weights).sum(axis=1)[:, None] / scale)
    return np.stack(found), np.stack(doubt)


def rates(at: Slopes, v: Array, a: Array, j: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Acceleration and jerk of the joints (n, joints), each with how far it may be wrong."""
    g, dg, ddg = at.way
    _, dg_error, ddg_error = at.way_error
    du = v / g
    ddu = (a - dg * du**2) / g
    ddu_error = dg_error * du**2 / g
    dddu = (j - du * (3.0 * dg * ddu + ddg * du**2)) / g
    dddu_error = du * (3.0 * (dg_error * np.abs(ddu) + np.abs(dg) * ddu_error) + ddg_error * du**2) / g
    du, ddu, dddu, ddu_error, dddu_error = (x[:, None] for x in (du, ddu, dddu, ddu_error, dddu_error))
    (q1, q2, q3), (e1, e2, e3) = at.joints, at.joints_error
    rounding = ROUNDINGS * EPS
    acceleration = q1 * ddu + q2 * du**2
    acceleration_error = e1 * np.abs(ddu) + np.abs(q1) * ddu_error + e2 * du**2
    acceleration_error += rounding * (np.abs(q1 * ddu) + np.abs(q2) * du**2)
    jerk = q1 * dddu + du * (3.0 * q2 * ddu + q3 * du**2)
    jerk_error = e1 * np.abs(dddu) + np.abs(q1) * dddu_error
    jerk_error += du * (3.0 * (e2 * np.abs(ddu) + np.abs(q2) * ddu_error) + e3 * du**2)
    jerk_error += rounding * (np.abs(q1 * dddu) + du * (3.0 * np.abs(q2 * ddu) + np.abs(q3) * du**2))
    return (acceleration, acceleration_error), (jerk, jerk_error)


def audit_joint_jerk(
    path: JointPath,
    profile: SpeedProfile,
    arcs: Numbers,
    good: NDArray[np.bool_],
    starts: Array,
    worst: Worst,
) -> None:
    """Offers the jerk on arcs, and the jumps of the acceleration where they begin.

    `good` (all arcs,) says which have numbers that can be measured.
    """
    problem = path.problem
    arcs = arcs[good[arcs]]
    with np.errstate(all="ignore"):
        line = problem.path.line[profile.piece[arcs].astype(np.int64)]
        silent = ~np.isin(profile.kind[arcs], KINDS)
        for k, limit in enumerate(problem.max_jerk):
            # Nothing limits the jerk on arcs of other kinds.
            unlimited = silent & np.isfinite(limit)
            worst.offer("jerk", np.where(unlimited, np.inf, 0.0), limit, starts[arcs], line, k)
        some, shortest = arcs[~silent], 0.0
        for count, longest in PLACES:
            periods = profile.duration[some] / problem.period
            mine = some[(shortest <= periods) & (periods < longest)]
            shortest, step = longest, max(BLOCK // count, 1)
            for first in range(0, len(mine), step):
                _jerks(path, profile, mine[first : first + step], count, starts, worst)
        _alone(path, profile, arcs, starts, worst)
        follows = arcs[(arcs > 0) & ~np.isin(arcs, profile.runs) & good[arcs - 1]]
        _joints(path, profile, follows, starts, worst)


def _jerks(
    path: JointPath, profile: SpeedProfile, arcs: Numbers, count: int, starts: Array, worst: Worst
) -> None:
    """The jerk at so many even steps of arcs."""
    problem = path.problem
    piece = profile.piece[arcs].astype(np.int64)
    share = np.linspace(0.0, 1.0, count + 1)
    u = profile.u0[arcs, None] * (1.0 - share) + profile.u1[arcs, None] * share
    pace = paces(path, profile, arcs, ways(path, piece, u))
    v, a, j = pace.v.ravel(), pace.a.ravel(), pace.j.ravel()

    def is_enough(at: Slopes, rows: Numbers) -> NDArray[np.bool_]:
        jerk, error = (part / problem.max_jerk for part in rates(at, v[rows], a[rows], j[rows])[1])
        is_low = (np.abs(jerk) + error <= LOW) & (error <= ROUGH)
        return np.asarray((is_low | (error <= CLOSE)).all(axis=1))

    at = slopes(path, np.repeat(piece, count + 1), u.ravel(), is_enough)
    _, (jerk, error) = rates(at, v, a, j)
    time = (starts[arcs][:, None] + pace.time).ravel()
    line = np.repeat(problem.path.line[piece], count + 1)
    worst.samples += len(time)
    for k, limit in enumerate(problem.max_jerk):
        worst.offer("jerk", np.abs(jerk[:, k]) - error[:, k], limit, time, line, k)


def _negligible(path: JointPath) -> float:
    """A jump of the acceleration along the path that means nothing to any joint over a period."""
    return EXCESS * float(path.problem.max_jerk.min()) * path.problem.period


def _alone(path: JointPath, profile: SpeedProfile, arcs: Numbers, starts: Array, worst: Worst) -> None:
    """The recorded accelerations of each arc against its jerk, and at rest against 0."""
    problem = path.problem
    a0, a1, time = profile.a0[arcs], profile.a1[arcs], starts[arcs]
    line = problem.path.line[profile.piece[arcs].astype(np.int64)]
    change = profile.value[arcs] * profile.duration[arcs]
    off = np.abs(a1 - a0 - change) - ROUNDINGS * EPS * (np.abs(a0) + np.abs(a1) + np.abs(change))
    off = np.where(profile.kind[arcs] == ArcKind.PATH_JERK, off, 0.0)
    worst.offer("acceleration_continuity", off, _negligible(path), time, line)
    begins = np.isin(arcs, profile.runs[:-1]) & ~((arcs == 0) & (problem.start_speed > 0.0))
    ends = np.isin(arcs + 1, profile.runs[1:]) & ~((arcs + 1 == len(profile)) & (problem.end_speed > 0.0))
    for here, a in ((begins, a0), (ends, a1)):
        worst.offer("acceleration_continuity", np.where(here, np.abs(a), 0.0), _negligible(path), time, line)


def _joints(path: JointPath, profile: SpeedProfile, arcs: Numbers, starts: Array, worst: Worst) -> None:
    """From the arc before to each: no jump along the path, and of a joint only where the curvature jumps."""
    problem = path.problem
    arcs = arcs[np.isin(profile.kind[arcs], KINDS) & np.isin(profile.kind[arcs - 1], KINDS)]
    if not len(arcs):
        return
    before, after = (profile.piece[x].astype(np.int64) for x in (arcs - 1, arcs))
    time, line = starts[arcs], problem.path.line[after]
    from_, to = profile.a1[arcs - 1], profile.a0[arcs]
    off = np.abs(to - from_) - ROUNDINGS * EPS * (np.abs(to) + np.abs(from_))
    worst.offer("acceleration_continuity", off, _negligible(path), time, line)
    meet = before != after
    if not meet.any():
        return
    sides = []
    for number, u, p, a in (
        (before[meet], profile.u1[arcs[meet] - 1], profile.p1[arcs[meet] - 1], from_[meet]),
        (after[meet], profile.u0[arcs[meet]], profile.p0[arcs[meet]], to[meet]),
    ):
        at = slopes(path, number, u)
        acceleration = rates(at, at.way[0] * np.sqrt(p), a, 0.0 * a)[0]
        direction = at.joints[0] / np.linalg.norm(at.joints[0], axis=1)[:, None]
        sides.append((*acceleration, direction))
    (a, a_error, into), (b, b_error, out) = sides
    turns = ~(np.linalg.norm(out - into, axis=1) <= SMOOTH)
    step = np.where(turns[:, None], 0.0, np.abs(b - a) - a_error - b_error)
    # Of a step over the period a third difference of setpoints shows at most three quarters as a jerk.
    for k, limit in enumerate(problem.max_jerk * problem.period / 0.75):
        worst.offer("acceleration_jump", step[:, k], limit, time[meet], line[meet], k)

"""Trapezoidal speed profiles with look-ahead over whole runs, shared by the methods of controllers.

A method gives the speeds at corners and the allowed accelerations. On each segment (`_segments`) speed rises
with one constant tangential acceleration and falls with another. On a line each is the greatest possible, min
over the axes of A_k/|t_k|, with the limit A_k for the direction in which axis k accelerates, and the profile
is exact. On a part of a curved piece v² is linear in the parameter, with the greatest slope that keeps the
tangential acceleration everywhere on the part.
"""

from __future__ import annotations

import math

import numpy as np

from feedplan._solvers import look_ahead as native_look_ahead
from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.problem import Problem, feed_square, speed_square
from feedplan.planners._faults import end_error
from feedplan.planners._queue import Queue
from feedplan.planners._segments import CurvePlaces, Rule, Segments, segments
from feedplan.profile import NO_AXIS, PhaseLaw, SpeedProfile

# Phases of a segment shorter than this many rounding errors of its parameter and of v² are left out.
ROUNDINGS = 4.0

# A reached speed may be smaller than the given one by this share (rounding).
ROUNDING = 1e-12

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)

# For the phases between the six places of a segment: whether the speed is constant, and whether it falls (1).
_CONSTANT = np.array([True, False, True, False, True])
_SLOWS = np.array([0, 0, 0, 1, 0])


def look_ahead(
    problem: Problem,
    corner_speed: Floats,
    rule: Rule,
    hold: Floats | None = None,
    queue: Queue | None = None,
) -> SpeedProfile:
    """The fastest profile of trapezoids.

    `corner_speed` (n + 1,) [mm/s] limits the speed at the ends of the pieces; runs end at rest, the path with
    the problem's speeds. `hold` (n + 1,) [s] is the time for which the speed stays constant before and after
    the end of a piece; next to a curve the tool stops instead. `queue` is the part of the path that the
    controller knows, with its limits along the path; by default it knows everything and has no limits. Raises
    SolverError (see `segments`) and InfeasibleError where the start or end speed is not possible.
    """
    queue = queue or Queue()
    parts = segments(problem, rule, queue.velocity, queue.acceleration)
    parts = queue.limited(parts, problem.path.move[:, 1])
    at_end, held = _speed_at_ends(problem, parts, corner_speed, hold)
    parts, at_end = queue.known(parts, at_end)
    room = np.stack([held[:-1], held[1:]], axis=1)
    acceleration = 0.5 * parts.slope / parts.rate
    holds = np.where(room > 0.0, acceleration[..., None] * room, 0.0)
    gain = parts.slope * (parts.u1 - parts.u0)
    changes = np.ascontiguousarray(np.concatenate([gain[..., None], holds], axis=2))
    speed = native_look_ahead(at_end, changes[0], changes[1])
    _check_ends(problem, speed)
    return _profile(problem, parts, speed, room)


def _speed_at_ends(
    problem: Problem, parts: Segments, corner_speed: Floats, hold: Floats | None
) -> tuple[Floats, Floats]:
    """The greatest speed at each end of a segment [mm/s], and the time for which it is held on each side [s],
    both (m + 1,)."""
    first = np.searchsorted(parts.piece, np.arange(len(problem.path) + 1))
    limit = np.concatenate([parts.speed, [np.inf]])
    limit[1:] = np.minimum(limit[1:], parts.speed)
    limit[first] = np.minimum(limit[first], corner_speed)
    limit[first[problem.path.runs]] = 0.0
    limit[0], limit[-1] = min(parts.speed[0], problem.start_speed), min(parts.speed[-1], problem.end_speed)
    held = np.zeros(len(limit))
    if hold is None:
        return limit, held
    held[first] = hold
    held[[0, -1]] = 0.0
    curved = np.concatenate([[False], np.isnan(parts.rate), [False]])
    limit[(held > 0.0) & (curved[:-1] | curved[1:])] = 0.0
    held[limit == 0.0] = 0.0
    # A segment must last at least as long as the speeds at both its ends are held.
    time = held[:-1] + held[1:]
    with np.errstate(divide="ignore"):
        whole = np.where(time > 0.0, parts.rate * (parts.u1 - parts.u0) / time, np.inf)
    for ends in (slice(None, -1), slice(1, None)):
        limit[ends] = np.where(held[ends] > 0.0, np.minimum(limit[ends], whole), limit[ends])
    return limit, held


def _check_ends(problem: Problem, speed: Floats) -> None:
    for place, wanted in ((0, problem.start_speed), (-1, problem.end_speed)):
        reached = float(speed[place])
        if reached < wanted * (1.0 - ROUNDING):
            shown = math.floor(reached * 1e6) / 1e6
            why = f"at most {shown:.9g} {problem.unit}/s is possible: "
            line = int(problem.path.line[place])
            raise end_error(problem, place == 0, line, why, reached, "no profile of this method")


def _profile(problem: Problem, parts: Segments, speed: Floats, room: Floats) -> SpeedProfile:
    """The profile's phases between the speeds at the ends of the segments."""
    whole = parts.u1 - parts.u0
    start_sq, end_sq = speed[:-1] ** 2, speed[1:] ** 2
    still = np.where(room > 0.0, room * np.stack([speed[:-1], speed[1:]], axis=1) / parts.rate[:, None], 0.0)
    left = np.maximum(whole - still.sum(axis=1), 0.0)
    least = np.maximum(start_sq, end_sq)
    faster, slower = parts.slope
    share = np.divide(slower, faster + slower, out=np.full(len(parts), 0.5), where=faster + slower > 0.0)
    meet = share * start_sq + (1.0 - share) * end_sq + share * faster * left
    triangle = meet < parts.speed**2
    peak_sq = np.maximum(np.minimum(meet, parts.speed**2), least)

    # The six places of a segment bound its phases: held, speeding up, cruising, slowing down, held.
    rise, fall = (peak_sq - start_sq) / faster, (peak_sq - end_sq) / slower
    top, end = still[:, 0] + rise, whole - still[:, 1]
    down = np.where(triangle, top, end - fall)
    place = np.stack([np.zeros(len(parts)), still[:, 0], top, down, end, whole], axis=1)
    place = np.maximum.accumulate(np.clip(place, 0.0, whole[:, None]), axis=1)
    digits = parts.u1 + (start_sq + end_sq) / np.minimum(faster, slower)
    none = ROUNDINGS * np.finfo(float).eps * digits
    for i in range(1, 5):
        place[:, i] = np.where(place[:, i] - place[:, i - 1] <= none, place[:, i - 1], place[:, i])
    for i in range(4, 0, -1):
        place[:, i] = np.where(whole - place[:, i] <= none, whole, place[:, i])
    speed_sq = np.stack([start_sq, start_sq, peak_sq, peak_sq, end_sq, end_sq], axis=1)

    segment, phase = np.nonzero(np.diff(place, axis=1) > 0.0)
    u = np.where(place == whole[:, None], parts.u1[:, None], parts.u0[:, None] + place)
    u0, u1 = u[segment, phase], u[segment, phase + 1]
    from_sq, to_sq = speed_sq[segment, phase], speed_sq[segment, phase + 1]
    piece, line = parts.piece[segment], ~np.isnan(parts.rate[segment])
    constant = _CONSTANT[phase]
    # The speed of all axes together is constant; on lines the speed that the feed limits is so too.
    counted, by_shares = _counted(problem, piece, u0)
    even = np.where(by_shares & ~line, PhaseLaw.SPEED_LINE, PhaseLaw.FEED)
    ramp_kind = np.where(line, PhaseLaw.AXIS_ACCELERATION, PhaseLaw.SPEED_LINE)
    rate = np.stack([parts.rate[segment]] * 2)
    length = rate[0] * (u1 - u0)
    curved = np.flatnonzero(~line)
    ends = (problem.curve.evaluate(piece[curved], at[curved], 1)[1] for at in (u0, u1))
    rate[:, curved] = [np.linalg.norm(tangent, axis=1) for tangent in ends]
    length[curved] = _weighted_length(
        problem, piece[curved], u0[curved], u1[curved], from_sq[curved], to_sq[curved]
    )
    # The first and last phase of a segment get exactly its end speeds, also where a ramp is left out.
    by_law = ~constant | (even == PhaseLaw.FEED)
    first = np.flatnonzero(np.diff(segment, prepend=-1) * by_law)
    last = np.flatnonzero(np.diff(segment, append=len(parts)) * by_law)
    p0, p1 = from_sq / rate[0] ** 2, to_sq / rate[1] ** 2
    p0[first] = start_sq[segment[first]] / rate[0, first] ** 2
    p1[last] = end_sq[segment[last]] / rate[1, last] ** 2
    return SpeedProfile(
        piece=piece.astype(np.uint32),
        kind=np.where(constant, even, ramp_kind).astype(np.uint8),
        axis=np.where(constant, NO_AXIS, parts.axis[_SLOWS[phase], segment]).astype(np.uint8),
        value=np.where(
            constant,
            np.where(even == PhaseLaw.FEED, counted * from_sq, 0.0),
            parts.value[_SLOWS[phase], segment],
        ),
        u0=u0,
        u1=u1,
        p0=p0,
        p1=p1,
        duration=2.0 * length / (np.sqrt(from_sq) + np.sqrt(to_sq)),
        runs=np.searchsorted(piece, problem.path.runs),
    )


def _counted(problem: Problem, piece: Integers, u: Floats) -> tuple[Floats, Flags]:
    """(speed that the feed limits)² / (speed of all axes)² (n,), and where both speeds differ."""
    if problem.feed_share is None:
        return np.ones(len(piece)), np.zeros(len(piece), dtype=np.bool_)
    by_shares = np.logical_or.reduce(problem.feed_share[piece] != 1.0, axis=1)
    quotient = feed_square(problem, piece, u) / speed_square(problem, piece, u)
    return np.where(by_shares, quotient, 1.0), by_shares


def _weighted_length(
    problem: Problem, piece: Integers, u0: Floats, u1: Floats, from_sq: Floats, to_sq: Floats
) -> Floats:
    """The mean of |C'| over v, times u1 − u0; divided by the mean speed it is the duration."""
    start, end = np.sqrt(from_sq), np.sqrt(to_sq)
    total = np.zeros(len(piece))
    for node, weight in zip(0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS, strict=True):
        # v² is linear in u; this is the share of the parameter at which v = start + node·(end − start).
        share = node * ((2.0 - node) * start + node * end) / (start + end)
        u = np.minimum(u0 + share * (u1 - u0), u1)
        total += weight * np.linalg.norm(problem.curve.evaluate(piece, u, 1)[1], axis=1)
    return np.asarray(total * (u1 - u0))


def shared_acceleration(at: CurvePlaces) -> tuple[Floats, Floats]:
    """Tangential (1/2) and normal (√3/2) shares of the acceleration that all directions in the plane allow.

    The sum of both never exceeds an axis's limit. The split is that of LinuxCNC's blend arcs (`blendmath.h`:
    a tangential ratio of 0.5; the normal one completes the circle); the whole acceleration is min over the
    axes of A_k/√(t_k² + n_k²). A_k is the smaller limit of both directions, because the directions of the
    plane include both.
    """
    with np.errstate(divide="ignore"):
        whole = (at.limits.min(axis=0) / np.hypot(at.tangent, at.normal)).min(axis=1)
    return np.stack([0.5 * whole, 0.5 * whole]), 0.5 * math.sqrt(3.0) * whole

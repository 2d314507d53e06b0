"""Divides a path into segments as controllers see it: each has one greatest speed and one acceleration in
each direction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import feed_between
from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import SolverError, at_line
from feedplan.profile import NO_AXIS


class CurvePlaces(NamedTuple):
    """Places of a curved path: unit `tangent` and unit `normal` (m, axes), the normal 0 where the path is
    straight; the `limits` of the axes' accelerations (2, axes) [mm/s²] in positive and negative direction, as
    absolute values; the `radius` of curvature (m,) [mm], infinite where the path is straight; the `speed`
    (m,) [mm/s] that feed and axis velocities allow."""

    tangent: Floats
    normal: Floats
    limits: Floats
    radius: Floats
    speed: Floats


# Returns the greatest accelerations along the path for speeding up and slowing down (2, m), and across it
# (m,) [mm/s²].
Rule = Callable[[CurvePlaces], tuple[Floats, Floats]]

# A curved piece is cut into equal parts, so that direction and ln |C'| change by STEP on average in each.
# Parts in which one of them changes by more than 2 STEP, as next to a cusp, are cut again, at most CUTS
# times.
STEP, CUTS = 0.1, 20

# Places of a part at which its limits are evaluated, as fractions of it. On a circle this is exact; elsewhere
# the limits of acceleration and chord error between two places differ from those at the places by a relative
# error of about STEP²/16. Velocity limits are also followed between the places (`_between`).
PLACES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
# The weights of Boole's rule, for the mean over a part.
WEIGHTS = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0

# FINER: matrix from values at PLACES to values of their polynomial at 17 places. LOWERED: speeds are lowered
# for values between the places only by more than this share; on a circle, rounding of the polynomial is less.
FINER = np.vander(np.linspace(0.0, 1.0, 17), 5) @ np.linalg.inv(np.vander(PLACES, 5))
LOWERED = 2e-7

# Places at which the change of direction over a whole piece is measured.
SURVEY = np.linspace(0.0, 1.0, 9)

# Speed limits of parts of a piece that differ by less than this share are made equal.
ONE_SPEED = 1e-9

# A place is a cusp where |C'| is at most this share of its greatest value on the piece.
CUSP = 1e-9

# On a line, edges between control points differ by at most UNEVEN times an edge plus ROUNDINGS units in the
# last place.
UNEVEN, ROUNDINGS = 1e-9, 8.0


@dataclass(frozen=True)
class Segments:
    """The segments (lines, and parts of curved pieces) in the order of the path.

    `piece`, `u0`, `u1` (m,) are the range of each segment; `rate` (m,) is |C'|, constant on lines, NaN on
    curves. `speed` (m,) [mm/s] is the greatest speed; `slope` (2, m) the greatest d(v²)/du [mm/s²·|C'|] for
    speeding up and slowing down. On lines `axis` (2, m) is the axis that limits the acceleration, `value` (2,
    m) [mm/s²] its acceleration then; on curves NO_AXIS and 0. `length` (m,) [mm] is approximate on curves,
    and `radius` (m,) [mm] the least radius of curvature, infinite on lines.
    """

    piece: Integers
    u0: Floats
    u1: Floats
    rate: Floats
    speed: Floats
    slope: Floats
    axis: NDArray[np.uint8]
    value: Floats
    length: Floats
    radius: Floats

    def __len__(self) -> int:
        return len(self.piece)


def segments(
    problem: Problem, rule: Rule, velocity: float = math.inf, acceleration: float = math.inf
) -> Segments:
    """The segments of a problem's path, with accelerations by `rule`.

    `velocity` [mm/s] and `acceleration` [mm/s²] are the greatest along the path, in addition to the limits of
    the axes. Speeds are limited by feed, axis velocities and, on curves, chord error and the acceleration
    across. Raises SolverError at cusps, and where the joints are not the path's axes.
    """
    if problem.joints is not None:
        raise SolverError(
            "this method takes the program's axes as the machine's: where joints move in another way, "
            "plan with bang-bang"
        )
    curve = problem.curve
    straight = is_line(curve)
    lines, curves = np.flatnonzero(straight), np.flatnonzero(~straight)
    parts = [_lines(problem, lines, acceleration)]
    if len(curves):
        parts.append(_curves(problem, curves, rule, acceleration))
    names = parts[0].__dict__
    columns = {name: np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names}
    order = np.lexsort((columns["u0"], columns["piece"]))
    columns["speed"] = np.minimum(columns["speed"], velocity)
    return Segments(**{name: column[..., order] for name, column in columns.items()})


def is_line(curve: CompositeCurve) -> Flags:
    """Whether each piece (n,) is a line with constant |C'|, as the path builder makes them."""
    control, first = curve.control_points, curve.offsets[:-1]
    edge = np.diff(control, axis=0)
    own = np.repeat(np.arange(len(curve)), curve.degree + 1)[:-1]
    uneven = np.abs(edge - edge[first][own]).max(axis=1, initial=0.0)
    size = UNEVEN * np.abs(edge[first]).max(axis=1)
    size += ROUNDINGS * np.finfo(float).eps * np.abs(control[first]).max(axis=1)
    # The difference from one piece to the next is no edge.
    uneven[curve.offsets[1:-1] - 1] = 0.0
    line = np.maximum.reduceat(np.append(uneven, 0.0), first) <= size
    return np.asarray(line & ~curve.rational)


def _lines(problem: Problem, piece: Integers, acceleration: float) -> Segments:
    curve = problem.curve
    way = curve.control_points[curve.offsets[piece + 1] - 1] - curve.control_points[curve.offsets[piece]]
    length = np.linalg.norm(way, axis=1)
    _refuse(problem, piece[length == 0.0], "the piece has no length: leave it out")
    tangent = way / length[:, None]
    # Rows: speeding up, slowing down.
    change = np.stack([tangent, -tangent])
    by_axis = _over(problem.limit("acceleration", change), np.abs(change))
    axis = by_axis.argmin(axis=2)[..., None]
    value = np.where(change < 0.0, problem.min_acceleration, problem.max_acceleration)
    rate = length / curve.width[piece]
    most = np.take_along_axis(by_axis, axis, 2)[..., 0]
    along = np.minimum(most, acceleration)
    return Segments(
        piece=piece,
        u0=np.zeros(len(piece)),
        u1=curve.width[piece],
        rate=rate,
        speed=_speed(problem, piece, tangent),
        slope=2.0 * along * rate,
        axis=axis[..., 0].astype(np.uint8),
        value=np.take_along_axis(value, axis, 2)[..., 0] * (along / most),
        length=length,
        radius=np.full(len(piece), np.inf),
    )


def _curves(problem: Problem, pieces: Integers, rule: Rule, acceleration: float) -> Segments:
    piece, u0, u1 = pieces, np.zeros(len(pieces)), problem.curve.width[pieces]
    fastest = np.zeros(len(problem.curve))
    rate, tangent = _at(problem, (piece, u0, u1), SURVEY, fastest)
    fastest[pieces] = rate.max(axis=1)
    count = _counts(rate, tangent, STEP)
    for _ in range(CUTS):
        piece, u0, u1 = _cut(piece, u0, u1, count)
        rate, tangent = _at(problem, (piece, u0, u1), PLACES, fastest)
        count = _counts(rate, tangent, 2.0 * STEP)
        if (count == 1).all():
            break
    rows = np.repeat(piece, len(PLACES))
    rate, tangent = rate.ravel(), tangent.reshape(len(rows), -1)
    second = problem.curve.evaluate(rows, _places(u0, u1, PLACES).ravel(), 2)[2]
    bend = second - (second * tangent).sum(axis=1)[:, None] * tangent
    size = np.linalg.norm(bend, axis=1)
    curvature = size / rate**2
    with np.errstate(divide="ignore", over="ignore"):
        radius = 1.0 / curvature
        normal, speed = _over(bend, size[:, None], 0.0), _speed(problem, rows, tangent)
        along, across = rule(CurvePlaces(tangent, normal, problem.limits("acceleration"), radius, speed))
        speed = np.minimum(speed, np.sqrt(across * radius))
    speed = np.minimum(speed, _chord_speed(problem, radius))
    shape = (-1, len(PLACES))
    speed = _between(problem, tangent.reshape(*shape, tangent.shape[1]), _least(speed.reshape(shape)))
    if problem.feed_share is not None:
        # Between the places, the axes along which the feed counts may have a larger share of the speed.
        speed = np.minimum(speed, feed_between(problem, piece, u0, u1))
    # On a circle the speed limits of the parts differ only by rounding: they get one value.
    first = np.flatnonzero(np.diff(piece, prepend=-1))
    least = np.repeat(np.minimum.reduceat(speed, first), np.diff(first, append=len(piece)))
    speed = np.where(speed <= least * (1.0 + ONE_SPEED), least, speed)
    return Segments(
        piece=piece,
        u0=u0,
        u1=u1,
        rate=np.full(len(piece), np.nan),
        speed=speed,
        slope=_least((2.0 * np.minimum(along, acceleration) * rate).reshape(2, *shape)),
        axis=np.full((2, len(piece)), NO_AXIS, dtype=np.uint8),
        value=np.zeros((2, len(piece))),
        length=rate.reshape(shape) @ WEIGHTS * (u1 - u0),
        radius=_least(radius.reshape(shape)),
    )


def in_direction(limits: Floats, direction: Floats) -> Floats:
    """The greatest factors (m,) of directions (m, axes) that the limits (2, axes) allow."""
    with np.errstate(divide="ignore"):
        by_axis = np.where(direction < 0.0, limits[1], limits[0]) / np.abs(direction)
    return _least(by_axis)


def both_ways(limits: Floats, direction: Floats) -> Floats:
    """The greatest factors (2, m) that the limits allow of directions (m, axes), and of their opposites."""
    size, back = np.abs(direction), direction < 0.0
    with np.errstate(divide="ignore"):
        high, low = limits[0] / size, limits[1] / size
    return np.stack([_least(np.where(back, low, high)), _least(np.where(back, high, low))])


def _least(values: Floats) -> Floats:
    """The least along the last axis, which is short: column by column it is faster in NumPy."""
    return reduce(np.minimum, np.moveaxis(values, -1, 0))


def _places(u0: Floats, u1: Floats, places: Floats) -> Floats:
    """u at places of parts (m, places)."""
    return np.clip(u0[:, None] + places * (u1 - u0)[:, None], u0[:, None], u1[:, None])


def _at(
    problem: Problem, parts: tuple[Integers, Floats, Floats], places: Floats, fastest: Floats
) -> tuple[Floats, Floats]:
    """|C'| and unit tangents at places of parts (m, places).

    Raises SolverError at cusps, where |C'| is 0 or far below `fastest` (n,), the greatest |C'| of each piece.
    """
    piece, u0, u1 = parts
    _, first = problem.curve.evaluate(np.repeat(piece, len(places)), _places(u0, u1, places).ravel(), 1)
    first = first.reshape(len(piece), len(places), -1)
    rate = np.linalg.norm(first, axis=2)
    cusp = rate.min(axis=1) <= CUSP * np.maximum(fastest[piece], rate.max(axis=1))
    _refuse(problem, piece[cusp], "the path has a cusp, where this method has no speed: plan with bang-bang")
    return rate, first / rate[:, :, None]


def _counts(rate: Floats, tangent: Floats, most: float) -> Integers:
    """The number of parts into which each part is to be cut: 1 where its direction and ln |C'| change by at
    most `most`."""
    turn = np.linalg.norm(np.diff(tangent, axis=1), axis=2).sum(axis=1)
    change = np.maximum(turn, np.abs(np.diff(np.log(rate), axis=1)).sum(axis=1))
    return np.where(change > most, np.ceil(change / STEP), 1.0).astype(np.int64)


def _cut(piece: Integers, u0: Floats, u1: Floats, count: Integers) -> tuple[Integers, Floats, Floats]:
    """Parts cut into equal parts. The end of a part equals the start of the next exactly."""
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    start, end, parts = np.repeat(u0, count), np.repeat(u1, count), np.repeat(count, count)
    at = start + np.stack([number, number + 1]) / parts * (end - start)
    return np.repeat(piece, count), at[0], np.where(number + 1 == parts, end, at[1])


def _speed(problem: Problem, piece: Integers, tangent: Floats) -> Floats:
    """The smaller of the feed and the speed that the axis velocities allow in a direction [mm/s]."""
    by_axis = in_direction(problem.limits("velocity"), tangent)
    feed = problem.feed[piece]
    if problem.feed_share is not None:
        feed = _over(feed, np.linalg.norm(problem.feed_share[piece] * tangent, axis=1))
    return np.asarray(np.minimum(feed, by_axis))


def _chord_speed(problem: Problem, radius: Floats) -> Floats:
    """(2/T)·√(2ρδ − δ²) [mm/s]; for ρ < δ as for δ: no shorter step can be δ away from its chord."""
    tolerance = problem.chord_tolerance
    if not np.isfinite(tolerance):
        return np.full(len(radius), np.inf)
    radius = np.maximum(radius, tolerance)
    return np.asarray(2.0 / problem.period * np.sqrt(2.0 * radius * tolerance - tolerance**2))


def _between(problem: Problem, tangent: Floats, speed: Floats) -> Floats:
    """The speeds (m,) of parts, lowered where a velocity of an axis has its maximum between the places.

    `tangent` (m, places, axes) are the directions at the places. The greatest component of a direction along
    an axis is the peak of parabolas through three finer places.
    """
    limits = problem.limits("velocity")
    with np.errstate(divide="ignore"):
        at_places = 1.0 / np.maximum(tangent / limits[0], -tangent / limits[1]).max(axis=(1, 2))
    near = np.flatnonzero(at_places <= speed * (1.0 + STEP**2))
    fine = FINER @ tangent[near]
    bend, rise = np.diff(fine, 2, axis=1), fine[:, 2:] - fine[:, :-2]
    peak = fine[:, 1:-1].copy()
    np.subtract(peak, _over(rise**2, 8.0 * bend), out=peak, where=np.abs(rise) < 2.0 * np.abs(bend))
    use = np.maximum(peak / limits[0], -peak / limits[1]).max(axis=(1, 2))
    within = _over(np.ones(len(use)), use)
    lower = speed.copy()
    lower[near] = np.where(within < speed[near] * (1.0 - LOWERED), within, speed[near])
    return lower


def _over(top: Floats, bottom: Floats, otherwise: float = np.inf) -> Floats:
    """top / bottom, `otherwise` where bottom is 0."""
    quotient = np.full(np.broadcast_shapes(top.shape, bottom.shape), otherwise)
    with np.errstate(over="ignore"):
        np.divide(top, bottom, out=quotient, where=np.broadcast_to(bottom != 0.0, quotient.shape))
    return quotient


def _refuse(problem: Problem, pieces: Integers, sentence: str) -> None:
    if len(pieces):
        raise SolverError(f"{at_line(int(problem.path.line[pieces[0]]))}{sentence}")

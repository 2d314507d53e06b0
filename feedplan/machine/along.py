"""Joint motion along polynomial pieces of a tip path: exact derivatives at points, proven bounds over pieces.

A piece is given by Bézier points (n, d + 1, axes) of the tip, in the order of `Kinematics.tip_names`, over
u in [0, width]; with weights (n, d + 1) it is rational. K is evaluated on Taylor series in u: at points with
array coefficients, over whole pieces with interval coefficients. An enclosure is drawn together by Taylor's
theorem about the middle of the piece, which makes all orders below the highest nearly as narrow as the range:

    t_k(u) ∈ Σ_{j<m−k} C(k+j, j) t_{k+j}(u_m) [−r, r]^j + C(m, k) T_m [−r, r]^{m−k},   r half the width
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers.interval import Interval, dot
from feedplan.machine.numbers.series import Series

Array = NDArray[np.float64]
HALF_TURN = 180.0
CHUNK = 2048


def positions(kinematics: Kinematics, tip: Array) -> Array:
    """Joint positions (n, joints) [mm, deg] for tips (n, axes); angles as K gives them, not continuous."""
    joints = kinematics.joints(tuple(np.moveaxis(np.asarray(tip), -1, 0)))
    return np.stack(np.broadcast_arrays(*joints), axis=-1)


def derivatives(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    fraction: Array,
    order: int = 3,
    weights: Array | None = None,
) -> Array:
    """q, q', …, q^(order) (order + 1, n, joints) at u = fraction · width of each piece.

    Exact but for rounding; not finite where K is singular. To have many points of a piece, repeat it.
    """
    result = []
    for some in _chunks(len(control_points)):
        own = None if weights is None else weights[some]
        tip = _point_series(control_points[some], width[some], fraction[some], order, own)
        joints = [_series(joint, tip[0]).derivatives() for joint in kinematics.joints(tip)]
        result.append(np.stack(joints, axis=-1))
    return np.concatenate(result, axis=1)


def enclosures(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    order: int,
    parts: Array | None = None,
    weights: Array | None = None,
) -> Interval:
    """Intervals (order + 1, n, joints) that hold q^(k)(u)/k! for every u of each piece, rounding included.

    `parts` (n, 2) are fractions of the pieces to look at instead, in [0, 1]. A coefficient is unbounded where
    K is singular on the part, or too near to singular to tell: cut the part smaller. Angles known up to whole
    turns are continuous over the part, whichever turn they are on.
    """
    result = []
    for some in _chunks(len(control_points)):
        points, length, rational = _restricted(control_points, width, parts, weights, some)
        with np.errstate(all="ignore"):
            whole = _joints(kinematics, _tip_series(points, length, order, rational, None))
            middle = _joints(kinematics, _tip_series(points, length, order, rational, 0.5))
            result.append(_drawn_together(whole, middle, length.hi / 2, np.array(kinematics.turning)))
    return Interval(*(np.concatenate([getattr(r, end) for r in result], axis=1) for end in ("lo", "hi")))


def proxy_constants(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    nodes: int,
    parts: Array | None = None,
    weights: Array | None = None,
) -> Array:
    """c ≥ |q^(n+2)|/(n + 1)! (n, joints) on each part, for interpolation of q'' at n = `nodes` points.

    With h the part's width in u, q'' is then met within 2 (n + 1) c (h/4)^n at Chebyshev points. Infinite
    where the part must be cut smaller. The direct enclosure is used: drawing the highest order together
    would take orders above it, at twice the cost for a third fewer parts.
    """
    result = []
    for some in _chunks(len(control_points)):
        points, length, rational = _restricted(control_points, width, parts, weights, some)
        with np.errstate(all="ignore"):
            tip = _tip_series(points, length, nodes + 2, rational, None)
            top = _joints(kinematics, tip)[nodes + 2]
            result.append(np.nextafter(top.magnitude * (nodes + 2), np.inf))
    return np.concatenate(result)


def _chunks(count: int) -> list[slice]:
    """Rows to work on at once: long paths must not fill the memory with coefficients of every order."""
    return [slice(start, start + CHUNK) for start in range(0, max(count, 1), CHUNK)]


def _point_series(
    control_points: Array, width: Array, fraction: Array, order: int, weights: Array | None
) -> list[Series]:
    """Taylor series of the tip's coordinates at one point of each piece.

    With weights points are counted from the nearer end, lest the derivatives beside a cusp there be lost in
    the digits of its place.
    """
    points = np.asarray(control_points)
    if weights is not None:
        origin = np.where(np.asarray(fraction)[:, None] < 0.5, points[:, 0], points[:, -1])
        points = points - origin[:, None]
        points = np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)
    degree = points.shape[1] - 1
    coefficients = np.zeros((order + 1, points.shape[0], points.shape[2]), dtype=points.dtype)
    t = np.asarray(fraction)[:, None, None]
    for k in range(min(order, degree) + 1):
        level = points
        for _ in range(degree - k):
            level = (1 - t) * level[:, :-1] + t * level[:, 1:]
        coefficients[k] = math.comb(degree, k) * level[:, 0] / np.asarray(width)[:, None] ** k
        points = np.diff(points, axis=1)
    series = [Series(coefficients[..., i]) for i in range(coefficients.shape[2])]
    if weights is None:
        return series
    return [axis / series[-1] + start for axis, start in zip(series[:-1], origin.T, strict=True)]


def _restricted(
    control_points: Array, width: Array, parts: Array | None, weights: Array | None, some: slice
) -> tuple[Interval, Interval, bool]:
    """Bézier points (homogeneous with weights) and width of parts, by the blossom b_i = B(a^(d−i), b^i)."""
    points, length = Interval(control_points[some]), Interval(width[some])
    if weights is not None:
        weights = weights[some]
        weighted = points * weights[..., None]
        homogeneous = [
            np.concatenate([end, weights[..., None]], axis=-1) for end in (weighted.lo, weighted.hi)
        ]
        points = Interval(*homogeneous)
    if parts is None:
        return points, length, weights is not None
    parts = parts[some]
    degree = points.shape[1] - 1
    result = Interval.zeros(points.shape)
    for i in range(degree + 1):
        level = points
        for step in range(degree):
            t = Interval(parts[:, 1 if step < i else 0][:, None, None])
            level = level[:, :-1] * (1.0 - t) + level[:, 1:] * t
        result[:, i] = level[:, 0]
    return result, (Interval(parts[:, 1]) - parts[:, 0]) * length, weights is not None


def _tip_series(
    points: Interval, length: Interval, order: int, rational: bool, fraction: float | None
) -> list[Series]:
    """Series with interval coefficients: over the whole piece, by the hull of Bézier points, or at one."""
    degree = points.shape[1] - 1
    coefficients = Interval.zeros((order + 1, points.shape[0], points.shape[2]))
    scale = Interval(np.ones_like(length.lo))
    for k in range(min(order, degree) + 1):
        level = points
        if fraction is None:
            value = level.hull(axis=1)
        else:
            for _ in range(degree - k):
                level = level[:, :-1] * (1.0 - fraction) + level[:, 1:] * fraction
            value = level[:, 0]
        coefficients[k] = value * float(math.comb(degree, k)) * scale[:, None]
        points = points[:, 1:] - points[:, :-1]
        scale = scale / length
    series = [Series(coefficients[..., i]) for i in range(coefficients.shape[2])]
    return [axis / series[-1] for axis in series[:-1]] if rational else series


def _joints(kinematics: Kinematics, tip: Sequence[Series]) -> Interval:
    """Coefficients (order + 1, n, joints) of all joints."""
    joints = [_series(joint, tip[0]).coefficients for joint in kinematics.joints(tip)]
    return Interval(np.stack([j.lo for j in joints], axis=-1), np.stack([j.hi for j in joints], axis=-1))


def _series(value: Any, like: Series) -> Series:
    """A joint that K gives as a constant, as a series."""
    return value if isinstance(value, Series) else like * 0.0 + value


def _drawn_together(whole: Interval, middle: Interval, radius: Array, turning: NDArray[np.bool_]) -> Interval:
    """What both the direct enclosure and Taylor's theorem about the middle allow."""
    order = whole.shape[0] - 1
    powers = Interval.zeros((order + 1, len(radius), 1))
    powers[0], powers[1:2] = 1.0, Interval(-radius[:, None], radius[:, None])
    for j in range(2, order + 1):
        powers[j] = powers[j // 2].square() if j % 2 == 0 else powers[j - 1] * powers[1]
    result = whole[:]
    for k in range(order):
        ahead = np.array([float(math.comb(k + j, j)) for j in range(order - k)])[:, None, None]
        value = dot(middle[k:order], powers[: order - k] * ahead)
        value = value + whole[order] * powers[order - k] * float(math.comb(order, k))
        if k == 0:
            value = _same_turn(value, whole[0], turning)
        result[k] = whole[k].meet(value)
    return result


def _same_turn(value: Interval, like: Interval, turning: NDArray[np.bool_]) -> Interval:
    """Angles moved by whole turns onto the turn of `like`; unbounded where both are too wide to tell."""
    turns = np.where(turning, np.nan_to_num(np.round((like.middle - value.middle) / (2 * HALF_TURN))), 0.0)
    moved = value + turns * (2 * HALF_TURN)
    unclear = turning & ~(0.5 * (value.width + like.width) < HALF_TURN)
    return Interval(np.where(unclear, -np.inf, moved.lo), np.where(unclear, np.inf, moved.hi))

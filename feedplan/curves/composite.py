"""Curves of any degree: Bézier curves, B-splines and NURBS as connected Bézier pieces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import Curve
from feedplan.arguments import flag, instance, is_number, is_whole, number, positive, refuse, shown
from feedplan.array_arguments import floats, places, point_array, refuse_where, whole_numbers
from feedplan.arrays import Flags, Floats, Integers
from feedplan.errors import InputError
from feedplan.native import OfNative
from feedplan.units import counted

MAX_DEGREE = 9


@dataclass(frozen=True, eq=False)
class CompositeCurve(OfNative[Curve]):
    """Bézier pieces C_i(u), u in [0, width_i], each of its own degree 1 to 9, polynomial or rational.

    `control_points` (total, axes) [mm, or degrees on rotary axes]: the degree_i + 1 points of piece i are
    those from `offsets[i]` up to (not including) `offsets[i + 1]`; `weights` (total,), all 1 where a piece is
    polynomial, or None if all pieces are; `offsets` (n + 1,); `width` (n,) of the parameter intervals. All
    are read-only.

    Raises InputError for columns that do not fit together and values that cannot be used.
    """

    control_points: Floats
    weights: Floats | None
    offsets: Integers
    width: Floats

    def __post_init__(self) -> None:
        control, weights = point_array(self.control_points, self.weights)
        offsets = np.ascontiguousarray(whole_numbers(self.offsets, "offsets"), dtype=np.int64)
        self._hold(Curve(control, weights, offsets, floats(self.width, "widths", 1)))

    @classmethod
    def from_pieces(cls, control_points: ArrayLike, width: ArrayLike) -> CompositeCurve:
        """Polynomial pieces of one degree d, from control points (n, d + 1, axes) and widths (n,)."""
        control = floats(control_points, "control points", 3)
        count, points_each, axes = control.shape
        return cls(
            control.reshape(-1, axes), None, np.arange(count + 1) * points_each, floats(width, "widths")
        )

    @classmethod
    def from_bezier(
        cls, control_points: ArrayLike, weights: ArrayLike | None = None, width: float = 1.0
    ) -> CompositeCurve:
        """One piece from its control points (degree + 1, axes), rational with `weights` (degree + 1,)."""
        control, weight = point_array(control_points, weights)
        if not 2 <= len(control) <= MAX_DEGREE + 1:
            raise InputError(
                f"a Bézier curve of {len(control)} control points: 2 to {MAX_DEGREE + 1} are supported "
                f"(degrees 1 to {MAX_DEGREE}); split the curve"
            )
        size = number(width, "the width", "a positive number", positive)
        return cls(control, weight, np.array([0, len(control)]), np.array([size]))

    @classmethod
    def from_bspline(
        cls,
        control_points: Any,
        knots: ArrayLike | None = None,
        degree: int | None = None,
        *,
        periodic: bool = False,
    ) -> CompositeCurve:
        """A B-spline from n control points (n, axes), n + degree + 1 `knots` and `degree`, as in
        `from_nurbs`; or from a `scipy.interpolate.BSpline` given as `control_points`.

        The curve of a scipy spline is the spline on its base interval [t[k], t[n]], which does not depend on
        the kind of extrapolation; a periodic spline is closed there.
        """
        if knots is None and degree is None:
            spline = control_points
            if not all(hasattr(spline, name) for name in "tck"):
                raise InputError(
                    f"a B-spline is given as {type(spline).__name__}: give control points, knots and degree, "
                    "or an object with t, c and k as scipy's BSpline"
                )
            knots, degree = spline.t, int(spline.k)
            # scipy allows more coefficients than the knots use.
            control_points = np.asarray(spline.c)[: max(len(spline.t) - degree - 1, 0)]
        if knots is None or degree is None:
            raise InputError("a B-spline needs control points, knots and degree: one of them is missing")
        return cls.from_nurbs(control_points, knots, degree, None, periodic=periodic)

    @classmethod
    def from_nurbs(
        cls,
        control_points: ArrayLike,
        knots: ArrayLike,
        degree: int,
        weights: ArrayLike | None = None,
        *,
        periodic: bool = False,
    ) -> CompositeCurve:
        """A NURBS curve from n control points (n, axes), n + degree + 1 `knots` and `weights` (n,).

        The knots may be clamped or not: the curve is on [knots[degree], knots[n]], and its pieces are the
        spans. With `periodic` the n control points and n + 1 knots are one period of a closed curve; its
        first span belongs to the first degree + 1 points.

        Raises InputError for lists that do not fit together and values that cannot be used.
        """
        control, weight = point_array(control_points, weights)
        around = flag(periodic, "periodic")
        knots = floats(knots, "knots", 1)
        return cls.of(Curve.of_spline(control, weight, knots, _degree(degree), around))

    @classmethod
    def joined(cls, curves: Sequence[CompositeCurve], gap: float = 1e-6) -> CompositeCurve:
        """Several curves as one; from the end of each to the start of the next it is at most `gap` [mm]."""
        remedy = "a list of at least one CompositeCurve"
        if not isinstance(curves, Sequence) or not all(isinstance(curve, CompositeCurve) for curve in curves):
            raise refuse("curves", curves, remedy)
        if not curves:
            raise InputError("no curves to join: give at least one")
        number(gap, "the gap", "0 or more [mm]", lambda given: given >= 0)
        for i, (before, after) in enumerate(pairwise(curves)):
            if before.axes != after.axes:
                raise InputError(
                    f"curve {i} has {before.axes} axes and curve {i + 1} has {after.axes}: give all the same"
                )
            miss = float(np.linalg.norm(after.control_points[0] - before.control_points[-1]))
            if not miss <= gap:
                raise InputError(
                    f"curve {i + 1} starts {miss:g} mm from the end of curve {i}: at most {gap:g} mm is "
                    "allowed; add a line between them or move one"
                )
        weights = None
        if any(curve.weights is not None for curve in curves):
            weights = np.concatenate(
                [np.ones(len(c.control_points)) if c.weights is None else c.weights for c in curves]
            )
        counts = np.concatenate([np.diff(curve.offsets) for curve in curves])
        return cls(
            np.concatenate([curve.control_points for curve in curves]),
            weights,
            np.concatenate([[0], np.cumsum(counts)]),
            np.concatenate([curve.width for curve in curves]),
        )

    def __len__(self) -> int:
        return len(self.width)

    def __repr__(self) -> str:
        kind = "rational" if self.weights is not None else "polynomial"
        axes = f"{self.axes} {'axis' if self.axes == 1 else 'axes'}"
        return f"<CompositeCurve of {counted(len(self), f'{kind} piece')} in {axes}>"

    def __getitem__(self, pieces: slice) -> CompositeCurve:
        """Consecutive pieces."""
        first, last, step = instance(pieces, slice, "pieces", "a slice").indices(len(self))
        if step != 1:
            raise InputError(f"pieces in steps of {step}: take consecutive ones")
        return self.take(np.arange(first, max(last, first)))

    def take(self, pieces: NDArray[np.integer]) -> CompositeCurve:
        """The pieces with these indices (m,), in this order; they need not be connected."""
        rows, offsets = rows_of(self.offsets, pieces)
        weights = None if self.weights is None else self.weights[rows]
        return CompositeCurve(self.control_points[rows], weights, offsets, self.width[pieces])

    @property
    def rational(self) -> Flags:
        """Whether each piece is rational with weights that differ (n,)."""
        if self.weights is None:
            return np.zeros(len(self), dtype=bool)
        first = np.repeat(self.weights[self.offsets[:-1]], np.diff(self.offsets))
        return np.logical_or.reduceat(self.weights != first, self.offsets[:-1])

    @property
    def axes(self) -> int:
        """Number of axes."""
        return int(self.control_points.shape[1])

    @property
    def degree(self) -> Integers:
        """Degree of each piece (n,)."""
        return np.diff(self.offsets) - 1

    @property
    def by_piece(self) -> Floats:
        """Control points (n, d + 1, axes) if all pieces have the same degree d.

        Raises InputError where the degrees differ.
        """
        if len(self) == 0:
            return np.empty((0, 3, self.axes))
        degree = int(self.offsets[1] - self.offsets[0]) - 1
        refuse_where(
            self.degree != degree, lambda i: f"piece {i} has degree {self.degree[i]}, others {degree}"
        )
        return np.ascontiguousarray(self.control_points).reshape(len(self), degree + 1, self.axes)

    @property
    def weights_by_piece(self) -> Floats | None:
        """Weights (n, d + 1) for the points of `by_piece`, or None where all pieces are polynomial."""
        return None if self.weights is None else self.weights.reshape(self.by_piece.shape[:2])

    def evaluate(self, piece: ArrayLike, u: ArrayLike, order: int = 0) -> Floats:
        """C and its derivatives by u to `order` ≤ 3 at places (m,): (order + 1, m, axes)."""
        if not is_whole(order, 0, 3):
            raise InputError(f"derivatives to order {shown(order)}: orders 0 to 3 are supported")
        return self.native.evaluate(*places(piece, u), int(order))

    def reversed(self) -> CompositeCurve:
        """The curve traversed backwards."""
        return self.of(self.native.reversed())

    def elevated(self, degree: int) -> CompositeCurve:
        """The same curve, with the degree of every piece of a lower degree raised to `degree`."""
        return self.of(self.native.elevated(_degree(degree)))

    def split(self, piece: ArrayLike, u: ArrayLike) -> CompositeCurve:
        """The same curve with pieces cut at places (m,); cuts at their ends and repeated cuts do nothing."""
        pieces, at = places(piece, u)
        order = np.lexsort((at, pieces))
        pieces, at = pieces[order], at[order]
        new = np.ones(len(at), dtype=bool)
        new[1:] = (np.diff(pieces) != 0) | (np.diff(at) != 0)
        inside = pieces < len(self)
        new[inside] &= (at[inside] != 0) & (at[inside] != self.width[pieces[inside]])
        return self.of(self.native.split(pieces[new], at[new]))

    def with_width(self, width: ArrayLike) -> CompositeCurve:
        """The same pieces with other widths of their parameter intervals (n,), or one width for all."""
        array = floats(width, "widths").reshape(np.shape(width))
        if array.ndim and array.shape != self.width.shape:
            raise InputError(f"{array.shape} widths for {len(self)} pieces: give one for each, or one number")
        return CompositeCurve(
            self.control_points, self.weights, self.offsets, np.broadcast_to(array, self.width.shape)
        )

    @property
    def has_length(self) -> Flags:
        """Whether each piece has control points that differ (n,)."""
        first = np.repeat(self.control_points[self.offsets[:-1]], np.diff(self.offsets), axis=0)
        apart = (self.control_points != first).any(axis=1)
        return np.logical_or.reduceat(apart, self.offsets[:-1])


def rows_of(offsets: Integers, pieces: NDArray[np.integer]) -> tuple[Integers, Integers]:
    """The rows of the given pieces (m,) in this order, where piece i has the rows from `offsets[i]` up to
    `offsets[i + 1]`; and the offsets (m + 1,) of the pieces in these rows."""
    counts = np.diff(offsets)[pieces]
    taken = np.concatenate([[0], np.cumsum(counts)])
    return np.repeat(offsets[pieces] - taken[:-1], counts) + np.arange(taken[-1]), taken


def _degree(degree: int) -> int:
    if not is_whole(int(degree) if is_number(degree) and degree == degree // 1 else degree, most=MAX_DEGREE):
        raise InputError(
            f"the degree is {shown(degree)}: degrees 1 to {MAX_DEGREE} are supported; convert the curve"
        )
    return int(degree)

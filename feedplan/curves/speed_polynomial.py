"""The square of the speed, |C'(u)|², along Bézier pieces, as a polynomial of the parameter on each piece."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats, Integers
from feedplan.curves.composite import CompositeCurve, rows_of

# Number of Chebyshev points at which |C'|² of rational pieces is interpolated.
SPEED_NODES = 12


@dataclass(frozen=True, eq=False)
class SpeedPolynomial:
    """(v/u̇)² for a speed v, as a polynomial on each piece.

    `coefficients` (total,) are Bernstein coefficients in u; those of piece i are from `offsets[i]` up to (not
    including) `offsets[i + 1]`; `offsets` (n + 1,).
    """

    coefficients: Floats
    offsets: Integers

    @classmethod
    def of(cls, curve: CompositeCurve) -> SpeedPolynomial:
        """|C'(u)|² of a curve.

        Exact on polynomial pieces; on rational ones |C'|² is interpolated at `SPEED_NODES` Chebyshev points.
        """
        rational = curve.rational
        count = np.where(rational, SPEED_NODES, 2 * curve.degree - 1)
        offsets = np.concatenate([[0], np.cumsum(count)])
        coefficients = np.zeros(int(offsets[-1]))
        rows = np.flatnonzero(rational)
        coefficients[offsets[rows][:, None] + np.arange(SPEED_NODES)] = interpolated_squares(
            lambda piece, u: (curve.evaluate(piece, u, 1)[1] ** 2).sum(axis=1), rows, curve.width[rows]
        )
        first = curve.offsets[:-1]
        for d in np.unique(curve.degree[~rational]).tolist():
            rows = np.flatnonzero((curve.degree == d) & ~rational)
            points = curve.control_points[first[rows][:, None] + np.arange(d + 1)]
            slope = d * np.diff(points, axis=1) / curve.width[rows][:, None, None]
            # With coefficients scaled by binomials, the product of polynomials is a convolution.
            scaled = slope * _binomials(d - 1)[:, None]
            square = np.zeros((len(rows), 2 * d - 1))
            for i in range(d):
                square[:, i : i + d] += (scaled[:, i : i + 1] * scaled).sum(axis=2)
            coefficients[offsets[rows][:, None] + np.arange(2 * d - 1)] = square / _binomials(2 * d - 2)
        return cls(coefficients, offsets)

    @classmethod
    def joined(cls, parts: Sequence[SpeedPolynomial]) -> SpeedPolynomial:
        """The polynomials of several curves, one after the other."""
        counts = np.concatenate([np.diff(part.offsets) for part in parts])
        coefficients = np.concatenate([part.coefficients for part in parts])
        return cls(coefficients, np.concatenate([[0], np.cumsum(counts)]))

    def __getitem__(self, pieces: slice) -> SpeedPolynomial:
        """The polynomials of consecutive pieces."""
        return self.take(np.arange(pieces.start, pieces.stop))

    def take(self, pieces: NDArray[np.integer]) -> SpeedPolynomial:
        """The polynomials of the given pieces (m,), in this order."""
        rows, offsets = rows_of(self.offsets, pieces)
        return SpeedPolynomial(self.coefficients[rows], offsets)

    def evaluate(self, piece: NDArray[np.integer], t: Floats) -> Floats:
        """The square at fractions t (m,) of the parameter intervals of pieces (m,)."""
        counts = np.diff(self.offsets)[piece]
        square = np.empty(len(t))
        for count in np.unique(counts).tolist():
            own = counts == count
            values = self.coefficients[self.offsets[piece[own]][:, None] + np.arange(count)].T
            while len(values) > 1:
                values = values[:-1] + (values[1:] - values[:-1]) * t[own]
            square[own] = values[0]
        return square


def interpolated_squares(
    square: Callable[[Integers, Floats], Floats], piece: Integers, width: Floats
) -> Floats:
    """Bernstein coefficients (n, SPEED_NODES) of the polynomials that interpolate a function of piece and u
    on the given pieces (n,)."""
    u = (width[:, None] * chebyshev(SPEED_NODES)).ravel()
    values = square(np.repeat(piece, SPEED_NODES), u).reshape(-1, SPEED_NODES)
    return np.asarray(np.einsum("ij,nj->ni", to_bernstein(SPEED_NODES), values))


def to_bernstein(count: int) -> Floats:
    """The matrix (count, count) that turns values at `chebyshev(count)` into Bernstein coefficients."""
    return np.ascontiguousarray(np.linalg.inv(_bernstein(count - 1, chebyshev(count))))


def interpolation(count: int, at: Floats) -> Floats:
    """The matrix (places, count) that turns values at `chebyshev(count)` into values at places in [0, 1]."""
    matrix: Floats = _bernstein(count - 1, at) @ to_bernstein(count)
    return matrix


def _bernstein(degree: int, at: Floats) -> Floats:
    """The values (places, degree + 1) of the Bernstein polynomials."""
    power = np.arange(degree + 1)
    values: Floats = _binomials(degree) * at[:, None] ** power * (1 - at[:, None]) ** (degree - power)
    return values


def chebyshev(count: int) -> Floats:
    """The Chebyshev points of [0, 1]."""
    nodes: Floats = 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return nodes


def _binomials(degree: int) -> Floats:
    return np.array([math.comb(degree, i) for i in range(degree + 1)], dtype=np.float64)

"""The speed along Bézier pieces as a polynomial of the parameter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from feedplan.curves.composite import CompositeCurve

Array = NDArray[np.float64]


def speed_squares(curve: CompositeCurve) -> tuple[Array, NDArray[np.int64]]:
    """Bernstein coefficients (total,) of |C'(u)|² ω⁴ on each piece and their offsets (n + 1,).

    ω is the weight function divided by the piece's first weight; 1 where a piece is polynomial.
    """
    degree = curve.degree
    weights = np.ones(len(curve.control_points)) if curve.weights is None else curve.weights
    first = curve.offsets[:-1]
    even = np.logical_and.reduceat(weights == np.repeat(weights[first], degree + 1), first)
    offsets = np.concatenate([[0], np.cumsum(np.where(even, 2 * degree - 1, 4 * degree - 3))])
    result = np.zeros(int(offsets[-1]))
    for d in np.unique(degree).tolist():
        for polynomial in (True, False):
            rows = np.flatnonzero((degree == d) & (even == polynomial))
            if not len(rows):
                continue
            own = first[rows][:, None] + np.arange(d + 1)
            # About the first point, for the digits.
            points = curve.control_points[own] - curve.control_points[first[rows]][:, None]
            if polynomial:
                slope = _scaled(d * np.diff(points, axis=1))
            else:
                weight = weights[own][..., None] / weights[first[rows]][:, None, None]
                slope = _wronskian(_scaled(points * weight), _scaled(weight))
            square = _product(slope, slope).sum(axis=2)
            square /= _binomials(square.shape[1] - 1) * curve.width[rows][:, None] ** 2
            result[offsets[rows][:, None] + np.arange(square.shape[1])] = square
    return result, offsets


def from_chebyshev(values: Array) -> Array:
    """Bernstein coefficients (n, m) of the polynomials with these values (n, m) at `chebyshev(m)`."""
    count = values.shape[1]
    coefficients: Array = values @ np.linalg.inv(_bernstein(count - 1, chebyshev(count))).T
    return coefficients


def interpolation(count: int, at: Array) -> Array:
    """The matrix (places, count) that takes values at `chebyshev(count)` to those at places in [0, 1]."""
    basis = _bernstein(count - 1, chebyshev(count))
    matrix: Array = _bernstein(count - 1, at) @ np.linalg.inv(basis)
    return matrix


def _bernstein(degree: int, at: Array) -> Array:
    """The values (places, degree + 1) of the Bernstein polynomials."""
    power = np.arange(degree + 1)
    values: Array = _binomials(degree) * at[:, None] ** power * (1 - at[:, None]) ** (degree - power)
    return values


def chebyshev(count: int) -> Array:
    """The Chebyshev points of [0, 1]."""
    nodes: Array = 0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return nodes


def _binomials(degree: int) -> Array:
    return np.array([math.comb(degree, i) for i in range(degree + 1)], dtype=np.float64)


def _scaled(bernstein: Array) -> Array:
    """Bernstein coefficients (n, d + 1, axes) times binomials: products are then convolutions."""
    scaled: Array = bernstein * _binomials(bernstein.shape[1] - 1)[:, None]
    return scaled


def _product(a: Array, b: Array) -> Array:
    result = np.zeros((len(a), a.shape[1] + b.shape[1] - 1, a.shape[2]))
    for i in range(a.shape[1]):
        result[:, i : i + b.shape[1]] += a[:, i : i + 1] * b
    return result


def _wronskian(p: Array, q: Array) -> Array:
    """p' q − p q' of scaled coefficients of one degree n, itself of degree 2 n − 2."""
    n = p.shape[1] - 1
    result = np.zeros((len(p), 2 * n - 1, p.shape[2]))
    for a in range(n + 1):
        for b in range(a + 1, n + 1):
            result[:, a + b - 1] += (b - a) * (p[:, b] * q[:, a] - p[:, a] * q[:, b])
    return result

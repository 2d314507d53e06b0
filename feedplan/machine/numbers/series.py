"""Truncated Taylor series: coefficients f_k = f^(k)(u)/k! of a function of u, carried through a formula.

Griewank and Walther, Evaluating Derivatives (2nd ed. 2008), section 13.2: each elementary function satisfies
a linear differential equation, so its coefficient k is a sum over the ones before. With h = f g, q = f/g,
r = √f,

    h_k = Σ_{j≤k} f_j g_{k−j}
    q_k = (f_k − Σ_{j<k} q_j g_{k−j}) / g_0
    r_k = (f_k − Σ_{0<j<k} r_j r_{k−j}) / (2 r_0)
    s_k = (1/k) Σ_{0<j≤k} j f_j c_{k−j},   c_k = −(1/k) Σ_{0<j≤k} j f_j s_{k−j}      (sine, cosine of f)
    a_k = (n_{k−1} − Σ_{0<j<k} j a_j d_{k−j}) / (k d_0),   d = x² + y²,  n = x y' − y x'      (atan2(y, x))

Coefficients are an array or an `Interval` whose first axis is k; the rest is any number of pieces or points
at once. Over intervals that hold f_k for every u of a piece, the result holds q_k for every u of the piece
(Moore 1966; Tucker, Validated Numerics, 2011, chapter 6).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from feedplan.machine.numbers import elementary
from feedplan.machine.numbers.interval import Interval, dot, whole_power


class Series:
    """A series to the order of its coefficients: `coefficients[k]` is the factor of (u − u0)^k."""

    __slots__ = ("coefficients",)
    __array_ufunc__ = None

    def __init__(self, coefficients: Any) -> None:
        self.coefficients = coefficients

    @property
    def order(self) -> int:
        """The highest power kept."""
        return int(self.coefficients.shape[0]) - 1

    def derivatives(self) -> Any:
        """f, f', f'', …: the coefficients times k!."""
        factors = [float(math.factorial(k)) for k in range(self.order + 1)]
        return self.coefficients * _column(factors, len(self.coefficients.shape))

    def __neg__(self) -> Series:
        return Series(-self.coefficients)

    def __pos__(self) -> Series:
        return self

    def __add__(self, other: Any) -> Series:
        if isinstance(other, Series):
            return Series(self.coefficients + other.coefficients)
        result = _copy(self.coefficients)
        result[0] = result[0] + other
        return Series(result)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Series:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Series:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Series:
        if other is self:
            return Series.square(self)
        if not isinstance(other, Series):
            return Series(self.coefficients * other)
        f, g = self.coefficients, other.coefficients
        return self._filled(lambda k, _: _dot(f[: k + 1], g[k::-1]))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        if not isinstance(other, Series):
            return Series(self.coefficients / other)
        return self._over(other)

    def _over(self, other: Series) -> Series:
        f, g = self.coefficients, other.coefficients

        def term(k: int, q: Any) -> Any:
            return (f[k] - _dot(q[:k], g[k:0:-1]) if k else f[0]) / g[0]

        return self._filled(term)

    def __rtruediv__(self, other: Any) -> Series:
        return self._constant(other)._over(self)

    def __pow__(self, exponent: int) -> Series:
        result: Series = whole_power(self, exponent)
        return result

    def square(self) -> Series:
        """f²: half the products, and none of them dependent on itself."""
        f = self.coefficients

        def term(k: int, _: Any) -> Any:
            half = (k + 1) // 2
            middle = None if k % 2 else elementary.square(f[k // 2])
            if half == 0:
                return middle
            twice = 2.0 * _dot(f[:half], f[k : k - half : -1])
            return twice if middle is None else twice + middle

        return self._filled(term)

    def sqrt(self) -> Series:
        """√f."""
        f = self.coefficients

        def term(k: int, r: Any) -> Any:
            if k == 0:
                return elementary.sqrt(f[0])
            rest = f[k] if k == 1 else f[k] - _dot(r[1:k], r[k - 1 : 0 : -1])
            return rest / (2.0 * r[0])

        return self._filled(term)

    def sin_cos(self) -> tuple[Series, Series]:
        """Sine and cosine, in radians."""
        slope = _slope(self.coefficients)
        sine, cosine = _empty(self.coefficients), _empty(self.coefficients)
        with np.errstate(all="ignore"):
            sine[0], cosine[0] = elementary.sin_cos(self.coefficients[0])
            for k in range(1, self.order + 1):
                sine[k] = _dot(slope[:k], cosine[k - 1 :: -1]) / float(k)
                cosine[k] = -_dot(slope[:k], sine[k - 1 :: -1]) / float(k)
        return Series(sine), Series(cosine)

    @staticmethod
    def atan2(y: Any, x: Any) -> Series:
        """The angle of the vector (x, y) in radians; over intervals continuous on the whole piece."""
        if not isinstance(y, Series):
            y = x._constant(y)
        if not isinstance(x, Series):
            x = y._constant(x)
        distance = (x.square() + y.square()).coefficients
        a, b = x.coefficients, y.coefficients
        a_slope, b_slope = _slope(a), _slope(b)
        result = _empty(distance)
        slope = _slope(result)
        with np.errstate(all="ignore"):
            result[0] = elementary.atan2(b[0], a[0])
            for k in range(1, y.order + 1):
                rest = _dot(a[k - 1 :: -1], b_slope[:k]) - _dot(b[k - 1 :: -1], a_slope[:k])
                if k > 1:
                    rest = rest - _dot(slope[: k - 1], distance[k - 1 : 0 : -1])
                slope[k - 1] = rest / distance[0]
                result[k] = slope[k - 1] / float(k)
        return Series(result)

    def radians(self) -> Series:
        """Degrees as radians."""
        return Series(elementary.radians(self.coefficients))

    def degrees(self) -> Series:
        """Radians as degrees."""
        return Series(elementary.degrees(self.coefficients))

    def _filled(self, term: Callable[[int, Any], Any]) -> Series:
        """Coefficient after coefficient; `term(k, result)` may read the ones before k."""
        result = _empty(self.coefficients)
        with np.errstate(all="ignore"):
            for k in range(self.order + 1):
                result[k] = term(k, result)
        return Series(result)

    def _constant(self, value: Any) -> Series:
        zeros = _empty(self.coefficients)
        zeros[0] = zeros[0] + value
        return Series(zeros)


def _empty(like: Any) -> Any:
    return Interval.zeros(like.shape) if isinstance(like, Interval) else np.zeros_like(like)


def _copy(coefficients: Any) -> Any:
    if isinstance(coefficients, Interval):
        return Interval(coefficients.lo.copy(), coefficients.hi.copy())
    return coefficients.copy()


def _column(values: list[float], dimensions: int) -> Any:
    return np.array(values).reshape((-1,) + (1,) * (dimensions - 1))


def _slope(coefficients: Any) -> Any:
    """Coefficients of the derivative: (k + 1) f_{k+1}."""
    order = coefficients.shape[0] - 1
    return coefficients[1:] * _column([float(k) for k in range(1, order + 1)], len(coefficients.shape))


def _dot(left: Any, right: Any) -> Any:
    """Σ left_k right_k along the first axis."""
    if isinstance(left, Interval) or isinstance(right, Interval):
        return dot(Interval.of(left), Interval.of(right))
    return np.einsum("k...,k...->...", left, right)

"""Intervals [lo, hi] of float64 arrays, rounded outward: every result contains the exact one.

Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009); Tucker, Validated Numerics (2011).
Rounding outward is done by subtracting |lo| ε and adding |hi| ε, ε = 2^-52, which is at least one unit in the
last place where numpy's operation is wrong by half a unit at most; it is several times cheaper than switching
the rounding mode or `nextafter`. A result that is not defined (0 in a divisor, the angle of a box that holds
the origin) is the whole line and raises nothing: the caller sees an unbounded interval and cuts it smaller.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

EPSILON = 2.0**-52
# More than the absolute error of any product that underflows.
TINY = 2.0**-1072
# numpy's own tests allow its sine, cosine and arc tangent 4 units in the last place.
ELEMENTARY_ULPS = 8.0
# π/180 and 180/π between float64 neighbours.
_RADIAN = (0.017453292519943295, 0.0174532925199433)
_DEGREE = (57.295779513082316, 57.29577951308232)
Array = NDArray[np.float64]


class Interval:
    """Arrays `lo` ≤ `hi` of one shape."""

    __slots__ = ("hi", "lo")
    # Keeps numpy from looping over an interval in `array + interval`.
    __array_ufunc__ = None

    def __init__(self, lo: ArrayLike, hi: ArrayLike | None = None) -> None:
        self.lo: Array = np.asarray(lo, dtype=np.float64)
        self.hi: Array = self.lo if hi is None else np.asarray(hi, dtype=np.float64)

    @classmethod
    def of(cls, value: Any) -> Interval:
        """An interval as it is, a number as the interval that holds it alone."""
        return value if isinstance(value, Interval) else cls(value)

    @classmethod
    def zeros(cls, shape: tuple[int, ...]) -> Interval:
        """Exact zeros."""
        return cls(np.zeros(shape), np.zeros(shape))

    @property
    def shape(self) -> tuple[int, ...]:
        """The common shape of both ends."""
        return self.lo.shape

    @property
    def width(self) -> Array:
        """hi − lo."""
        with np.errstate(all="ignore"):
            return np.nan_to_num(self.hi - self.lo, nan=np.inf, posinf=np.inf)

    @property
    def magnitude(self) -> Array:
        """The greatest absolute value inside."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    @property
    def middle(self) -> Array:
        """A number inside, about half way; not a number where unbounded."""
        with np.errstate(invalid="ignore"):
            return 0.5 * self.lo + 0.5 * self.hi

    @property
    def bounded(self) -> NDArray[np.bool_]:
        """Where both ends are finite."""
        return np.isfinite(self.lo) & np.isfinite(self.hi)

    def __repr__(self) -> str:
        return f"Interval({self.lo!r}, {self.hi!r})"

    def __getitem__(self, key: Any) -> Interval:
        return Interval(self.lo[key], self.hi[key])

    def __setitem__(self, key: Any, value: Any) -> None:
        value = Interval.of(value)
        self.lo[key] = value.lo
        self.hi[key] = value.hi

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __pos__(self) -> Interval:
        return self

    def __add__(self, other: Any) -> Interval:
        if not _scalar(other):
            return NotImplemented
        other = Interval.of(other)
        with np.errstate(all="ignore"):
            return _rounded(self.lo + other.lo, self.hi + other.hi)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Interval:
        if not _scalar(other):
            return NotImplemented
        return self.__add__(-Interval.of(other))

    def __rsub__(self, other: Any) -> Interval:
        return self.__neg__().__add__(other)

    def __mul__(self, other: Any) -> Interval:
        if not _scalar(other):
            return NotImplemented
        if other is self:
            return Interval.square(self)
        with np.errstate(all="ignore"):
            return _rounded(*_products(self, Interval.of(other)), TINY)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Interval:
        if not _scalar(other):
            return NotImplemented
        return self.__mul__(Interval.of(other).reciprocal())

    def __rtruediv__(self, other: Any) -> Interval:
        return self.reciprocal().__mul__(other)

    def __pow__(self, exponent: int) -> Interval:
        result: Interval = whole_power(self, exponent)
        return result

    def reciprocal(self) -> Interval:
        """1/x; the whole line where x may be 0."""
        with np.errstate(all="ignore"):
            through = (self.lo <= 0) & (self.hi >= 0)
            lo = np.where(through, -np.inf, 1.0 / self.hi)
            hi = np.where(through, np.inf, 1.0 / self.lo)
            return _rounded(lo, hi, TINY)

    def square(self) -> Interval:
        """x², never below 0."""
        with np.errstate(all="ignore"):
            low, high = np.abs(self.lo), np.abs(self.hi)
            least = np.where((self.lo <= 0) & (self.hi >= 0), 0.0, np.minimum(low, high))
            most = np.maximum(low, high)
            result = _rounded(least * least, most * most, TINY)
        return Interval(np.maximum(result.lo, 0.0), result.hi)

    def sqrt(self) -> Interval:
        """√x; the whole line where x may be negative."""
        with np.errstate(all="ignore"):
            result = _rounded(np.sqrt(self.lo), np.sqrt(self.hi))
        return result

    def sin_cos(self) -> tuple[Interval, Interval]:
        """Sine and cosine, in radians."""
        return self._wave(0.25, np.sin), self._wave(0.0, np.cos)

    def _wave(self, crest: float, function: Any) -> Interval:
        """A sine wave whose crests are at `crest` + whole turns."""
        with np.errstate(all="ignore"):
            at_lo, at_hi = function(self.lo), function(self.hi)
            result = _rounded(np.minimum(at_lo, at_hi), np.maximum(at_lo, at_hi), TINY, ELEMENTARY_ULPS)
            # Turns, widened by more than their rounding: a crest taken in by mistake only costs width.
            first, last = self.lo / (2 * np.pi) - crest, self.hi / (2 * np.pi) - crest
            slack = 4 * EPSILON * (1.0 + np.maximum(np.abs(first), np.abs(last)))
            first, last = first - slack, last + slack
            crested = np.floor(last) >= np.ceil(first)
            troughed = np.floor(last + 0.5) >= np.ceil(first + 0.5)
            unknown = ~self.bounded
            hi = np.where(crested | unknown, 1.0, np.minimum(result.hi, 1.0))
            lo = np.where(troughed | unknown, -1.0, np.maximum(result.lo, -1.0))
        return Interval(lo, hi)

    @staticmethod
    def atan2(y: Any, x: Any) -> Interval:
        """The angle of the box x × y as seen from the origin, continuous over the whole box.

        The middle of the box has its angle in (−π, π]; the ends may lie beyond. The whole line where the box
        holds the origin. A box without the origin is seen under less than π, between two of its corners.
        """
        y, x = Interval.of(y), Interval.of(x)
        with np.errstate(all="ignore"):
            holds = (x.lo <= 0) & (x.hi >= 0) & (y.lo <= 0) & (y.hi >= 0)
            centre = np.arctan2(y.middle, x.middle)
            corners = np.stack(
                np.broadcast_arrays(*(np.arctan2(b, a) - centre for a in (x.lo, x.hi) for b in (y.lo, y.hi)))
            )
            corners -= 2 * np.pi * np.round(corners / (2 * np.pi))
            # Seen under a straight angle, to rounding: which way round the box lies is not certain.
            holds |= np.abs(corners).max(axis=0) > np.pi - 1e-9
            slack = ELEMENTARY_ULPS * EPSILON * (2 * np.pi)
            lo = np.where(holds, -np.inf, centre + corners.min(axis=0) - slack)
            hi = np.where(holds, np.inf, centre + corners.max(axis=0) + slack)
            return _rounded(lo, hi)

    def radians(self) -> Interval:
        """Degrees as radians."""
        return self * Interval(*_RADIAN)

    def degrees(self) -> Interval:
        """Radians as degrees."""
        return self * Interval(*_DEGREE)

    def hull(self, axis: int = 0) -> Interval:
        """The least interval around all along an array axis."""
        return Interval(self.lo.min(axis=axis), self.hi.max(axis=axis))

    def meet(self, other: Interval) -> Interval:
        """What is in both; both are known to hold the same number."""
        return Interval(np.fmax(self.lo, other.lo), np.fmin(self.hi, other.hi))


def dot(left: Interval, right: Interval) -> Interval:
    """Σ left_k right_k over the first array axis, with one rounding bound for the whole sum.

    Products and a sum of n terms in any order are wrong by n u Σ|products| at most to first order, u = ε/2
    (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.1); twice that covers the rest.
    """
    with np.errstate(all="ignore"):
        lo, hi = _products(left, right)
        terms = float(lo.shape[0] + 2)
        pad = terms * EPSILON * np.maximum(np.abs(lo), np.abs(hi)).sum(axis=0) + terms * TINY
        return _rounded(lo.sum(axis=0) - pad, hi.sum(axis=0) + pad)


def whole_power(x: Any, exponent: int) -> Any:
    """x to a whole power ≥ 1 by squaring."""
    if exponent != int(exponent) or exponent < 1:
        raise ValueError(f"power {exponent}: only whole powers from 1 on; use sqrt and division for others")
    if exponent == 1:
        return x
    half = whole_power(x, exponent // 2).square()
    return half * x if exponent % 2 else half


def _scalar(value: Any) -> bool:
    return isinstance(value, (Interval, np.ndarray, float, int, np.floating, np.integer))


def _products(left: Interval, right: Interval) -> tuple[Array, Array]:
    """The least and the greatest product of two intervals' ends, not yet rounded outward."""
    first, second = left.lo * right.lo, left.lo * right.hi
    third, fourth = left.hi * right.lo, left.hi * right.hi
    lo = np.minimum(np.minimum(first, second), np.minimum(third, fourth))
    hi = np.maximum(np.maximum(first, second), np.maximum(third, fourth))
    return lo, hi


def _rounded(lo: Array, hi: Array, tiny: float = 0.0, ulps: float = 1.0) -> Interval:
    """Rounded outward by `ulps` units in the last place; what is not a number becomes the whole line."""
    lo = lo - (np.abs(lo) * (ulps * EPSILON) + tiny)
    hi = hi + (np.abs(hi) * (ulps * EPSILON) + tiny)
    if not (np.isfinite(lo).all() and np.isfinite(hi).all()):
        unknown = np.isnan(lo) | np.isnan(hi)
        lo, hi = np.where(unknown, -np.inf, lo), np.where(unknown, np.inf, hi)
    return Interval(lo, hi)

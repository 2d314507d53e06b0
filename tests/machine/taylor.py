"""Taylor series in numpy: evaluates formulas of kinematics independently of the native code.

Each elementary function uses the recurrence of its differential equation, in extended precision.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.machine.kinematics import Kinematics

Long = NDArray[np.longdouble]
PI = np.arctan2(np.longdouble(0), np.longdouble(-1))


class Series:
    """Coefficients (order + 1, …) of a power series in u."""

    __array_ufunc__ = None

    def __init__(self, coefficients: Any) -> None:
        self.c = np.asarray(coefficients, dtype=np.longdouble)

    def _of(self, value: Any) -> Series:
        if isinstance(value, Series):
            return value
        constant = np.zeros_like(self.c)
        constant[0] = value
        return Series(constant)

    def __neg__(self) -> Series:
        return Series(-self.c)

    def __add__(self, other: Any) -> Series:
        return Series(self.c + self._of(other).c)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Series:
        return self + -self._of(other)

    def __rsub__(self, other: Any) -> Series:
        return self._of(other) - self

    def __mul__(self, other: Any) -> Series:
        g = self._of(other).c
        return Series([sum(self.c[j] * g[k - j] for j in range(k + 1)) for k in range(len(g))])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        g, q = self._of(other).c, np.zeros_like(self.c)
        for k in range(len(g)):
            q[k] = (self.c[k] - sum(q[j] * g[k - j] for j in range(k))) / g[0]
        return Series(q)

    def __rtruediv__(self, other: Any) -> Series:
        return self._of(other) / self

    def __pow__(self, exponent: int) -> Series:
        return self if exponent == 1 else self * self ** (exponent - 1)

    def __abs__(self) -> Series:
        return Series(self.c * np.sign(self.c[0]))

    def square(self) -> Series:
        """x²."""
        return self * self

    def sqrt(self) -> Series:
        """√x."""
        r = np.zeros_like(self.c)
        r[0] = np.sqrt(self.c[0])
        for k in range(1, len(r)):
            r[k] = (self.c[k] - sum(r[j] * r[k - j] for j in range(1, k))) / (2 * r[0])
        return Series(r)

    def sin_cos(self) -> tuple[Series, Series]:
        """Sine and cosine, in radians."""
        s, c = np.zeros_like(self.c), np.zeros_like(self.c)
        s[0], c[0] = np.sin(self.c[0]), np.cos(self.c[0])
        for k in range(1, len(s)):
            s[k] = sum(j * self.c[j] * c[k - j] for j in range(1, k + 1)) / k
            c[k] = -sum(j * self.c[j] * s[k - j] for j in range(1, k + 1)) / k
        return Series(s), Series(c)

    def atan2(self, y: Any, x: Any) -> Series:
        """The angle of the vector (x, y) [rad], from its derivative (x y' − y x') / (x² + y²)."""
        y, x = self._of(y), self._of(x)
        steps = np.arange(1, len(y.c)).reshape(-1, *[1] * (y.c.ndim - 1))
        dy, dx = (Series(np.concatenate([v.c[1:] * steps, 0 * v.c[:1]])) for v in (y, x))
        slope = (x * dy - y * dx) / (x * x + y * y)
        return Series(np.concatenate([np.arctan2(y.c[:1], x.c[:1]), slope.c[:-1] / steps]))

    def radians(self) -> Series:
        """Degrees as radians."""
        return Series(self.c * (PI / 180))

    def degrees(self) -> Series:
        """Radians as degrees."""
        return Series(self.c * (180 / PI))


def derivatives(
    kinematics: Kinematics, control_points: Any, width: Any, fraction: Any, order: int = 3
) -> Long:
    """q, q', …, q^(order) (order + 1, n, joints) at fractions of polynomial pieces, in extended precision."""
    points = np.asarray(control_points, dtype=np.longdouble)
    width, t = np.asarray(width, np.longdouble), np.asarray(fraction, np.longdouble)[:, None, None]
    degree = points.shape[1] - 1
    coefficients = np.zeros((order + 1, len(points), points.shape[2]), dtype=np.longdouble)
    for k in range(min(order, degree) + 1):
        level = points
        while level.shape[1] > 1:
            level = (1 - t) * level[:, :-1] + t * level[:, 1:]
        coefficients[k] = math.comb(degree, k) * level[:, 0] / width[:, None] ** k
        points = np.diff(points, axis=1)
    tip = [Series(coefficients[..., i]) for i in range(coefficients.shape[2])]
    joints = [tip[0]._of(joint) for joint in kinematics.joints(tip)]
    factorials = np.array([math.factorial(k) for k in range(order + 1)]).reshape(-1, 1, 1)
    return np.stack([joint.c for joint in joints], axis=-1) * factorials

"""Taylor series: against series known by heart, identities, and intervals against sampled coefficients."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feedplan.machine.numbers import Interval, Series, atan2, cos, hypot, sin, sin_cos, sqrt

ORDER = 9


def variable(at: object, order: int = ORDER) -> Series:
    coefficients = np.zeros((order + 1, *np.shape(at)))
    coefficients[0] = at
    coefficients[1] = 1.0
    return Series(coefficients)


def test_the_series_of_sine_and_cosine_at_zero() -> None:
    sine, cosine = sin_cos(variable(0.0))
    assert sine.coefficients == pytest.approx([0, 1, 0, -1 / 6, 0, 1 / 120, 0, -1 / 5040, 0, 1 / 362880])
    assert cosine.coefficients[:5] == pytest.approx([1, 0, -0.5, 0, 1 / 24])


def test_the_series_of_a_reciprocal_a_root_and_an_angle() -> None:
    x = variable(0.0)
    assert (1.0 / (1.0 - x)).coefficients == pytest.approx(np.ones(ORDER + 1))
    assert sqrt(1.0 + x).coefficients[:5] == pytest.approx([1, 1 / 2, -1 / 8, 1 / 16, -5 / 128])
    assert atan2(x, 1.0).coefficients == pytest.approx([0, 1, 0, -1 / 3, 0, 1 / 5, 0, -1 / 7, 0, 1 / 9])
    assert hypot(x, 1.0).coefficients[:5] == pytest.approx([1, 0, 1 / 2, 0, -1 / 8])


def test_derivatives_are_coefficients_times_factorials() -> None:
    power = variable(2.0, 3) ** 3
    assert power.derivatives() == pytest.approx([8, 12, 12, 6])


@given(st.floats(-3, 3), st.floats(0.2, 3))
def test_identities_hold_to_every_order(u: float, scale: float) -> None:
    x = variable(u) * scale
    y = x * x + 0.5
    sine, cosine = sin_cos(x)
    one = (sine.square() + cosine.square()).coefficients
    assert one == pytest.approx(np.eye(1, ORDER + 1)[0], abs=1e-12 * scale**ORDER + 1e-12)
    for left, right in (
        (sqrt(y) * sqrt(y), y),
        (y * (x / y), x),
        (x * y - y * x, x * 0.0),
        (y.square(), y * (y + 0.0)),
        (3.0 - x, -(x - 3.0)),
        (hypot(sine * 2.0, cosine * 2.0), x * 0.0 + 2.0),
    ):
        size = np.abs(right.coefficients).max() + (100 * scale) ** ORDER * 1e-16
        assert left.coefficients == pytest.approx(right.coefficients, abs=1e-9 * (1 + size))


@given(st.floats(-3, 3))
def test_the_angle_of_sine_and_cosine_is_the_angle(u: float) -> None:
    x = variable(u)
    assert atan2(sin(x), cos(x)).coefficients == pytest.approx(x.coefficients, abs=1e-11)


def formula(x: Series) -> Series:
    return sin(x) * x / (1 + x * x) + sqrt(x + 2.0) - atan2(x * 2 - 1, x + 3.0) + hypot(x, 3.0)


@given(st.floats(-1, 1), st.floats(0, 0.05), st.floats(0, 1))
def test_a_series_over_an_interval_holds_the_series_at_each_point(lo: float, width: float, t: float) -> None:
    seed = Interval.zeros((ORDER + 1,))
    seed[0], seed[1] = Interval(lo, lo + width), Interval(1.0)
    enclosed = formula(Series(seed)).coefficients
    # Extended precision: the interval at a point is narrower than float64 rounding of the reference.
    point = np.zeros(ORDER + 1, dtype=np.longdouble)
    point[0] = min(np.longdouble(lo) + np.longdouble(t) * np.longdouble(width), np.longdouble(lo + width))
    point[1] = 1
    exact = formula(Series(point)).coefficients
    assert (enclosed.lo <= exact).all()
    assert (exact <= enclosed.hi).all()


def test_the_enclosure_of_a_point_is_as_narrow_as_rounding() -> None:
    seed = Interval.zeros((ORDER + 1,))
    seed[0], seed[1] = Interval(0.3), Interval(1.0)
    enclosed = formula(Series(seed)).coefficients
    assert (enclosed.width <= 1e-13 * (1 + enclosed.magnitude) * 3.0 ** np.arange(ORDER + 1)).all()


def test_many_points_at_once_are_the_points_one_by_one() -> None:
    at = np.array([0.1, 0.4, 2.0])
    together = formula(variable(at)).coefficients
    for i, u in enumerate(at):
        assert together[:, i] == pytest.approx(formula(variable(u)).coefficients, rel=1e-13)


def test_only_whole_powers_are_taken() -> None:
    with pytest.raises(ValueError, match="whole powers"):
        variable(1.0) ** 0.5  # type: ignore[operator]
    assert math.isclose((variable(2.0) ** 5).coefficients[0], 32.0)

"""Intervals hold the exact result: against rational arithmetic and extended precision."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feedplan.machine.numbers import Interval, atan2, cos, degrees, hypot, radians, sin, sqrt
from feedplan.machine.numbers.interval import dot

numbers = st.floats(-1e6, 1e6)


def holds(interval: Interval, value: Fraction) -> bool:
    lo, hi = float(interval.lo), float(interval.hi)
    return (lo == -np.inf or Fraction(lo) <= value) and (hi == np.inf or value <= Fraction(hi))


def test_a_tenth_times_three_is_not_a_point() -> None:
    product = Interval(0.1) * 3.0
    assert holds(product, Fraction(0.1) * 3)
    assert 0 < product.width < 3e-16


def test_a_square_is_never_negative_where_a_product_may_be() -> None:
    x = Interval(-1.0, 2.0)
    assert (float(x.square().lo), float((x * Interval(-1.0, 2.0)).lo)) == (0.0, pytest.approx(-2.0))
    assert float((x * x).lo) == 0.0


def test_what_is_not_defined_is_the_whole_line() -> None:
    for result in (
        1.0 / Interval(-1.0, 1.0),
        sqrt(Interval(-1.0, 1.0)),
        atan2(Interval(-1.0, 1.0), Interval(-1.0, 1.0)),
        Interval(0.0, np.inf) * Interval(0.0),
    ):
        assert not result.bounded
        assert (float(result.lo), float(result.hi)) == (-np.inf, np.inf)


def test_underflow_still_holds_the_product() -> None:
    assert holds(Interval(1e-200) * 1e-200, Fraction(1e-200) ** 2)
    assert holds(Interval(5e-324) / 3.0, Fraction(5e-324) / 3)


@given(numbers, numbers, numbers, numbers)
def test_arithmetic_holds_the_rational_result(a: float, b: float, c: float, d: float) -> None:
    x, y = Interval(min(a, b), max(a, b)), Interval(min(c, d), max(c, d))
    for p in (a, b):
        for q in (c, d):
            assert holds(x + y, Fraction(p) + Fraction(q))
            assert holds(x - y, Fraction(p) - Fraction(q))
            assert holds(x * y, Fraction(p) * Fraction(q))
            assert holds(x**3, Fraction(p) ** 3)
            if not y.lo <= 0 <= y.hi:
                assert holds(x / y, Fraction(p) / Fraction(q))


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=12))
def test_a_sum_of_products_holds_the_rational_sum(pairs: list[tuple[float, float]]) -> None:
    left, right = (np.array(column) for column in zip(*pairs, strict=True))
    result = dot(Interval(left), Interval(right))
    assert holds(result, sum((Fraction(a) * Fraction(b) for a, b in pairs), Fraction(0)))


@given(numbers, st.floats(0, 10), st.floats(0, 1))
def test_functions_hold_extended_precision_inside(lo: float, width: float, share: float) -> None:
    x = Interval(lo, lo + width)
    inside = np.longdouble(lo) + np.longdouble(share) * (np.longdouble(x.hi) - np.longdouble(lo))
    pi = np.arctan2(np.longdouble(0), np.longdouble(-1))
    for result, value in (
        (sin(x), np.sin(inside)),
        (cos(x), np.cos(inside)),
        (sqrt(x.square()), np.abs(inside)),
        (hypot(x, 3.0), np.hypot(inside, np.longdouble(3))),
        (radians(x), inside * pi / 180),
        (degrees(x), inside / pi * 180),
        (atan2(x, 2.0), np.arctan2(inside, np.longdouble(2))),
    ):
        assert result.lo <= value <= result.hi


def test_a_sine_over_a_crest_reaches_one() -> None:
    x = Interval([0.1, 1.5, 2.0, -2.0, 0.0], [0.2, 1.6, 3.0, -1.0, 7.0])
    assert sin(x).hi == pytest.approx([np.sin(0.2), 1, np.sin(2), np.sin(-1), 1])
    assert sin(x).lo == pytest.approx([np.sin(0.1), np.sin(1.5), np.sin(3), -1, -1])


def test_the_angle_of_a_box_is_continuous_across_the_cut() -> None:
    angle = degrees(atan2(Interval([-1.0, 1.0]), Interval([-10.0, -10.0], [-9.0, 9.0])))
    across = degrees(atan2(Interval(-1.0, 1.0), Interval(-10.0, -9.0)))
    assert float(across.lo) == pytest.approx(180 - np.degrees(np.arctan2(1, 9)))
    assert float(across.hi) == pytest.approx(180 + np.degrees(np.arctan2(1, 9)))
    assert angle.bounded.all()


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0, 3), st.floats(0, 3), st.floats(0, 1), st.floats(0, 1))
def test_the_angle_of_a_box_holds_every_point_seen(
    x: float, y: float, w: float, h: float, s: float, t: float
) -> None:
    box = atan2(Interval(y, y + h), Interval(x, x + w))
    if box.bounded:
        value = np.arctan2(np.longdouble(y) + t * np.longdouble(h), np.longdouble(x) + s * np.longdouble(w))
        turn = 2 * np.arctan2(np.longdouble(0), np.longdouble(-1))
        assert any(box.lo <= value + k * turn <= box.hi for k in (-1, 0, 1))
        assert box.width < np.pi + 1e-13

"""Recorded formulas: their values, proven bounds against rational numbers, and refused operations."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from feedplan import MachineError
from feedplan.machine.expression import Op
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import (
    Number,
    atan2,
    cos,
    degrees,
    hypot,
    radians,
    sin,
    sin_cos,
    sqrt,
    square,
)
from feedplan.machine.path_derivatives import derivatives, positions
from tests.machine import taylor
from tests.machine.enclosures import Enclosures, enclosures

Array = NDArray[np.float64]
Formula = Callable[..., Number]
ORDER = 9
numbers = st.floats(-1e6, 1e6)


class Formulas(Kinematics):
    """A kinematics with one joint for each formula of x and y."""

    tip_names = ("X", "Y")

    def __init__(self, *formulas: Formula) -> None:
        self.formulas = formulas
        self.joint_names = tuple(f"Q{i}" for i in range(len(formulas)))

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        return tuple(formula(*tip) for formula in self.formulas)


def over(x: tuple[float, float], y: tuple[float, float], *formulas: Formula, order: int = 0) -> Enclosures:
    """Bounds (order + 1, joints) for a piece along the diagonal of a box in x and y."""
    found = enclosures(Formulas(*formulas), np.array([[[x[0], y[0]], [x[1], y[1]]]]), [1.0], order)
    return Enclosures(found.lo[:, 0], found.hi[:, 0])


def series(u: float, *formulas: Formula) -> Array:
    """Taylor coefficients (ORDER + 1, joints) at u of the formulas along x = u, y = 0."""
    line = np.array([[[u, 0.0], [u + 1.0, 0.0]]])
    found = derivatives(Formulas(*formulas), line, [1.0], [0.0], ORDER)[:, 0]
    return found / np.array([[math.factorial(k)] for k in range(ORDER + 1)])


def holds(lo: float, hi: float, value: Fraction) -> bool:
    return (lo == -np.inf or Fraction(lo) <= value) and (hi == np.inf or value <= Fraction(hi))


def test_the_list_names_every_result_once() -> None:
    recorded = Formulas(
        lambda x, y: hypot(x, y), lambda x, y: sqrt(x * x + y * y) + 1.0, lambda x, y: 3.0
    ).recorded
    assert [Op(code).name for code in recorded.operations[:, 0]] == [
        "SQUARE",
        "SQUARE",
        "SUM",
        "ROOT",
        "SHIFT",
        "CONSTANT",
    ]
    assert recorded.inputs == 2
    assert recorded.outputs.tolist() == [5, 6, 7]


def test_weighted_sums_are_affine_and_other_formulas_are_not() -> None:
    assert Formulas(
        lambda x, y: 0.5 * (x + y), lambda x, y: 1.0 - x, lambda x, y: 3.0, lambda x, y: degrees(y)
    ).affine
    for formula in (lambda x, y: x * y, lambda x, y: x**2, lambda x, y: x / y, lambda x, y: sqrt(x)):
        assert not Formulas(lambda x, y: x + y, formula).affine


def test_a_formula_is_called_once() -> None:
    calls = []

    def formula(x: Number, y: Number) -> Number:
        calls.append(x)
        return x + y

    kinematics = Formulas(formula)
    for _ in range(3):
        assert positions(kinematics, [[1.0, 2.0], [3.0, 4.0]])[:, 0].tolist() == [3.0, 7.0]
    assert len(calls) == 1
    again = pickle.loads(pickle.dumps(kinematics.recorded))
    assert (again.operations == kinematics.recorded.operations).all()


def test_positions_are_what_the_formulas_give_for_arrays() -> None:
    formulas = (
        lambda x, y: 2.0 / x - y / 3.0 + x**3 * -y,
        lambda x, y: abs(x - y) + square(y) - (1.0 - x),
        lambda x, y: sin(x) * cos(y) + sin_cos(x)[1] - np.float64(2.0) * x,
        lambda x, y: degrees(atan2(y, x)) + atan2(1.0, x) + radians(y) + atan2(y, 2.0),
        lambda x, y: np.float64(1.0) + x / np.float64(4.0) - np.float64(3.0) / y,
    )
    x, y = np.random.default_rng(1).uniform(0.5, 3.0, size=(2, 300))
    found = positions(Formulas(*formulas), np.stack([x, y], axis=1))
    for column, formula in zip(found.T, formulas, strict=True):
        assert column == pytest.approx(formula(x, y), rel=1e-13, abs=1e-14)


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        (lambda x, y: x if x > 0.0 else y, "compares a coordinate"),
        (lambda x, y: x if x == y else y, "compares a coordinate"),
        (lambda x, y: x or y, "branches on a coordinate"),
        (lambda x, y: max(x, y), "compares a coordinate"),
        (lambda x, y: math.sqrt(x), "asks for the value of a coordinate"),
        (lambda x, y: np.sin(x), "uses numpy's sin"),
        (lambda x, y: np.array([1.0, 2.0]) * x, "uses numpy's multiply"),
        (lambda x, y: x**0.5, "takes the power 0.5; only whole powers from 1 on are known"),
        (lambda x, y: x ** (-1), "takes the power -1; only whole powers"),
        (lambda x, y: 2.0**x, "takes a power with a coordinate as exponent; only whole powers"),
        (lambda x, y: x**y, "takes a power with a coordinate as exponent; only whole powers"),
        (lambda x, y: x % 2.0, "divides a coordinate with a remainder"),
        (lambda x, y: round(x), "rounds a coordinate"),
        (lambda x, y: "far", "gives 'far' as a joint position"),
        (lambda x, y: math.nan, "gives nan as a joint position"),
    ],
)
def test_what_cannot_be_recorded_is_refused_in_one_sentence(formula: Formula, words: str) -> None:
    with pytest.raises(MachineError) as caught:
        Formulas(formula).recorded  # noqa: B018
    sentence = str(caught.value)
    assert f"the kinematics Formulas {words}" in sentence
    assert "write joints() as one formula for all places" in sentence
    assert "feedplan.machine.numbers" in sentence
    assert "\n" not in sentence


def test_every_joint_needs_a_position() -> None:
    kinematics = Formulas(lambda x, y: x)
    kinematics.joint_names = ("U", "V")
    with pytest.raises(MachineError, match="gives 1 joint positions: give one for each of U, V"):
        kinematics.recorded  # noqa: B018
    Forgotten = type("Forgotten", (Formulas,), {"joints": lambda self, tip: None})
    with pytest.raises(MachineError, match="Forgotten gives None in place of the joint positions: write"):
        Forgotten(lambda x, y: x).recorded  # noqa: B018


def test_the_series_of_sine_and_cosine_at_zero() -> None:
    sine, cosine = series(0.0, lambda x, y: sin(x), lambda x, y: cos(x)).T
    assert sine == pytest.approx([0, 1, 0, -1 / 6, 0, 1 / 120, 0, -1 / 5040, 0, 1 / 362880])
    assert cosine[:5] == pytest.approx([1, 0, -0.5, 0, 1 / 24])


def test_the_series_of_a_reciprocal_a_root_and_an_angle() -> None:
    found = series(
        0.0,
        lambda x, y: 1.0 / (1.0 - x),
        lambda x, y: sqrt(1.0 + x),
        lambda x, y: atan2(x, 1.0),
        lambda x, y: hypot(x, 1.0),
    ).T
    assert found[0] == pytest.approx(np.ones(ORDER + 1))
    assert found[1, :5] == pytest.approx([1, 1 / 2, -1 / 8, 1 / 16, -5 / 128])
    assert found[2] == pytest.approx([0, 1, 0, -1 / 3, 0, 1 / 5, 0, -1 / 7, 0, 1 / 9])
    assert found[3, :5] == pytest.approx([1, 0, 1 / 2, 0, -1 / 8])


def formula(x: Number, y: Number) -> Number:
    return sin(x) * x / (1 + x * x) + sqrt(x + 2.0) - atan2(x * 2 - 1, x + 3.0) + hypot(x, 3.0)


@given(st.floats(-1, 1), st.floats(0, 0.05), st.floats(0, 1))
def test_a_series_over_an_interval_holds_the_series_at_each_point(lo: float, width: float, t: float) -> None:
    width = max(width, 1e-9)
    line = np.array([[[lo, 0.0], [lo + width, 0.0]]])
    bounds = enclosures(Formulas(formula), line, [width], ORDER)
    point = taylor.derivatives(Formulas(formula), line, [width], [t], ORDER)[:, 0, 0]
    exact = point / np.array([math.factorial(k) for k in range(ORDER + 1)])
    assert (bounds.lo[:, 0, 0] <= exact).all()
    assert (exact <= bounds.hi[:, 0, 0]).all()


def test_the_enclosure_of_a_point_is_as_narrow_as_rounding() -> None:
    line = np.array([[[0.3, 0.0], [0.3 + 2.0**-48, 0.0]]])
    bounds = enclosures(Formulas(formula), line, [2.0**-48], ORDER)
    width = (bounds.hi - bounds.lo)[:, 0, 0]
    assert (width <= 1e-13 * (1 + bounds.magnitude[:, 0, 0]) * 3.0 ** np.arange(ORDER + 1)).all()


@given(numbers, numbers, numbers, numbers)
def test_bounds_of_arithmetic_hold_the_rational_result(a: float, b: float, c: float, d: float) -> None:
    box = over(
        (a, b),
        (c, d),
        lambda x, y: x + y,
        lambda x, y: x - y,
        lambda x, y: x * y,
        lambda x, y: x**3,
        lambda x, y: x / y,
    )
    for p in (Fraction(a), Fraction(b)):
        for q in (Fraction(c), Fraction(d)):
            exact = [p + q, p - q, p * q, p**3]
            if (c > 0 and d > 0) or (c < 0 and d < 0):
                exact.append(p / q)
            for lo, hi, value in zip(box.lo[0], box.hi[0], exact, strict=False):
                assert holds(lo, hi, value)


@given(numbers, st.floats(0, 10), st.floats(0, 1))
def test_bounds_of_functions_hold_extended_precision(start: float, width: float, share: float) -> None:
    end = start + width
    inside = np.longdouble(start) + np.longdouble(share) * (np.longdouble(end) - np.longdouble(start))
    box = over(
        (start, end),
        (0.0, 0.0),
        lambda x, y: sin(x),
        lambda x, y: cos(x),
        lambda x, y: sqrt(square(x)),
        lambda x, y: hypot(x, 3.0),
        lambda x, y: radians(x),
        lambda x, y: degrees(x),
        lambda x, y: atan2(x, 2.0),
    )
    exact = (
        np.sin(inside),
        np.cos(inside),
        np.abs(inside),
        np.hypot(inside, np.longdouble(3)),
        inside * taylor.PI / 180,
        inside / taylor.PI * 180,
        np.arctan2(inside, np.longdouble(2)),
    )
    for lo, hi, value in zip(box.lo[0], box.hi[0], exact, strict=True):
        assert lo <= value <= hi


def test_what_is_not_defined_is_unbounded() -> None:
    box = over(
        (-1.0, 1.0),
        (-1.0, 1.0),
        lambda x, y: 1.0 / x,
        lambda x, y: sqrt(x),
        lambda x, y: atan2(y, x),
        lambda x, y: x / 0.0,
    )
    assert not box.bounded.any()
    assert (box.lo[0] == -np.inf).all()
    assert (box.hi[0] == np.inf).all()


def test_a_square_is_never_negative_where_a_product_may_be() -> None:
    box = over((-1.0, 2.0), (-1.0, 2.0), lambda x, y: x * x, lambda x, y: x * y)
    assert box.lo[0] == pytest.approx([0.0, -2.0])
    assert box.lo[0, 0] == 0.0


def test_a_sine_over_a_crest_reaches_one() -> None:
    for lo, hi, least, most in (
        (0.1, 0.2, np.sin(0.1), np.sin(0.2)),
        (1.5, 1.6, np.sin(1.5), 1.0),
        (2.0, 3.0, np.sin(3), np.sin(2)),
        (-2.0, -1.0, -1.0, np.sin(-1)),
        (0.0, 7.0, -1.0, 1.0),
    ):
        box = over((lo, hi), (0.0, 0.0), lambda x, y: sin(x))
        assert (box.lo[0, 0], box.hi[0, 0]) == (pytest.approx(least), pytest.approx(most))


def test_the_angle_of_a_box_is_continuous_across_the_cut() -> None:
    box = over((-10.0, -9.0), (-1.0, 1.0), lambda x, y: degrees(atan2(y, x)))
    lean = np.degrees(np.arctan2(1, 9))
    assert (box.lo[0, 0], box.hi[0, 0]) == (pytest.approx(180 - lean), pytest.approx(180 + lean))


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0, 3), st.floats(0, 3), st.floats(0, 1), st.floats(0, 1))
def test_the_angle_of_a_box_holds_every_point_seen(
    x: float, y: float, w: float, h: float, s: float, t: float
) -> None:
    box = over((x, x + w), (y, y + h), lambda x, y: atan2(y, x))
    lo, hi = box.lo[0, 0], box.hi[0, 0]
    if np.isfinite(hi - lo):
        value = np.arctan2(np.longdouble(y) + t * np.longdouble(h), np.longdouble(x) + s * np.longdouble(w))
        assert any(lo <= value + k * 2 * taylor.PI <= hi for k in (-1, 0, 1))
        assert hi - lo < np.pi + 1e-13

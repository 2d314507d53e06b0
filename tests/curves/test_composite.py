"""Curves of any degree against hand-made values, scipy and exact rational arithmetic."""

from __future__ import annotations

import copy
import json
import pickle
from fractions import Fraction
from itertools import pairwise
from math import comb
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from tests.continuity import Joint, at, breakpoints, is_closed, joints

BUTTERFLY = Path(__file__).parents[2] / "benchmarks/curves/butterfly.json"
SEEDS = st.integers(0, 2**32 - 1)


def random_knots(rng: np.random.Generator, points: int, degree: int, clamped: bool) -> NDArray[np.float64]:
    """Random knots, some repeated, but never so often that the curve is disconnected."""
    steps = rng.uniform(0.2, 2.0, points + degree + 1)
    steps[rng.uniform(size=len(steps)) < 0.3] = 0.0
    steps[[degree + 1, points]] = 1.0
    knots = np.cumsum(steps) - 3.0
    for i in range(degree, len(knots)):
        if knots[i] == knots[i - degree]:
            knots[i:] += 0.5
    if clamped:
        knots[: degree + 1], knots[points:] = knots[degree], knots[points]
    return knots


def butterfly() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    data = json.loads(BUTTERFLY.read_text())
    return np.array(data["control_points"]), np.array(data["knots"]), np.array(data["weights"], dtype=float)


def fractions_at(curve: CompositeCurve, piece: int, u: float) -> list[list[Fraction]]:
    """C to C''' by the quotient rule in exact arithmetic."""
    rows = slice(curve.offsets[piece], curve.offsets[piece + 1])
    points = [[Fraction(float(x)) for x in row] for row in curve.control_points[rows]]
    weights = [Fraction(1)] * len(points)
    if curve.weights is not None:
        weights = [Fraction(float(w)) for w in curve.weights[rows]]
    width, d = Fraction(float(curve.width[piece])), len(points) - 1
    t = Fraction(u) / width

    def bernstein(values: list[Fraction]) -> list[Fraction]:
        found = []
        for order in range(4):
            n = d - order
            found.append(
                sum((comb(n, i) * t**i * (1 - t) ** (n - i) * v for i, v in enumerate(values)), Fraction(0))
                if n >= 0
                else Fraction(0)
            )
            values = [n * (b - a) / width for a, b in pairwise(values)]
        return found

    w = bernstein(weights)
    derivatives: list[list[Fraction]] = [[] for _ in range(4)]
    for axis in range(curve.axes):
        m = bernstein([w_i * p[axis] for w_i, p in zip(weights, points, strict=True)])
        c: list[Fraction] = []
        for r in range(4):
            c.append(
                (m[r] - sum((comb(r, j) * w[j] * c[r - j] for j in range(1, r + 1)), Fraction(0))) / w[0]
            )
            derivatives[r].append(c[r])
    return derivatives


def assert_exact(curve: CompositeCurve, piece: int, u: float, tolerance: float) -> None:
    """Each derivative is exact to `tolerance` of its greatest component, or of its expected size if more."""
    found = curve.evaluate([piece], [u], order=3)[:, 0]
    expected = np.array(fractions_at(curve, piece, u), dtype=float)
    rows = slice(curve.offsets[piece], curve.offsets[piece + 1])
    size = np.ptp(curve.control_points[rows], axis=0).max()
    for order in range(4):
        scale = max(np.abs(expected[order]).max(), size)
        assert np.abs(found[order] - expected[order]).max() <= tolerance * scale, order
        size *= max(len(curve.control_points[rows]) - 1 - order, 1) / curve.width[piece]


def test_a_parabola_by_hand() -> None:
    curve = CompositeCurve.from_bezier([[0, 0], [1, 0], [2, 4]], width=2.0)
    value, first, second, third = curve.evaluate(0, [0.0, 1.0, 2.0], order=3)
    assert value.tolist() == [[0, 0], [1, 1], [2, 4]]
    assert first.tolist() == [[1, 0], [1, 2], [1, 4]]
    assert second.tolist() == [[0, 2]] * 3
    assert third.tolist() == [[0, 0]] * 3


@pytest.mark.parametrize("axes", range(1, 10))
def test_arrays_are_views_of_what_the_native_curve_holds(axes: int) -> None:
    points = np.random.default_rng(axes).normal(size=(5, axes))
    curve = CompositeCurve(points, [1.0, 2.0, 1.0, 1.0, 3.0], [0, 3, 5], [1.0, 0.5])
    for one in (curve, pickle.loads(pickle.dumps(curve)), copy.deepcopy(curve)):
        np.testing.assert_array_equal(one.control_points, points)
        np.testing.assert_array_equal(one.weights, [1.0, 2.0, 1.0, 1.0, 3.0])
        np.testing.assert_array_equal(one.offsets, [0, 3, 5])
        assert (one.offsets.dtype, one.width.tolist()) == (np.int64, [1.0, 0.5])
        for name in ("control_points", "weights", "offsets", "width"):
            column = getattr(one, name)
            assert np.shares_memory(column, one.native.fields()[name])
            assert not column.flags.writeable
    # A view keeps the memory alive.
    column = curve.control_points
    del curve, one
    np.testing.assert_array_equal(column, points)


def test_a_quarter_circle_is_exact() -> None:
    curve = CompositeCurve.from_bezier([[1, 0], [1, 1], [0, 1]], [1, np.sqrt(0.5), 1])
    points = curve.evaluate(0, np.linspace(0, 1, 101))[0]
    assert np.abs(np.hypot(*points.T) - 1).max() <= 3e-16
    assert points[[0, -1]].tolist() == [[1, 0], [0, 1]]


@given(SEEDS, st.integers(1, 9), st.integers(1, 6), st.booleans())
def test_values_and_derivatives_are_those_of_scipy(seed: int, degree: int, axes: int, clamped: bool) -> None:
    rng = np.random.default_rng(seed)
    points = degree + int(rng.integers(1, 12))
    knots = random_knots(rng, points, degree, clamped)
    reference = BSpline(knots, rng.normal(size=(points, axes)), degree)
    curve = CompositeCurve.from_bspline(reference)
    assert len(curve) == len(np.unique(knots[degree : points + 1])) - 1
    u = rng.uniform(0, curve.width)
    x = knots[degree] + breakpoints(curve)[:-1] + u
    found = curve.evaluate(np.arange(len(curve)), u, order=3)
    h = np.diff(np.unique(knots)).min()
    for order in range(min(degree, 3) + 1):
        expected = reference(x, nu=order)
        size = np.abs(reference.c).max() * (degree / h) ** order
        assert np.abs(found[order] - expected).max() <= 1e-13 * size


@given(SEEDS, st.integers(1, 9), st.booleans())
def test_derivatives_agree_with_exact_fractions(seed: int, degree: int, rational: bool) -> None:
    rng = np.random.default_rng(seed)
    control = rng.uniform(-100, 100, (degree + 1, 2))
    weights = 10 ** rng.uniform(-1, 1, degree + 1) if rational else None
    curve = CompositeCurve.from_bezier(control, weights, width=float(rng.uniform(0.1, 10)))
    for u in (0.0, float(rng.uniform()) * curve.width[0], curve.width[0]):
        assert_exact(curve, 0, float(u), 1e-12 if rational else 1e-14)


@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e8])
def test_weights_far_apart_keep_the_digits_of_the_value(ratio: float) -> None:
    control = [[0.0, 0], [10, 20], [30, -10], [40, 5]]
    curve = CompositeCurve.from_bezier(control, [1, ratio, 1 / ratio, 1])
    for u in (1e-6, 0.25, 0.5, 0.9, 1 - 1e-6):
        found = curve.evaluate(0, u, order=1)[:, 0]
        expected = np.array(fractions_at(curve, 0, u)[:2], dtype=float)
        assert np.abs(found[0] - expected[0]).max() <= 1e-14 * 40
        assert np.abs(found[1] - expected[1]).max() <= 1e-12 * max(np.abs(expected[1]).max(), 40)


def test_the_published_butterfly_is_exact_in_every_piece() -> None:
    control, knots, weights = butterfly()
    curve = CompositeCurve.from_nurbs(control, knots, 3, weights)
    assert len(curve) == 48
    assert curve.control_points[[0, -1]].tolist() == control[[0, -1]].tolist()
    numerator, denominator = BSpline(knots, control * weights[:, None], 3), BSpline(knots, weights, 3)
    x = np.linspace(0, 1, 1001)
    expected = numerator(x) / denominator(x)[:, None]
    assert np.abs(at(curve, np.minimum(x, breakpoints(curve)[-1]))[0] - expected).max() <= 1e-12
    for piece in range(0, 48, 5):
        assert_exact(curve, piece, float(0.3 * curve.width[piece]), 1e-12)
    assert set(joints(curve)) == {Joint.C2}


def test_knot_multiplicity_is_the_continuity_of_the_joints() -> None:
    rng = np.random.default_rng(5)
    knots = np.array([0, 0, 0, 0, 0, 1, 2, 2, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 5.0])
    curve = CompositeCurve.from_bspline(rng.normal(size=(15, 3)), knots, 4)
    assert joints(curve) == [Joint.C3, Joint.C2, Joint.C1, Joint.CORNER]


def test_scipys_periodic_spline_is_a_closed_curve() -> None:
    angle = np.linspace(0, 2 * np.pi, 13)
    points = np.stack([np.cos(angle), np.sin(2 * angle)], axis=1)
    points[-1] = points[0]
    reference = make_interp_spline(angle, points, k=5, bc_type="periodic")
    curve = CompositeCurve.from_bspline(reference)
    assert len(curve) == 12
    assert is_closed(curve)
    assert np.abs(at(curve, angle[:-1])[0] - points[:-1]).max() <= 1e-13
    assert joints(curve, closed=True) == 12 * [Joint.C3]


def test_a_periodic_curve_meets_itself_smoothly_and_has_its_wrapped_points() -> None:
    rng = np.random.default_rng(7)
    control, weights = rng.normal(size=(7, 2)), rng.uniform(0.1, 10, 7)
    knots = np.cumsum(rng.uniform(0.5, 1.5, 8))
    curve = CompositeCurve.from_nurbs(control, knots, 3, weights, periodic=True)
    assert len(curve) == 7
    assert is_closed(curve)
    assert min(joints(curve, closed=True)) >= Joint.C2
    period = knots[-1] - knots[0]
    full = np.concatenate([knots[-4:-1] - period, knots, knots[1:4] + period])
    wrapped = np.concatenate([control, control[:3]]), np.concatenate([weights, weights[:3]])
    again = CompositeCurve.from_nurbs(wrapped[0], full, 3, wrapped[1])
    assert np.abs(again.control_points - curve.control_points).max() <= 1e-14


def test_one_axis_and_unused_coefficients_of_scipy_are_taken() -> None:
    knots = [0.0, 0, 0, 1, 1, 1]
    curve = CompositeCurve.from_bspline(SimpleNamespace(t=knots, c=np.array([1.0, 2, 4, 99]), k=2))
    assert curve.control_points.tolist() == [[1], [2], [4]]


@given(SEEDS, st.integers(1, 8), st.booleans())
def test_elevating_splitting_and_turning_round_change_no_value(
    seed: int, degree: int, rational: bool
) -> None:
    rng = np.random.default_rng(seed)
    points = degree + int(rng.integers(1, 8))
    control, knots = rng.uniform(-50, 50, (points, 3)), random_knots(rng, points, degree, False)
    weights = 10 ** rng.uniform(-1, 1, points) if rational else None
    curve = CompositeCurve.from_nurbs(control, knots, degree, weights)
    end = breakpoints(curve)[-1]
    x = np.sort(rng.uniform(0, end, 20))
    expected = at(curve, x, order=2)

    def same(other: CompositeCurve, found: NDArray[np.float64]) -> None:
        assert np.abs(found[0] - expected[0]).max() <= 1e-11 * 50
        assert np.abs(found[1] - expected[1]).max() <= 1e-10 * max(np.abs(expected[1]).max(), 50)
        assert len(other) >= len(curve)

    same(raised := curve.elevated(degree + 1), at(raised, x, order=1))
    assert set(raised.degree) == {degree + 1}
    cuts = rng.integers(0, len(curve), 5)
    parts = curve.split(cuts, rng.uniform(0, curve.width[cuts]))
    same(parts, at(parts, np.minimum(x, end), order=1))
    back = curve.reversed()
    y = np.clip(breakpoints(back)[-1] - x, 0, None)
    same(back, at(back, y, order=1) * np.array([1, -1])[:, None, None])
    slower = curve.with_width(3 * curve.width)
    found = at(slower, np.minimum(3 * x, breakpoints(slower)[-1]), order=2)
    same(slower, found * np.array([1, 3, 9])[:, None, None])


def test_cutting_at_the_ends_of_pieces_changes_nothing() -> None:
    curve = CompositeCurve.from_bezier([[0.0], [1], [3]])
    assert len(curve.split([0, 0], [0.0, 1.0])) == 1
    assert curve.split([0, 0], [0.5, 0.5]).control_points.tolist() == [[0], [0.5], [1.25], [1.25], [2], [3]]


def test_pieces_of_every_kind_are_joined() -> None:
    line = CompositeCurve.from_bezier([[0.0, 0], [1, 0]])
    turn = CompositeCurve.from_bezier([[1, 0], [2, 0], [2, 1]], [1, np.sqrt(0.5), 1])
    curve = CompositeCurve.joined([line, turn])
    assert curve.degree.tolist() == [1, 2]
    assert curve.weights is not None
    assert curve.weights[:2].tolist() == [1, 1]
    assert joints(curve) == [Joint.TANGENT]
    with pytest.raises(
        InputError, match=r"curve 1 starts 2\.23607 mm from the end of curve 0: at most 1e-06 mm"
    ):
        CompositeCurve.joined([turn, line])


def test_corners_and_pieces_of_no_length_are_found() -> None:
    knots = [0, 0, 0, 1, 1, 2, 3, 3, 3]
    corner = CompositeCurve.from_bspline([[0.0, 0], [1, 1], [2, 0], [3, 1], [3, 1], [3, 1]], knots, 2)
    assert joints(corner) == [Joint.CORNER, Joint.C1]
    assert corner.has_length.tolist() == [True, True, False]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[0.0]] * 3, [0, 0, 0, 1, 1], 2), "5 knots for 3 control points of degree 2: 6 are needed"),
        (([[0.0]] * 3, [0, 0, 0, 1, 1, 0.5], 2), "knot 5 is 0.5 after 1: knots must not decrease"),
        (([[0.0]] * 3, [0, 0, 0, 1, 1, np.inf], 2), "knot 5 is inf: knots must be finite"),
        (([[0.0], [np.nan], [1]], [0, 0, 0, 1, 1, 1], 2), "control point 1, axis 0, is NaN"),
        (([[0.0]] * 2, [0, 0, 0, 1, 1], 2), "2 control points for degree 2: at least 3 are needed"),
        (
            ([[0.0]] * 3, [0, 0, 0, 1, 1, 1], 2, [1, 0, 1]),
            "weight 1 is 0: weights must be positive, from 1e-30 to 1e30",
        ),
        (([[0.0]] * 3, [0, 0, 0, 1, 1, 1], 2, [1, 1]), "2 weights for 3 control points"),
        (([[0.0]] * 3, [0, 0, 0, 0, 0, 0], 2), "the knot 0 stands 6 times from knot 0 on: at most 3"),
        (([[0.0]] * 3, [0, 1, 2, 2, 2, 3], 2), "knots 2 and 3, where the curve starts and ends, are both 2"),
        (([[0.0]] * 20, range(32), 11), "the degree is 11: degrees 1 to 9"),
        (([[0.0]] * 3, range(6), 2.5), r"the degree is 2\.5"),
        (([[0.0] * 10] * 3, range(6), 2), r"shape \(3, 10\): give \(points, axes\) with 1 to 9 axes"),
        (([[0.0], [1j]], [0, 0, 1, 1], 1), "control points are not all real numbers"),
        (([["a"], ["b"]], [0, 0, 1, 1], 1), "control points are not all real numbers"),
        (
            (np.ma.masked_less([[0.0], [1.0]], 0.5), [0, 0, 1, 1], 1),
            "control points are not all real numbers",
        ),
        (([[0.0], [1], [5], [6]], [0, 0, 1, 1, 2, 2], 1), "a gap of 4 mm at the knot 1"),
    ],
)
def test_what_is_wrong_with_a_spline_is_said(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        CompositeCurve.from_nurbs(*arguments)  # type: ignore[arg-type]


def test_places_off_the_curve_are_refused() -> None:
    curve = CompositeCurve.from_bezier([[0.0], [1]])
    with pytest.raises(InputError, match="place 1 is on piece 1: the curve has 1 pieces"):
        curve.evaluate([0, 1], 0.0)
    with pytest.raises(InputError, match=r"place 0 is at u = 1\.5 of piece 0: its parameter goes"):
        curve.evaluate(0, 1.5)
    with pytest.raises(InputError, match="pieces are counted from 0"):
        curve.evaluate(-1, 0.5)
    with pytest.raises(InputError, match="give whole numbers"):
        curve.evaluate(0.5, 0.5)


def test_columns_that_do_not_fit_are_refused() -> None:
    points = np.zeros((4, 2))
    for offsets, width, message in [
        ([0, 2, 3], [1.0, 1.0], "offsets go from 0 to 3: they must go from 0 to 4"),
        ([0, 1, 4], [1.0, 1.0], "piece 0 has degree 0"),
        ([0, 4, 2, 4], [1.0, 1.0, 1.0], "piece 1 has degree -3"),
        ([0, 4], [0.0], r"piece 0 has the width 0\.0"),
        ([0, 4], [], "2 offsets for 0 widths"),
    ]:
        with pytest.raises(InputError, match=message):
            CompositeCurve(points, None, np.array(offsets), np.array(width))
    with pytest.raises(InputError, match="a B-spline is given as int"):
        CompositeCurve.from_bspline(3)


@given(SEEDS)
def test_random_columns_make_a_curve_or_an_input_error(seed: int) -> None:
    rng = np.random.default_rng(seed)
    odd = np.array([0.0, 1, -1, np.nan, np.inf, 1e300, 1e-300, 2, 3])
    degree, points = int(rng.integers(-1, 12)), int(rng.integers(0, 8))
    control = rng.choice(odd, (points, int(rng.integers(1, 8))), p=[0.3, 0.3, 0.2, *[0.01] * 4, 0.08, 0.08])
    knots = np.sort(rng.choice([0.0, 1, 2, 3, 1e-14, 1e300], points + degree + int(rng.integers(0, 3)) + 1))
    weights = rng.choice(odd, points) if seed % 2 else None
    try:
        curve = CompositeCurve.from_nurbs(control, knots, degree, weights)
    except InputError:
        pass
    else:
        assert np.isfinite(at(curve, breakpoints(curve))[0]).all()

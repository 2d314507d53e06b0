"""The fit seen from Python: the curve is sampled densely here, with nothing taken from the certificate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from feedplan.errors import InputError
from feedplan.geometry.fit import FittedCurve, fit_points
from tests.campaign import examples

Array = NDArray[np.float64]


def sample(fit: FittedCurve, count: int = 200) -> Array:
    """Points of the curve, (pieces, count + 1, axes)."""
    t = np.linspace(0.0, 1.0, count + 1)[None, :, None]
    a, b, c = (fit.control_points[:, None, i] for i in range(3))
    return (1.0 - t) ** 2 * a + 2.0 * t * (1.0 - t) * b + t**2 * c


def tangents(fit: FittedCurve) -> tuple[Array, Array]:
    """C' at the start and at the end of each piece."""
    steps = 2.0 * np.diff(fit.control_points, axis=1) / fit.width[:, None, None]
    return steps[:, 0], steps[:, 1]


def densify(points: Array, count: int) -> Array:
    t = np.linspace(0.0, 1.0, count + 1)[None, :, None]
    dense = points[:-1, None] + t * (points[1:] - points[:-1])[:, None]
    return dense.reshape(-1, points.shape[1])


def hausdorff(fit: FittedCurve, points: Array) -> tuple[float, float]:
    """Distances curve to polygon and polygon to curve, to the nearest of the samples of the other."""
    curve = sample(fit).reshape(-1, points.shape[1])
    polygon = densify(points, 200)
    to_polygon, _ = cKDTree(polygon).query(curve)
    to_curve, _ = cKDTree(curve).query(polygon)
    return float(to_polygon.max()), float(to_curve.max())


def check(points: Array, fit: FittedCurve, tolerance: float) -> None:
    """Everything that a fit promises."""
    last = len(points) - 1
    assert fit.chords[0, 0] == 0
    assert fit.chords[-1, 1] == last - 1
    assert (fit.chords[:, 0] <= fit.chords[:, 1]).all()
    assert np.isin(fit.chords[1:, 0] - fit.chords[:-1, 1], (0, 1)).all()
    assert np.isin(np.diff(fit.spline.astype(int)), (0, 1)).all()

    assert (fit.control_points[0, 0] == points[0]).all()
    assert (fit.control_points[-1, 2] == points[-1]).all()
    assert (fit.control_points[1:, 0] == fit.control_points[:-1, 2]).all()
    new = np.flatnonzero(np.diff(fit.spline)) + 1
    assert (fit.control_points[new, 0] == points[fit.chords[new, 0]]).all()

    start, end = tangents(fit)
    inside = np.diff(fit.spline) == 0
    rounding = 1e-12 + 4e-15 * np.abs(points).max() / np.minimum(fit.width[1:], fit.width[:-1])
    assert (np.linalg.norm(start[1:] - end[:-1], axis=1) <= rounding)[inside].all()

    assert (fit.deviation <= tolerance).all()
    spacing = (
        max(float(fit.width.max()), float(np.linalg.norm(np.diff(points, axis=0), axis=1).max())) / 200.0
    )
    for distance in hausdorff(fit, points):
        assert distance <= math.hypot(fit.deviation.max(), spacing) + 1e-9


def vase_pass(count: int = 486) -> Array:
    """A profile with waves and beads in creases, only y and z moving, 486 points on a grid of 1 µm."""
    y = np.linspace(0.0, 120.0, 20_001)
    z = 25.0 + 8.0 * np.sin(2.0 * np.pi * y / 90.0)
    z += 2.5 * np.sin(2.0 * np.pi * y / 17.0 + 0.5) * np.exp(-(((y - 60.0) / 30.0) ** 2))
    for centre in (8.0, 15.0, 95.0, 102.0, 109.0):
        z = np.maximum(z, z - 0.8 + 2.0 * np.sqrt(np.maximum(0.0, 1.0 - ((y - centre) / 3.2) ** 2)))
    length = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))))
    stations = np.linspace(0.0, length[-1], count)
    return np.round(np.column_stack([np.interp(stations, length, y), np.interp(stations, length, z)]), 3)


def test_two_points_are_one_line() -> None:
    fit = fit_points([[0.0, 0.0], [3.0, 4.0]], 0.01)
    assert len(fit) == fit.splines == 1
    np.testing.assert_array_equal(fit.control_points, [[[0.0, 0.0], [1.5, 2.0], [3.0, 4.0]]])
    np.testing.assert_array_equal(fit.width, [5.0])
    np.testing.assert_array_equal(fit.chords, [[0, 0]])
    assert fit.spline_ratio == fit.polynomial_ratio == 1.0


def test_a_square_keeps_its_corners() -> None:
    corners = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0], [0.0, 0.0]])
    fit = fit_points(densify(corners, 16)[[i for i in range(68) if i not in (17, 34, 51)]], 0.01)
    assert len(fit) == fit.splines == 4
    np.testing.assert_array_equal(fit.control_points[:, 0], corners[:-1])
    assert fit.polynomial_ratio == 16.0
    assert fit.deviation.max() < 1e-12


def test_a_circle_is_followed_at_constant_parameter_speed() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    points = 10.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    fit = fit_points(points, 0.005)
    check(points, fit, 0.005)
    assert fit.splines == 1
    assert len(fit) <= 40
    curve = sample(fit)
    assert np.abs(np.hypot(curve[..., 0], curve[..., 1]) - 10.0).max() <= 0.005
    speed = np.linalg.norm(np.concatenate(tangents(fit)), axis=1)
    assert 0.97 < speed.min() < speed.max() < 1.05


def test_a_parabola_collapses() -> None:
    x = np.linspace(-5.0, 5.0, 201)
    points = np.column_stack([x, 0.05 * x**2])
    fit = fit_points(points, 0.01)
    check(points, fit, 0.01)
    assert len(fit) <= 6


def test_a_smooth_break_keeps_the_direction() -> None:
    x = np.linspace(0.0, 20.0, 400)
    points = np.column_stack([x, np.sin(1.3 * x)])
    fit = fit_points(points, 0.01, max_curvature=1.0)
    check(points, fit, 0.01)
    assert fit.splines >= 8
    start, end = (tangent / np.linalg.norm(tangent, axis=1)[:, None] for tangent in tangents(fit))
    assert np.abs(start[1:] - end[:-1]).max() < 1e-12


def test_long_chords_stay_lines_and_the_spline_leaves_them_smoothly() -> None:
    angle = np.radians(np.arange(0.0, 91.0, 2.0))
    arc = 5.0 * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
    points = np.concatenate([[[-20.0, 0.0]], arc, [[5.0, 25.0]]])
    fit = fit_points(points, 0.01, max_chord=10.0)
    check(points, fit, 0.01)
    np.testing.assert_array_equal(fit.control_points[[0, -1], 1], [[-10.0, 0.0], [5.0, 15.0]])
    start, end = (tangent / np.linalg.norm(tangent, axis=1)[:, None] for tangent in tangents(fit))
    assert np.abs(start[1:] - end[:-1]).max() < 1e-12


def test_a_vase_pass_compresses_as_in_the_paper() -> None:
    """Zhang et al. report 14.3 chords per spline and 2.8 per polynomial for 486 points."""
    points = vase_pass()
    fit = fit_points(points, 0.01, max_curvature=4.0 * math.hypot(3000.0, 1000.0) / 100.0**2)
    check(points, fit, 0.01)
    assert 10.0 < fit.spline_ratio < 50.0
    assert 2.5 < fit.polynomial_ratio < 4.5


def test_more_tolerance_takes_fewer_polynomials() -> None:
    counts = [len(fit_points(vase_pass(), tolerance)) for tolerance in (0.001, 0.003, 0.01, 0.03, 0.1)]
    assert counts == sorted(counts, reverse=True)


def test_no_tolerance_keeps_every_chord() -> None:
    points = vase_pass()
    fit = fit_points(points, 0.0)
    assert len(fit) == fit.splines == 485
    assert fit.deviation.max() == 0.0


def test_a_reversed_chain_is_fitted_alike() -> None:
    points = vase_pass()
    fit, back = fit_points(points, 0.02), fit_points(points[::-1], 0.02)
    check(points[::-1], back, 0.02)
    assert abs(len(fit) - len(back)) <= 0.1 * len(fit)


@pytest.mark.parametrize("axes", [1, 2, 3, 4, 5, 6, 7, 9])
def test_any_number_of_axes_up_to_nine(axes: int) -> None:
    t = np.linspace(0.0, 6.0, 150)
    points = np.column_stack([4.0 * t if k == 0 else np.sin(t + k) for k in range(axes)])
    check(points, fit_points(points, 0.01), 0.01)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0.0, 0.0]], "at least two points"),
        ([0.0, 1.0, 2.0], "at least two points"),
        (np.zeros((3, 10)), "1 to 9 axes"),
        ([[0.0, 0.0], [1.0, math.nan], [2.0, 0.0]], "point 1 is not finite"),
        ([[0.0, 0.0], [1.0, 0.0], [math.inf, 0.0]], "point 2 is not finite"),
        ([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]], "points 1 and 2 coincide"),
    ],
)
def test_unusable_points_are_refused_with_their_place(points: list[list[float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit_points(points, 0.01)


def test_a_tolerance_that_is_no_number_is_refused() -> None:
    with pytest.raises(InputError, match="tolerance"):
        fit_points([[0.0, 0.0], [1.0, 0.0]], math.nan)


@given(
    steps=st.lists(
        st.tuples(
            st.one_of(st.floats(-0.1, 0.1), st.floats(-3.0, 3.0)),
            st.one_of(st.floats(0.1, 0.5), st.floats(1e-3, 5.0)),
        ),
        min_size=1,
        max_size=60,
    ),
    tolerance=st.sampled_from([0.002, 0.02, 0.2]),
    max_curvature=st.sampled_from([0.5, math.inf]),
)
@settings(max_examples=examples(100))
def test_every_promise_holds_of_random_chains(
    steps: list[tuple[float, float]], tolerance: float, max_curvature: float
) -> None:
    turn, length = np.array(steps).T
    angle = np.cumsum(turn)
    moves = length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([[[0.0, 0.0]], np.cumsum(moves, axis=0)])
    check(points, fit_points(points, tolerance, max_curvature=max_curvature), tolerance)

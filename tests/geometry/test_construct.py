"""Paths built from curves and from points, without a program."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.path import Path
from tests.continuity import at
from tests.turns import arc, circle

HALF = math.sqrt(0.5)


def test_a_bezier_curve_is_one_piece_without_a_feed() -> None:
    control = [[0, 0], [1, 2], [3, 2], [4, 0]]
    path = Path.from_bezier(control)
    assert path.axes == ("X", "Y")
    np.testing.assert_array_equal(path.curve.control_points, control)
    assert np.isinf(path.feed).all()
    assert path.width[0] == pytest.approx(2 * math.sqrt(5) + 2)
    np.testing.assert_array_equal(path.runs, [0, 1])
    assert path.line.tolist() == [0]
    assert path.move.tolist() == [[0, 0]]
    quarter = Path.from_bezier([[1, 0], [1, 1], [0, 1]], [1, HALF, 1], axes="YZ", feed=25.0)
    assert quarter.axes == ("Y", "Z")
    np.testing.assert_array_equal(quarter.feed, 25.0)
    (middle,) = quarter.curve.evaluate([0], quarter.width / 2)
    assert np.linalg.norm(middle) == pytest.approx(1.0, abs=1e-15)


def test_a_bspline_of_scipy_is_followed_in_its_own_parameter_but_for_a_factor() -> None:
    places = np.random.default_rng(1).normal(size=(8, 3))
    spline = make_interp_spline(np.linspace(0, 1, 8), places, k=5)
    path = Path.from_bspline(spline, feed=10.0)
    assert path.curve.degree.tolist() == [5] * len(path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    total = path.width.sum()
    share = np.linspace(0, 1, 30)
    np.testing.assert_allclose(at(path.curve, np.minimum(share * total, total))[0], spline(share), atol=1e-11)
    # The parameter has the unit of length: the sum of the lengths of the control polygons.
    own = [path.curve[i : i + 1].control_points for i in range(len(path))]
    edges = sum(np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in own)
    length = np.linalg.norm(np.diff(spline(np.linspace(0, 1, 4001)), axis=0), axis=1).sum()
    assert length < total == pytest.approx(edges)
    same = Path.from_bspline(spline.c, spline.t, spline.k, feed=10.0)
    np.testing.assert_array_equal(same.curve.control_points, path.curve.control_points)


def test_a_nurbs_circle_is_one_run() -> None:
    control = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    weights = [1, HALF, 1, HALF, 1, HALF, 1, HALF, 1]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    path = Path.from_nurbs(control, knots, 2, weights)
    np.testing.assert_array_equal(path.runs, [0, 4])
    point = at(path.curve, np.linspace(0, path.width.sum() * (1 - 1e-12), 50))[0]
    np.testing.assert_allclose(np.linalg.norm(point, axis=1), 1.0, rtol=1e-14)


def test_runs_end_at_corners_and_pass_tangent_joints() -> None:
    side = CompositeCurve.from_bezier([[0, 0], [10, 0]], width=10.0)
    bow = arc([10, 0], (10, 5), math.pi / 2)
    down = CompositeCurve.from_bezier([[15, 5], [15, 5], [20, 5]], width=3.0)
    path = Path.from_curve(CompositeCurve.joined([side, bow, down]))
    np.testing.assert_array_equal(path.runs, [0, 2, 3])
    np.testing.assert_array_equal(path.width, [10.0, bow.width[0], 3.0])
    assert len(path.dwell) == 2
    square = Path.from_bspline([[0, 0], [1, 0], [1, 1], [0, 1]], [0, 0, 1, 2, 3, 3], 1)
    np.testing.assert_array_equal(square.runs, [0, 1, 2, 3])
    round_trip = Path.from_curve(circle([0, 0], 5.0))
    np.testing.assert_array_equal(round_trip.runs, [0, 4])


def test_a_cusp_is_the_end_of_a_piece_and_of_a_run_where_the_motion_turns() -> None:
    # (s², s³) with s = t − 0.3: the motion turns back in the cusp.
    def blossom(a: float, b: float, e: float) -> list[float]:
        a, b, e = a - 0.3, b - 0.3, e - 0.3
        return [(a * b + a * e + b * e) / 3, a * b * e]

    control = [blossom(0, 0, 0), blossom(0, 0, 1), blossom(0, 1, 1), blossom(1, 1, 1)]
    path = Path.from_bezier(control)
    assert len(path) == 2
    assert path.width[0] / path.width.sum() == pytest.approx(0.3, abs=1e-9)
    np.testing.assert_array_equal(path.runs, [0, 1, 2])
    # The tool rests in a cusp even where the motion continues: the curvature is unbounded there.
    flat = Path.from_bezier([[0, 0], [0, 0], [0, 0], [1, 0], [2, 1]])
    line = CompositeCurve.from_bezier([[-1, 0], [0, 0]])
    joined = CompositeCurve.joined([line, flat.curve])
    np.testing.assert_array_equal(Path.from_curve(joined).runs, [0, 1, 2])


def test_straight_curves_are_lines_from_turn_to_turn() -> None:
    # t³ about t = 1/2: a line on which C' vanishes at one point is still one line.
    line = Path.from_bezier([[-1, -2], [1, 2], [-1, -2], [1, 2]])
    np.testing.assert_array_equal(line.curve.control_points, [[-1, -2], [1, 2]])
    # A conic that turns back half way, between spans of the same line.
    spline = CompositeCurve.joined(
        [
            CompositeCurve.from_bspline([[0, 0], [1, 1], [2, 2]], [0, 0, 1, 2, 2], 1),
            CompositeCurve.from_bezier([[2, 2], [4, 4], [2, 2]], [1, 3, 1], width=2.0),
            CompositeCurve.from_bezier([[2, 2], [-3, -3]]),
        ]
    )
    path = Path.from_curve(spline, feed=5.0)
    np.testing.assert_array_equal(path.curve.degree, [1, 1, 1])
    np.testing.assert_array_equal(path.runs, [0, 2, 3])
    np.testing.assert_array_equal(path.move, [[0, 0], [1, 2], [2, 3]])
    # The turn is 3/(1 + 3) of the way to the middle control point; the parameter at ends is unchanged.
    np.testing.assert_allclose(path.curve.control_points[3], [3.5, 3.5], rtol=1e-15)
    np.testing.assert_array_equal(path.width, [1.0, 2.0, 2.0])
    np.testing.assert_allclose(at(spline, [3.0])[0, 0], [3.5, 3.5], rtol=1e-15)


def test_pieces_without_length_are_left_out_and_gaps_refused() -> None:
    line = CompositeCurve.from_bezier([[0, 0], [1, 0]])
    still = CompositeCurve.from_bezier([[1, 0], [1, 0], [1, 0]], [1, 2, 1])
    on = CompositeCurve.from_bezier([[1 + 5e-7, 0], [2, 0]])
    path = Path.from_curve(CompositeCurve.joined([line, still, on]))
    np.testing.assert_array_equal(path.runs, [0, 2])
    np.testing.assert_array_equal(path.move, [[0, 0], [2, 2]])
    np.testing.assert_array_equal(path.curve.control_points[2], [1, 0])
    far = CompositeCurve.joined([line, CompositeCurve.from_bezier([[1, 0.5], [2, 0]])], gap=1.0)
    with pytest.raises(InputError, match=r"piece 1 starts 0\.5 mm from the end of piece 0"):
        Path.from_curve(far)
    with pytest.raises(InputError, match="no length"):
        Path.from_curve(still)


def test_points_are_fitted_and_corners_rounded_within_the_tolerance() -> None:
    angle = np.linspace(0, np.pi, 101)
    bow = np.stack([10 * np.cos(angle), 10 * np.sin(angle)], axis=1)
    points = np.vstack([bow, [[20, -30]]])
    path = Path.from_points(points, 0.02, feed=40.0)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    assert len(path) < 40
    assert 0.015 < path.fit.deviation <= 0.02
    np.testing.assert_array_equal(path.tolerance, 0.02)
    assert path.move[-1, 1] == 100
    ends = path.curve.control_points[[0, -1]]
    np.testing.assert_array_equal(ends, points[[0, -1]])
    exact = Path.from_points(points, 0)
    np.testing.assert_array_equal(exact.runs, np.arange(102))
    sharp = Path.from_points([[0, 0, 0], [10, 0, 0], [10, 10, 0]], 0.1)
    # The apex of the rounded corner uses the whole tolerance.
    assert sharp.fit.deviation == pytest.approx(0.1)
    assert sharp.axes == ("X", "Y", "Z")


def test_what_cannot_be_used_is_refused_with_a_sentence() -> None:
    control = [[0, 0], [1, 1]]
    with pytest.raises(InputError, match="the axes are X for points of 2 coordinates"):
        Path.from_bezier(control, axes="X")
    with pytest.raises(InputError, match="an axis name is"):
        Path.from_bezier(control, axes="X?")
    for axes in ("XX", "XYZ"):
        with pytest.raises(InputError, match="name each once"):
            Path.from_bezier(control, axes=axes)
    for feed in (0.0, -1.0, math.nan):
        with pytest.raises(InputError, match="feed is"):
            Path.from_bezier(control, feed=feed)
    with pytest.raises(InputError, match="give two or more"):
        Path.from_points([[0, 0]], 0.1)
    with pytest.raises(InputError, match="points 1 and 2 coincide"):
        Path.from_points([[0, 0], [1, 1], [1, 1]], 0.1)
    for size in (1e300, 1e-300):
        with pytest.raises(
            InputError, match="the distance of points 0 and 1 is no number above 0: scale the"
        ):
            Path.from_points(size * np.array([[0.0, 0.0], [1.0, 0.0]]), 0.01)
    with pytest.raises(InputError, match="point 1 is not finite"):
        Path.from_points([[0, 0], [1, math.nan]], 0.1)
    for tolerance in (-1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="tolerance is"):
            Path.from_points(control, tolerance)

"""Blends of corners: shape, symmetry, sharing of short moves, reversals, and special neighbours."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from feedplan.geometry.build import build_path
from feedplan.machine.machine import Machine
from feedplan.program.program import PathControl

MILL = Machine.load("mill")


@pytest.mark.parametrize("turn", [31, 60, 90, 120, 150, 175])
@pytest.mark.parametrize("direction", [0, 33, 200])
def test_a_corner_is_symmetric_with_its_apex_at_the_tolerance(
    make_program: Any, check: Any, turn: float, direction: float
) -> None:
    a, b = math.radians(direction), math.radians(direction + turn)
    before, after = np.array([math.cos(a), math.sin(a), 0]), np.array([math.cos(b), math.sin(b), 0])
    vertex = np.array([3.0, -2.0, 1.0])
    program = make_program([vertex - 20 * before, vertex, vertex + 15 * after], feed=500.0)
    path = build_path(program, MILL)
    _, off = check(program, path)
    assert off == pytest.approx(0.01, rel=1e-6)
    assert len(path) == 3
    start, middle, end = path.curve.by_piece[1]
    length = 2 * 0.01 / math.sin(math.radians(turn) / 2)
    np.testing.assert_allclose(middle, vertex, atol=1e-14)
    np.testing.assert_allclose([start, end], [vertex - length * before, vertex + length * after], atol=1e-12)
    apex = (start + 2 * middle + end) / 4
    assert np.linalg.norm(apex - vertex) == pytest.approx(0.01, rel=1e-9)


def test_a_corner_takes_no_more_than_its_feed_needs(make_program: Any, check: Any) -> None:
    points = [[0, 0], [10, 0], [20, 0.05]]
    lengths = []
    for feed in (100.0, 200.0, 2000.0):
        program = make_program(points, feed=feed, blend_tolerance=1e-3, fit_tolerance=0.0)
        path = build_path(program, MILL)
        check(program, path)
        lengths.append(path.width[1] / 2)
    assert lengths[1] == pytest.approx(4 * lengths[0], rel=1e-9)
    assert lengths[2] == pytest.approx(4 * 1e-3 / (2 * math.sin(math.atan(0.005) / 2)), rel=1e-6)


def test_neighbours_share_a_short_edge_by_halves(make_program: Any, check: Any) -> None:
    points = [[0.1 * i, 0.1 * (i % 2)] for i in range(30)]
    program = make_program(points, blend_tolerance=0.2, fit_tolerance=0.0)
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    assert len(path) == 30
    middles = (np.array(points)[1:-2] + np.array(points)[2:-1]) / 2
    np.testing.assert_allclose(path.curve.by_piece[2:-1, 0, :2], middles, atol=1e-12)


def test_a_neighbour_that_needs_little_leaves_the_rest(make_program: Any, check: Any) -> None:
    # A slight turn and a sharp one at the two ends of a short edge.
    points = [[-20, -0.02], [0, 0], [0.1, 0], [0.1, 20]]
    program = make_program(points, blend_tolerance=1.0, fit_tolerance=0.0)
    path = build_path(program, MILL)
    check(program, path)
    slight = path.width[(path.move == [0, 1]).all(axis=1)].sum() / 2
    sharp = path.width[(path.move == [1, 2]).all(axis=1)].sum() / 2
    assert slight == pytest.approx(0.01, rel=1e-9)
    assert sharp == pytest.approx(0.09, rel=1e-9)


def test_a_corner_reaches_over_short_pieces(make_program: Any, check: Any) -> None:
    # Arcs of 0.005 rad each, one smooth curve, end in a line at a right angle.
    turn = np.linspace(0, 1, 201)
    end = [10 * math.sin(1), 10 - 10 * math.cos(1)]
    arc = 10 * np.stack([np.sin(turn), 1 - np.cos(turn)], axis=1)
    points = [*arc, [end[0] - 10 * math.sin(1), end[1] + 10 * math.cos(1)]]
    arcs = dict.fromkeys(range(200), ((0.0, 10.0, 0.0), 2, 0.005))
    program = make_program(points, arcs=arcs, blend_tolerance=0.1)
    path = build_path(program, MILL)
    _, off = check(program, path)
    assert off == pytest.approx(0.1, rel=1e-3)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    # Conics that the blend bends stay conics, increasingly far from their circle.
    (joints,) = path.curve.evaluate(np.arange(200), path.width[:200])
    distance = np.abs(np.linalg.norm(joints[:, :2] - [0, 10], axis=1) - 10)
    assert (distance > 0.02).sum() >= 2
    assert (distance < 1e-13).sum() >= 150
    assert path.curve.weights is not None


def test_reversals_are_stops(make_program: Any, check: Any) -> None:
    program = make_program([[0, 0], [10, 0], [0, 0], [10, 1e-9], [0, 0]])
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, 1, 2, 3, 4])
    many = make_program([[i % 2, 0] for i in range(5001)])
    assert len(build_path(many, MILL).runs) == 5001


def test_corners_in_space_and_in_six_axes_are_rounded_alike(make_program: Any, check: Any) -> None:
    from dataclasses import replace

    from feedplan.machine.axis import Axis

    machine = replace(MILL, axes=(*MILL.axes, *(Axis(name, 100.0, 1000.0) for name in "ABC")))
    random = np.random.default_rng(5)
    points = np.cumsum(random.normal(size=(12, 6)), axis=0)
    program = make_program(points, axes="XYZABC")
    path = build_path(program, machine)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("origin", [0.0, 1e5])
def test_tiny_moves_and_far_origins(make_program: Any, check: Any, scale: float, origin: float) -> None:
    random = np.random.default_rng(11)
    for control in (PathControl.TOLERANCE, PathControl.EXACT_PATH):
        points = origin + scale * np.cumsum(random.normal(size=(60, 3)), axis=0)
        program = make_program(points, control=control)
        check(program, build_path(program, MILL))


def test_moves_shorter_than_a_picometre_are_followed(make_program: Any, check: Any) -> None:
    points = [[0, 0], [10, 0], [10 + 1e-12, 0], [20, 0], [20, 1e-12], [20, 10]]
    for control in (PathControl.TOLERANCE, PathControl.EXACT_PATH):
        program = make_program(points, control=control)
        check(program, build_path(program, MILL))


@pytest.mark.parametrize("tolerance", [1.0, 100.0])
def test_a_tolerance_larger_than_the_moves_is_kept_all_the_same(
    make_program: Any, check: Any, tolerance: float
) -> None:
    points = np.cumsum(np.random.default_rng(4).normal(size=(60, 3)), axis=0)
    for fit in (np.nan, 0.0):
        program = make_program(points, blend_tolerance=tolerance, fit_tolerance=fit)
        check(program, build_path(program, MILL))


def test_a_closed_contour_starts_and_ends_at_rest_in_its_first_corner(make_program: Any, check: Any) -> None:
    program = make_program([[0, 0], [10, 0], [5, 8], [0, 0]])
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, 5])
    np.testing.assert_array_equal(path.curve.by_piece[0, 0], path.curve.by_piece[-1, 2])


def test_a_slight_turn_between_long_moves_is_no_stop(make_program: Any, check: Any) -> None:
    # The turn is so slight that the feed of 1 mm/s needs only nanometres of the moves of 100 mm.
    for tolerance in (None, 1e-3, 1e-5):
        program = make_program([[0, 0], [100, 0], [200, 0.01]], feed=1.0)
        path = build_path(program, MILL, tolerance)
        check(program, path)
        np.testing.assert_array_equal(path.runs, [0, 3])

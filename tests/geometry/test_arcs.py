"""Arcs and helices of programs: every plane, several turns, very small and very large radii."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from feedplan.geometry.build import build_path
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.program.program import PathControl, Program

MILL = Machine.load("mill")


def arc_program(make_program: Any, radius: float, angle: float, normal: int, rise: float = 0.0) -> Program:
    """One arc about the point (1, 2, 3), starting 0.4 rad past the first axis of its plane."""
    centre = np.array([1.0, 2.0, 3.0])
    points = np.tile(centre, (2, 1))
    first, second = (normal + 1) % 3, (normal + 2) % 3
    for row, turned in enumerate((0.4, 0.4 + angle)):
        points[row, first] += radius * math.cos(turned)
        points[row, second] += radius * math.sin(turned)
    points[1, normal] += rise
    program: Program = make_program(points, arcs={0: (centre, normal, angle)}, control=PathControl.EXACT_PATH)
    return program


def assert_on_cylinder(path: Path, normal: int, radius: float) -> None:
    """All pieces are conics on the cylinder about (1, 2, 3), and |C'| is 1 at their ends."""
    share = np.linspace(0, 1, 21)
    piece = np.repeat(np.arange(len(path)), len(share))
    u = np.tile(share, len(path)) * path.width[piece]
    point, tangent = path.curve.evaluate(piece, u, 1)
    spoke = np.delete(point - [1, 2, 3], normal, axis=1)
    np.testing.assert_allclose(np.linalg.norm(spoke, axis=1), radius, rtol=1e-12)
    ends = tangent.reshape(len(path), len(share), -1)[:, [0, -1]]
    np.testing.assert_allclose(np.linalg.norm(ends, axis=2), 1.0, rtol=1e-9)
    assert path.curve.weights is not None


@pytest.mark.parametrize("normal", [0, 1, 2])
@pytest.mark.parametrize("angle", [math.pi / 2, -math.pi / 2, 2 * math.pi, -2 * math.pi])
def test_quarter_and_full_circles_in_every_plane(
    make_program: Any, check: Any, normal: int, angle: float
) -> None:
    program = arc_program(make_program, 10.0, angle, normal)
    path = build_path(program, MILL)
    off, _ = check(program, path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    assert len(path) == round(abs(angle) / (math.pi / 2))
    assert max(off, path.fit.deviation) < 1e-13
    assert_on_cylinder(path, normal, 10.0)
    # At the angle 0 in the plane the direction is that of the second axis.
    spoke = path.curve.by_piece[0, 0] - [1, 2, 3]
    step = path.curve.by_piece[0, 1] - path.curve.by_piece[0, 0]
    turning = np.cross(spoke, step)
    assert np.sign(turning[normal]) == np.sign(angle)


@pytest.mark.parametrize("normal", [0, 1, 2])
def test_a_helix_of_three_and_a_quarter_turns(make_program: Any, check: Any, normal: int) -> None:
    program = arc_program(make_program, 4.0, 6.5 * math.pi, normal, rise=-9.75)
    path = build_path(program, MILL)
    off, _ = check(program, path)
    assert_on_cylinder(path, normal, 4.0)
    # The third axis is linear in the angle at the ends of pieces, but not within them.
    axis = path.curve.by_piece[:, :, normal]
    np.testing.assert_allclose(np.diff(axis, axis=1), axis[0, 1] - axis[0, 0], rtol=1e-9)
    assert 0.5 * path.fit.deviation < off <= path.fit.deviation <= 0.5e-3


@pytest.mark.parametrize("radius", [1e-6, 1e-3, 0.1, 100.0, 1e6])
def test_tiny_and_huge_radii(make_program: Any, check: Any, radius: float) -> None:
    for angle in (math.pi, 1e-2, 2 * math.pi):
        program = arc_program(make_program, radius, angle, 2)
        path = build_path(program, MILL)
        check(program, path)
        assert len(path) == math.ceil(angle / (math.pi / 2) - 1e-9)


def test_a_helix_of_a_thousand_turns_ends_where_it_should(make_program: Any) -> None:
    program = arc_program(make_program, 4.0, 2000 * math.pi, 2, rise=50.0)
    path = build_path(program, MILL)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    np.testing.assert_array_equal(path.curve.by_piece[-1, 2], program.target[-1])
    radius = np.hypot(*(path.curve.by_piece[:, 0, :2] - [1, 2]).T)
    np.testing.assert_allclose(radius, 4.0, rtol=1e-12)
    np.testing.assert_allclose(path.width, path.width[0], rtol=1e-9)


def test_helices_are_no_looser_than_the_tolerance(make_program: Any) -> None:
    program = arc_program(make_program, 10.0, math.pi, 2, rise=30.0)
    assert build_path(program, MILL, tolerance=1e-5).fit.deviation <= 1e-5
    assert build_path(program, MILL, tolerance=1.0).fit.deviation <= 1e-3
    assert build_path(program, MILL, tolerance=0.0).fit.deviation <= 1e-3


def test_rounded_ends_lie_on_one_circle_and_a_spiral_is_none(make_program: Any, check: Any) -> None:
    # With three decimals one end is inside and the other outside of the circle of radius 10.
    points = [[6.428, 7.661], [-9.848, 1.736]]
    angle = math.atan2(1.736, -9.848) - math.atan2(7.661, 6.428)
    rounded = make_program(points, arcs={0: ((0, 0, 0), 2, angle)}, control=PathControl.EXACT_PATH)
    path = build_path(rounded, MILL)
    off, back = check(rounded, path)
    assert 0.5 * path.fit.deviation < off <= path.fit.deviation < 0.5e-3
    assert back <= path.fit.deviation
    control = path.curve.by_piece
    (place,) = path.curve.evaluate([0], [0.5 * path.width[0]])
    a, b = place[0, :2] - points[0], np.array(points[1]) - points[0]
    centre = np.linalg.solve(np.stack([a, b]), [a @ a / 2, b @ b / 2]) + points[0]
    radius = np.linalg.norm(centre - points[0])
    np.testing.assert_allclose(np.linalg.norm(control[:, 2, :2] - centre, axis=1), radius, rtol=1e-12)
    # The centre is the point on the bisector of both ends that is nearest to the programmed centre.
    np.testing.assert_allclose(centre @ [-b[1], b[0]], 0.0, atol=1e-9)
    spiral = make_program([[10, 0], [0, 10.5]], arcs={0: ((0, 0, 0), 2, math.pi / 2)})
    path = build_path(spiral, MILL)
    check(spiral, path)
    assert path.curve.weights is None
    assert len(path) > 4


def test_rounded_coordinates_leave_arcs_joined_to_their_neighbours(make_program: Any, check: Any) -> None:
    # A slot with 3 decimals: its arcs are tangent to its lines up to rounding.
    points = [[0.003, -2.5], [10, -2.5], [12.165, 1.25], [6.667, 4.773], [0, 3]]
    arc = ((10.0, 0.0, 0.0), 2, math.atan2(1.25, 2.165) + math.pi / 2)
    for control in (PathControl.EXACT_PATH, PathControl.TOLERANCE):
        program = make_program(points[:3], arcs={1: arc}, control=control)
        path = build_path(program, MILL)
        check(program, path)
        np.testing.assert_array_equal(path.runs, [0, len(path)])
    kinked = make_program([[0, -2.4], *points[1:3]], arcs={1: arc}, control=PathControl.EXACT_PATH)
    np.testing.assert_array_equal(build_path(kinked, MILL).runs, [0, len(build_path(kinked, MILL))])
    corner = make_program([[0, -1.0], *points[1:3]], arcs={1: arc}, control=PathControl.EXACT_PATH)
    assert len(build_path(corner, MILL).runs) == 3


def test_corners_between_arcs_and_lines_are_rounded_within_tolerance(make_program: Any, check: Any) -> None:
    # Smoothly into the half circle, and at a right angle out of it into a line.
    points = [[0, 0], [10, 0], [10, 20], [10, 40]]
    arcs = {1: ((10.0, 10.0, 0.0), 2, math.pi)}
    for tolerance in (0.02, 0.5):
        program = make_program(points, arcs=arcs, blend_tolerance=tolerance, feed=500.0)
        path = build_path(program, MILL)
        _, off = check(program, path)
        np.testing.assert_array_equal(path.runs, [0, len(path)])
        assert 0.9 * tolerance < off <= tolerance


def test_a_trochoid_of_many_arcs_is_one_run(make_program: Any, check: Any) -> None:
    count = 60
    points = np.stack(
        [np.repeat(np.arange(count // 2 + 1) * 0.5, 2)[: count + 1], np.zeros(count + 1)], axis=1
    )
    points[1::2, 0] += 4.0
    arcs = {}
    for i in range(count):
        middle = (points[i] + points[i + 1]) / 2
        arcs[i] = ((middle[0], 0.0, 0.0), 2, math.pi)
    program = make_program(points, arcs=arcs)
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])

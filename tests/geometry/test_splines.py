"""Spline moves of programs enter the path unchanged, between lines, arcs and each other."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from feedplan.audit import audit
from feedplan.constraints.problem import build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError, ProgramError
from feedplan.geometry.build import build_path
from feedplan.geometry.joints import tangent_jumps
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.program.program import MoveKind, PathControl, Program
from tests.continuity import Joint, joints

MILL = Machine.load("mill")
# From (10, 0) to (14, 4): along X at its start, along Y at its end.
CUBIC = [[10, 0, 0], [12, 0, 0], [14, 2, 0], [14, 4, 0]]


def with_splines(program: Program, splines: dict[int, CompositeCurve], **changes: Any) -> Program:
    """The program with some moves replaced by splines."""
    kind = program.kind.copy()
    kind[list(splines)] = MoveKind.SPLINE
    return dataclasses.replace(
        program,
        kind=kind,
        spline_move=np.array(sorted(splines)),
        spline_pieces=np.cumsum([0, *(len(splines[move]) for move in sorted(splines))]),
        splines=CompositeCurve.joined([splines[move] for move in sorted(splines)], gap=math.inf),
        **changes,
    )


def piece(path: Path, i: int) -> tuple[Any, Any]:
    """Control points and weights of a piece."""
    own = slice(path.curve.offsets[i], path.curve.offsets[i + 1])
    return path.curve.control_points[own], None if path.curve.weights is None else path.curve.weights[own]


def test_pieces_of_any_degree_are_kept_to_the_last_bit(make_program: Any) -> None:
    random = np.random.default_rng(5)
    curves, points = {}, [np.zeros(3)]
    for move, degree in enumerate(range(1, 10)):
        control = random.normal(size=(degree + 1, 3))
        control[0] = points[-1]
        points.append(control[-1])
        weights = random.uniform(0.5, 2, degree + 1) if degree % 2 else None
        curves[move] = CompositeCurve.from_bezier(control, weights)
    path = build_path(with_splines(make_program(points, control=PathControl.EXACT_PATH), curves), MILL)
    assert path.curve.degree.tolist() == list(range(1, 10))
    for i in range(9):
        control, weights = piece(path, i)
        np.testing.assert_array_equal(control, curves[i].control_points)
        given = curves[i].weights if i else None  # a line has none
        np.testing.assert_array_equal(weights, 1.0 if given is None else given)
    # Every joint is a corner and therefore a stop.
    np.testing.assert_array_equal(path.runs, np.arange(10))
    np.testing.assert_array_equal(path.line, 10 + np.arange(9))
    assert path.fit.deviation == 0.0


def test_tangent_joints_pass_between_lines_arcs_and_splines(make_program: Any) -> None:
    points = [[0, 0], [10, 0], [14, 4], [12, 6], [0, 6]]
    spline = CompositeCurve.from_bezier(CUBIC)
    program = make_program(points, arcs={2: ((12, 4, 0), 2, math.pi / 2)}, feed=[10, 20, 30, 40])
    path = build_path(with_splines(program, {1: spline}), MILL)
    np.testing.assert_array_equal(path.runs, [0, 4])
    assert path.curve.degree.tolist() == [2, 3, 2, 2]
    np.testing.assert_array_equal(path.feed, [10, 20, 30, 40])
    np.testing.assert_array_equal(piece(path, 1)[0], CUBIC)
    assert min(joints(path.curve)) >= Joint.TANGENT
    # The width is the length of the control polygon, about that of the curve.
    assert path.width[1] == 2 + 2 * math.sqrt(2) + 2


def test_a_corner_beside_a_spline_is_rounded_within_the_tolerance(make_program: Any) -> None:
    points = [[10, 0], [14, 4], [20, 4], [20, 10]]
    program = with_splines(make_program(points, blend_tolerance=0.05), {0: CompositeCurve.from_bezier(CUBIC)})
    path = build_path(program, MILL)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    # The rest of the spline, the bent end of it, the bent start of the line in two pieces, then a line, a
    # parabola that rounds the corner, and a line.
    assert path.curve.degree.tolist() == [3, 3, 2, 2, 2, 2]
    assert min(joints(path.curve)) >= Joint.TANGENT
    assert 0.045 < path.fit.deviation <= 0.05 * (1 + 1e-9)
    # The corner at (14, 4) moves to the point where both bent sides meet, at about the tolerance.
    meeting = piece(path, 1)[0][-1]
    assert np.linalg.norm(meeting - [14, 4, 0]) == pytest.approx(0.05, rel=0.1)
    assert meeting[0] > 14
    assert meeting[1] < 4
    assert audit(build_problem(path, MILL), None, MILL, program).ok


def test_rounded_coordinates_of_an_exact_spline_make_no_stop_and_a_corner_does(make_program: Any) -> None:
    def exact(turn: float) -> Path:
        end = [14 + math.cos(math.pi / 2 - turn), 4 + math.sin(math.pi / 2 - turn)]
        program = make_program([[10, 0], [14, 4], end], control=PathControl.EXACT_PATH)
        return build_path(with_splines(program, {0: CompositeCurve.from_bezier(CUBIC)}), MILL)

    smoothed = exact(1e-4)
    assert len(smoothed.runs) == 2
    assert 0 < smoothed.fit.deviation <= 1e-3
    assert exact(0.1).runs.tolist() == [0, 1, 2]


@pytest.mark.parametrize("seed", range(40))
def test_random_chains_of_splines_arcs_and_lines_are_smooth_and_within_the_tolerance(
    seed: int, make_program: Any
) -> None:
    random = np.random.default_rng(seed)
    count, tolerance = 8, 10.0 ** random.uniform(-4, 0)
    points, curves = [np.zeros(3)], {}
    for move in range(count):
        if random.random() < 0.3:
            points.append(points[-1] + random.normal(size=3))
            continue
        degree = int(random.integers(1, 6))
        control = points[-1] + np.cumsum(random.normal(size=(degree + 1, 3)), axis=0)
        control[0] = points[-1]
        weights = 10.0 ** random.uniform(-1, 1, degree + 1) if random.random() < 0.4 else None
        curves[move] = CompositeCurve.from_bezier(control, weights)
        points.append(control[-1])
    program = with_splines(make_program(points, blend_tolerance=tolerance), curves)
    path = build_path(program, MILL)
    met = np.array(joints(path.curve))
    within = np.setdiff1d(np.arange(1, len(path)), path.runs)
    assert met[within - 1].min() >= Joint.CORNER
    assert tangent_jumps(path.curve)[within - 1].max() < 1e-9
    assert len(path.runs) - 2 <= 1
    assert path.fit.deviation <= tolerance * (1 + 1e-9)
    verdict = audit(build_problem(path, MILL), None, MILL, program)
    assert verdict.ok, verdict


def test_pieces_of_a_spline_keep_their_continuity_and_lose_those_without_length(make_program: Any) -> None:
    knots = [0, 0, 0, 0, 1, 3, 3, 3, 3]
    control = np.array([[0, 0, 0], [1, 2, 0], [3, 2, 0], [4, 0, 1], [6, 0, 0]], dtype=float)
    smooth = CompositeCurve.from_bspline(control, knots, 3)
    still = CompositeCurve.from_bezier(np.repeat(control[:1], 3, axis=0))
    curve = CompositeCurve.joined([still, smooth])
    path = build_path(with_splines(make_program(control[[0, -1]]), {0: curve}), MILL)
    np.testing.assert_array_equal(path.runs, [0, 2])
    # C2 stays C2: all widths have the same factor.
    assert joints(path.curve) == [Joint.C2]
    assert path.width[1] / path.width[0] == pytest.approx(2.0)
    with pytest.raises(ProgramError, match="line 10: the move has no length"):
        build_path(with_splines(make_program(control[[0, 0]]), {0: still}), MILL)


def test_a_closed_spline_returns_to_its_start(make_program: Any) -> None:
    circle = [[10, 0, 0], [10, 40, 0], [-50, 0, 0], [10, -40, 0], [10, 0, 0]]
    path = build_path(
        with_splines(make_program([[10, 0], [10, 0]]), {0: CompositeCurve.from_bezier(circle)}), MILL
    )
    assert len(path) == 1


def test_splines_start_exactly_where_their_move_does(make_program: Any) -> None:
    control = np.array(CUBIC, dtype=float)
    control[0, 1] += 3e-7
    points = [[0, 0], [10, 0], [14, 4]]
    path = build_path(with_splines(make_program(points), {1: CompositeCurve.from_bezier(control)}), MILL)
    np.testing.assert_array_equal(piece(path, 1)[0][0], [10, 0, 0])
    control[-1, 2] += 1e-3
    with pytest.raises(ProgramError, match=r"line 11: the spline leaves a gap of 0\.001 mm"):
        build_path(with_splines(make_program(points), {1: CompositeCurve.from_bezier(control)}), MILL)
    with pytest.raises(ProgramError, match="line 11: the move has no spline"):
        build_path(make_program(points, kind=[MoveKind.LINE, MoveKind.SPLINE]), MILL)


def test_travel_is_that_of_the_curve_and_not_of_its_polygon(make_program: Any) -> None:
    # The highest point of this cubic is at 3/4 of the height of its control polygon.
    arch = CompositeCurve.from_bezier([[0, 0, 0], [1, 4, 0], [2, 4, 0], [3, 0, 0]])
    program = with_splines(make_program([[0, 0], [3, 0]]), {0: arch})

    def limited(height: float) -> Machine:
        axes = (MILL.axes[0], dataclasses.replace(MILL.axes[1], travel=(-1.0, height)), MILL.axes[2])
        return dataclasses.replace(MILL, axes=axes)

    build_path(program, limited(3.0))
    with pytest.raises(InputError, match=r"line 10: Y reaches 3 mm, its travel ends at 2\.999 mm"):
        build_path(program, limited(2.999))


def test_an_axis_that_only_a_spline_moves_is_in_the_path(make_program: Any) -> None:
    rotary = dataclasses.replace(MILL, axes=(*MILL.axes, Axis("A", 100.0, 1000.0)))
    curve = CompositeCurve.from_bezier([[0, 0, 0, 0], [1, 0, 0, 90], [2, 0, 0, 0]])
    program = with_splines(make_program([[0, 0, 0, 0], [2, 0, 0, 0]], axes="XYZA", feed=5.0), {0: curve})
    path = build_path(program, rotary)
    assert path.axes == ("X", "Y", "Z", "A")
    # The feed is unchanged: A does not lower it.
    np.testing.assert_array_equal(path.feed, 5.0)
    with pytest.raises(Exception, match="axis A moves"):
        build_path(program, MILL)

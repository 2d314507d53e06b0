"""The audit of the path: its distance from the program in both directions, and the joints of its pieces."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

from feedplan.audit import audit
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.program.program import MoveKind, Program
from tests.along import path_along, problem_along
from tests.audit.faults import broken, changed

PLANE = Machine("plane", (Axis("X", 100.0, 1000.0), Axis("Y", 100.0, 1000.0)))


def program_of(targets: list[list[float]], **arcs: Any) -> Program:
    """Moves from the origin; they have the line numbers 10, 20, …"""
    count = len(targets)
    return Program(
        name="moves",
        axes=("X", "Y"),
        start=np.zeros(2),
        kind=np.full(count, MoveKind.LINE, np.uint8),
        target=np.array(targets),
        feed=np.full(count, 50.0),
        line=np.asarray(10 * np.arange(1, count + 1), dtype=np.int32),
        control=np.zeros(count, np.uint8),
        blend_tolerance=np.full(count, math.nan),
        fit_tolerance=np.full(count, math.nan),
        stop=np.zeros(count, np.bool_),
        dwell=np.zeros(count),
        arc_move=np.asarray(arcs.get("move", []), dtype=np.int64),
        arc_centre=np.asarray(arcs.get("centre", []), dtype=float).reshape(-1, 3),
        arc_normal=np.asarray(arcs.get("normal", []), dtype=np.uint8),
        arc_angle=np.asarray(arcs.get("angle", []), dtype=float),
    )


def problem_of(points: list[list[list[float]]], move: list[list[int]], tolerance: float) -> Problem:
    control = np.array(points)
    curve = CompositeCurve.from_pieces(control, np.linalg.norm(np.diff(control, axis=1), axis=2).sum(axis=1))
    lines = [10 * (first + 1) for first, _ in move]
    return problem_along(
        path_along(curve, feed=50.0, move=np.array(move), line=lines, tolerance=tolerance), 100.0, 1000.0
    )


def test_a_parabola_is_as_far_from_its_chord_as_half_its_control_point() -> None:
    program = program_of([[4.0, 0.0]])
    bulge = problem_of([[[0.0, 0.0], [2.0, 0.5], [4.0, 0.0]]], [[0, 0]], 0.25)
    result = audit(bulge, None, PLANE, program)
    assert result.ok
    assert result.check("deviation").worst == pytest.approx(0.25, rel=1e-12)
    tight = problem_of([[[0.0, 0.0], [2.0, 0.5], [4.0, 0.0]]], [[0, 0]], 0.2499)
    assert broken(audit(tight, None, PLANE, program)) == {("deviation", None)}


def test_a_peak_between_the_samples_is_found() -> None:
    # The parabola is farthest from the line at t = 0.3, which is no multiple of 1/8 or 1/64.
    peak = 0.3
    a, c = 1 / (2 * peak), 0.0
    points = [[[0.0, 0.0], [1.0, 0.5 * a], [2.0, a - 1 + c]]]
    program = program_of([[2.0, a - 1.0]])
    height = audit(problem_of(points, [[0, 0]], 1.0), None, PLANE, program).check("deviation").worst
    # A parabola is farthest from its own chord at t = 1/2, whatever its ends.
    exact = 0.25 * abs(a - 1 - a) * 2.0 / math.hypot(2.0, a - 1)
    assert height == pytest.approx(exact, rel=1e-12)


def test_a_peak_that_only_a_closer_look_finds_breaks_the_tolerance() -> None:
    # The distance from an L is greatest where the parabola crosses its bisector, at no multiple of t = 1/8.
    program = program_of([[4.0, 0.0], [4.0, 1.0]])
    points = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 1.0]])
    t = np.linspace(0.0, 1.0, 100_001)[:, None]
    places = (1 - t) ** 2 * points[0] + 2 * t * (1 - t) * points[1] + t**2 * points[2]
    distance = np.minimum(places[:, 1], 4.0 - places[:, 0])
    seen = distance[:: 100_000 // 8].max()
    assert seen < 0.995 * distance.max()
    tolerance = 0.5 * (seen + distance.max())
    result = audit(problem_of([points.tolist()], [[0, 1]], tolerance), None, PLANE, program)
    assert broken(result) == {("deviation", None)}
    # The refined search takes steps of 1/64.
    assert distance.max() - result.check("deviation").worst < 0.005 * distance.max()


def test_a_program_that_nothing_follows_is_not_followed() -> None:
    program = program_of([[4.0, 0.0]])
    nothing = problem_of([[[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]], [[0, 0]], 0.01)
    path = replace(
        nothing.path,
        curve=CompositeCurve.from_pieces(np.empty((0, 3, 2)), np.empty(0)),
        feed=np.empty(0),
        move=np.empty((0, 2), np.int64),
        line=np.empty(0, np.int32),
        runs=np.array([0]),
        dwell=np.empty(0),
        tolerance=np.empty(0),
    )
    empty = replace(nothing, path=path, feed=np.empty(0), junction_speed=np.zeros(1))
    assert ("deviation", None) in broken(audit(empty, None, PLANE, program))


def test_a_corner_cut_off_is_as_far_as_the_corner_from_the_path() -> None:
    program = program_of([[10.0, 0.0], [10.0, 10.0]])
    points = [
        [[0.0, 0.0], [4.5, 0.0], [9.0, 0.0]],
        [[9.0, 0.0], [10.0, 0.0], [10.0, 1.0]],
        [[10.0, 1.0], [10.0, 5.5], [10.0, 10.0]],
    ]
    result = audit(problem_of(points, [[0, 0], [0, 1], [1, 1]], 1.0), None, PLANE, program)
    # (9.75, 0.25) is the middle of the corner piece.
    assert result.check("deviation").worst == pytest.approx(0.25 * math.sqrt(2.0), rel=1e-12)
    assert result.check("deviation").ok


def test_a_detour_of_the_program_that_the_path_leaves_out_is_found() -> None:
    program = program_of([[5.0, 0.0], [5.0, 0.3], [5.1, 0.0], [10.0, 0.0]])
    straight = problem_of([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]]], [[0, 3]], 0.01)
    result = audit(straight, None, PLANE, program)
    assert broken(result) == {("deviation", None)}
    assert result.check("deviation").worst == pytest.approx(0.3)
    assert result.check("deviation").line in (20, 30)
    # The same when no piece names these moves as the ones that it follows.
    unnamed = problem_of([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]]], [[0, 0]], 0.01)
    assert ("deviation", None) in broken(audit(unnamed, None, PLANE, program))


def test_arcs_are_measured_against_the_true_circle() -> None:
    # A quarter circle of radius 10 mm as one parabola: its middle is 10 (¾ √2 − 1) mm off.
    program = program_of(
        [[10.0, 0.0], [0.0, 10.0]], move=[1], centre=[[0.0, 0.0, 0.0]], normal=[2], angle=[math.pi / 2]
    )
    points = [[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]]
    result = audit(problem_of(points, [[0, 0], [1, 1]], 1.0), None, PLANE, program)
    assert result.check("deviation").worst == pytest.approx(10 * (0.75 * math.sqrt(2.0) - 1), rel=1e-6)
    clockwise = program_of(
        [[10.0, 0.0], [0.0, 10.0]], move=[1], centre=[[0.0, 0.0, 0.0]], normal=[2], angle=[-1.5 * math.pi]
    )
    wrong_way = audit(problem_of(points, [[0, 0], [1, 1]], 1.0), None, PLANE, clockwise)
    assert wrong_way.check("deviation").worst == pytest.approx(10 * math.sqrt(2.0), rel=0.3)


def test_a_path_with_a_gap_or_other_ends_is_found() -> None:
    program = program_of([[5.0, 0.0], [10.0, 0.0]])

    def gap(middle: float, start: float = 0.0, end: float = 10.0) -> set[tuple[str, str | None]]:
        points = [[[start, 0.0], [2.5, 0.0], [5.0, 0.0]], [[middle, 0.0], [7.5, 0.0], [end, 0.0]]]
        return broken(audit(problem_of(points, [[0, 0], [1, 1]], 0.01), None, PLANE, program))

    assert gap(5.0) == set()
    assert gap(5.0 + 1e-8) == {("gap", None)}
    assert gap(5.0, start=1e-7) == {("gap", None)}
    assert gap(5.0, end=10.0 - 1e-7) == {("gap", None)}


@pytest.mark.parametrize("piece", [5, 30, -2])
def test_a_control_point_moved_by_twice_the_tolerance_is_found(part: Any, piece: int) -> None:
    piece = piece % len(part.path)
    tolerance = part.path.tolerance[piece]
    for corner in (0, 2):
        points = changed(part.path.curve.by_piece, (piece, corner, 2), lambda z: z + 2 * tolerance)
        result = part.with_path(curve=replace(part.path.curve, control_points=points.reshape(-1, 3))).audit()
        assert {("deviation", None), ("gap", None)} <= broken(result)
        assert abs(result.check("deviation").line - part.path.line[piece]) <= 1
    # Moving the middle control point moves the curve by half as much.
    points = changed(part.path.curve.by_piece, (piece, 1, 2), lambda z: z + 5 * tolerance)
    result = part.with_path(curve=replace(part.path.curve, control_points=points.reshape(-1, 3))).audit()
    assert ("deviation", None) in broken(result)
    assert result.check("deviation").worst == pytest.approx(2.5 * tolerance, rel=0.3)
    assert "jump" in {name for name, _ in broken(result)}


def test_another_program_is_not_the_one_that_is_followed(part: Any) -> None:
    assert part.program is not None
    for move in (7, 40, 61):
        target = changed(part.program.target, (move, 1), lambda y: y + 0.05)
        result = part.with_program(target=target).audit()
        assert ("deviation", None) in broken(result)
        assert abs(result.check("deviation").line - part.program.line[move]) <= 2
    assert not part.with_program(target=changed(part.program.target, (7, 1), math.nan)).audit().ok
    assert not part.with_program(arc_angle=-part.program.arc_angle).audit().ok


def test_pieces_that_follow_other_moves_than_they_say_are_found(part: Any) -> None:
    moves = changed(part.path.move, 10, part.path.move[40])
    assert ("deviation", None) in broken(part.with_path(move=moves).audit())
    beyond = changed(part.path.move, 10, np.array([10**6, 10**6]))
    assert ("deviation", None) in broken(part.with_path(move=beyond).audit())


def test_the_audit_uses_nothing_of_what_it_audits() -> None:
    """The crate of the audit depends on no other crate of the project, so it cannot use their code."""
    manifest = (FilePath(__file__).parents[2] / "solvers" / "audit" / "Cargo.toml").read_text()
    dependencies = manifest.split("[dependencies]")[1]
    assert "rayon" in dependencies
    assert "feedplan" not in dependencies
    assert "path" not in dependencies

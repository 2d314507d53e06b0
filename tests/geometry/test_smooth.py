"""Smooth paths: where they stop, what stays exact, feeds and lines of pieces, and their audit."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.audit import Audit, audit
from feedplan.cli import main
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.planning import plan
from feedplan.program.program import MoveKind, PathControl, Program
from feedplan.program.read import read_program

MILL = Machine.load("mill")
SQUARE = np.array([[0, 0], [100, 0], [100, 100], [0, 100], [0, 0]], dtype=float)


def smooth(program: Program, tolerance: float | None = None, machine: Machine = MILL) -> Path:
    return build_path(program, machine, tolerance, corners=Corners.SMOOTH)


def audited(program: Program, path: Path, machine: Machine = MILL) -> Audit:
    """The audit of a plan without limits of jerk along the path, against the program."""
    result = plan(path, machine)
    return audit(result.problem, result.profile, machine, program, result.setpoints())


def turns_of(path: Path) -> NDArray[np.int64]:
    """The pieces before which the path turns back along its own line."""
    ends = path.curve.evaluate(np.arange(len(path)), path.width, 1)[1]
    starts = path.curve.evaluate(np.arange(len(path)), np.zeros(len(path)), 1)[1]
    units = [tangent / np.linalg.norm(tangent, axis=1)[:, None] for tangent in (ends[:-1], starts[1:])]
    return 1 + np.flatnonzero(np.linalg.norm(units[0] + units[1], axis=1) < 1e-6)


def assert_smooth(path: Path) -> None:
    """All derivatives to the third are continuous within runs, except where the path turns back along its own
    line; C' vanishes nowhere inside a piece."""
    inner = np.setdiff1d(np.arange(1, len(path)), [*path.runs, *turns_of(path)])
    middle = path.curve.evaluate(np.arange(len(path)), path.width / 2, 1)[1]
    assert (np.linalg.norm(middle, axis=1) > 0.01).all()
    before = path.curve.evaluate(inner - 1, path.width[inner - 1], 3)
    after = path.curve.evaluate(inner, np.zeros(len(inner)), 3)
    scale = 1 + np.abs(path.curve.control_points).max()
    for order in range(4):
        unit = np.minimum(path.width[inner - 1], path.width[inner]) ** -float(order)
        jump = np.linalg.norm(after[order] - before[order], axis=1)
        assert (jump <= 1e-9 * unit * scale).all(), order


def test_a_square_with_exact_stops_stays_exact(make_program: Any) -> None:
    for control in (PathControl.EXACT_PATH, PathControl.EXACT_STOP):
        path = smooth(make_program(SQUARE, control=control))
        np.testing.assert_array_equal(path.runs, np.arange(5))
        np.testing.assert_array_equal(path.curve.by_piece[:, 0, :2], SQUARE[:-1])
        np.testing.assert_array_equal(path.curve.by_piece[:, -1, :2], SQUARE[1:])
        assert path.fit.deviation == 0.0
        assert not path.warnings


def test_a_square_in_g64_is_one_run_with_straight_sides_that_passes_the_audit(make_program: Any) -> None:
    program = make_program(SQUARE, feed=200.0, blend_tolerance=0.1)
    path = smooth(program)
    assert_smooth(path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    sides = path.curve.degree == 2  # lines are quadratics
    assert sides.sum() == 4
    assert (path.width[sides] > 30).all()
    assert 0.09 < path.fit.deviation <= 0.1
    verdict = audited(program, path)
    assert verdict.ok
    assert verdict.to_json()["deviation"]["ratio"] > 0.9


def test_the_path_stops_where_it_turns_back_and_where_it_is_told(make_program: Any) -> None:
    points = [[0, 0], [10, 0], [20, 5], [12, 0.5], [5, 0], [5, 10], [5, 20], [0, 25], [-5, 25], [-9, 20]]
    kind = [MoveKind.LINE] * 5 + [MoveKind.RAPID] * 2 + [MoveKind.LINE] * 2
    program = make_program(points, kind=kind, dwell=[0, 0, 0, 0, 0, 0, 0, 0.5, 0])
    path = smooth(program)
    assert_smooth(path)
    np.testing.assert_array_equal(path.move[path.runs[1:] - 1, 1], [1, 7, 8])
    assert path.dwell[1] == 0.5
    assert path.warnings == (
        "line 11: the path turns back by more than 135°, and stops: no curve within the tolerance goes "
        "around it",
    )
    assert audited(program, path).ok


def test_only_turns_that_are_stops_are_warned_of(make_program: Any) -> None:
    # It turns back along its own line at X30, where it rests for no time, and by 170° at X10.
    program = make_program([[0, 0], [30, 0], [10, 0], [29.696, 3.473]], blend_tolerance=0.1)
    path = smooth(program)
    np.testing.assert_array_equal(path.move[path.runs[1:] - 1, 1], [1, 2])
    (warning,) = path.warnings
    assert warning.startswith("line 11: the path turns back")
    assert smooth(make_program([[0, 0], [30, 0], [10, 0]], blend_tolerance=0.1)).warnings == ()


def test_a_rapid_between_feed_moves_is_one_run_and_each_keeps_its_feed_to_the_corner(
    make_program: Any,
) -> None:
    # From X0 to X50, by a rapid to Y50, back to X0.
    points = [[0, 0], [50, 0], [50, 50], [0, 50]]
    kind = [MoveKind.LINE, MoveKind.RAPID, MoveKind.LINE]
    program = make_program(points, kind=kind, feed=50.0, blend_tolerance=0.1)
    path = smooth(program)
    assert_smooth(path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    assert 0.09 < path.fit.deviation <= 0.1
    rapid = path.feed == np.inf
    assert (path.move[rapid] == 1).all()
    assert set(path.feed[~rapid]) == {50.0}
    # Up to 1 % of the tolerance, the pieces of the rapid are nearer to its own line (X50) than to Y0 and Y50.
    x, y = path.curve.control_points[path.curve.offsets[:-1], :2][rapid].T
    from_feed = np.minimum(np.abs(y), np.abs(50 - y))
    assert (from_feed >= np.abs(50 - x) - 1e-3).all()
    assert 0.05 < from_feed.min() < 0.1
    assert audited(program, path).ok
    exact = make_program(points, kind=kind, feed=50.0, control=PathControl.EXACT_STOP)
    np.testing.assert_array_equal(smooth(exact).runs, np.arange(4))
    limited = [plan(own, MILL, "jerk-limited") for own in (program, exact)]
    assert all(own.audit().ok for own in limited)
    assert limited[0].time < limited[1].time - 0.05


def test_an_event_between_a_rapid_and_a_feed_move_stops_there_or_keeps_its_place() -> None:
    text = "G21 G90 G64 P0.1 F3000\nG1 X50\n{event}\nG0 Y50\nG1 X0\nM2\n"
    for event, runs in (("M3 S900", 2), ("M62 P1", 1), ("G4 P0.2", 2), ("G61", 3)):
        made = plan(read_program(text.format(event=event).encode()), MILL, "jerk-limited")
        assert len(made.path.runs) - 1 == runs, event
        assert made.audit().ok


def test_pieces_are_cut_beside_the_points_where_feed_or_tolerance_change(make_program: Any) -> None:
    angle = 0.02 * np.arange(201)
    points = 10 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    feed = np.where(np.arange(200) < 77, 30.0, 60.0)
    tolerance = np.where(np.arange(200) < 120, 0.01, 0.03)
    program = make_program(points, feed=feed, blend_tolerance=tolerance)
    path = smooth(program)
    assert_smooth(path)
    assert len(path.runs) == 2
    assert 3 < path.fit.polynomial_ratio < 20
    for limit, value in ((feed, path.feed), (tolerance, path.tolerance)):
        assert set(value) == set(limit)
        for (first, last), own in zip(path.move, value, strict=True):
            assert (limit[first : last + 1] == own).all()
    cut = int(np.flatnonzero(path.move[:, 0] == 77)[0])
    assert np.linalg.norm(path.curve.by_piece[cut, 0, :2] - points[77]) <= 0.01
    assert audited(program, path).ok


def test_lines_and_arcs_become_one_curve_near_the_true_circle(make_program: Any) -> None:
    # A slot: two lines and two half circles of radius 10 mm.
    points = [[0, -10, 0], [30, -10, 0], [30, 10, 0], [0, 10, 0], [0, -10, 0]]
    arcs = {1: ((30.0, 0.0, 0.0), 2, math.pi), 3: ((0.0, 0.0, 0.0), 2, math.pi)}
    for tolerance, control in ((0.02, PathControl.TOLERANCE), (1e-3, PathControl.EXACT_PATH)):
        program = make_program(points, arcs=arcs, blend_tolerance=0.02, control=control)
        path = smooth(program)
        assert_smooth(path)
        assert len(path.runs) == 2
        t = np.linspace(0, 1, 40)
        for move, centre in ((1, [30, 0]), (3, [0, 0])):
            own = np.flatnonzero((path.move == move).all(axis=1))
            places = path.curve.evaluate(np.repeat(own, 40), np.outer(path.width[own], t).ravel())[0]
            off = np.abs(np.hypot(*(places[:, :2] - centre).T) - 10)
            assert off.max() <= tolerance
        assert audited(program, path).ok


def test_an_exact_path_stops_in_the_corners_of_lines_only(make_program: Any) -> None:
    points = [[0, 0], [10, 0], [20, 0], [20, 10], [10, 20]]
    arcs = {3: ((10.0, 10.0, 0.0), 2, math.pi / 2)}
    program = make_program(points, arcs=arcs, control=PathControl.EXACT_PATH)
    path = smooth(program)
    np.testing.assert_array_equal(path.move[path.runs[1:] - 1, 1], [1, 3])
    assert_smooth(path)
    assert path.fit.deviation <= 1e-3
    assert audited(program, path).ok


def test_a_helix_and_rotary_axes_are_followed_as_one_curve(make_program: Any) -> None:
    machine = Machine.load("trunnion-ac")
    t = np.linspace(0, 6, 80)
    points = np.stack([40 * np.sin(t), 30 * np.cos(t), 2 * t, -20 * t / 6, 50 * np.sin(0.4 * t)], axis=1)
    program = make_program(points, axes="XYZAC", blend_tolerance=0.05)
    path = smooth(program, machine=machine)
    assert_smooth(path)
    assert (len(path.runs), path.fit.points) == (2, 79)
    assert path.fit.deviation <= 0.05
    helix = make_program(
        [[10, 0, 0], [10, 0, 5], [20, 0, 5]],
        arcs={0: ((0.0, 0.0, 0.0), 2, 2 * math.pi)},
        blend_tolerance=0.02,
    )
    path = smooth(helix)
    assert_smooth(path)
    assert audited(helix, path).ok


def test_a_curve_does_not_leave_the_travel_of_its_axes(make_program: Any) -> None:
    axes = tuple(replace(axis, travel=(0.0, 300.0)) for axis in MILL.axes)
    path = smooth(make_program(SQUARE, blend_tolerance=0.1), machine=replace(MILL, axes=axes))
    assert path.curve.control_points.min() >= -1e-6
    assert [warning.split(":")[1] for warning in path.warnings] == [
        " no smooth curve was found within the tolerance"
    ]


def test_moves_far_below_the_tolerance_are_nothing_to_follow_but_keep_their_place(make_program: Any) -> None:
    rng = np.random.default_rng(2)
    steps = np.where(rng.random((300, 1)) < 0.5, 0.2, 1e-8) * rng.normal([1.0, 0.2], 0.2, (300, 2))
    program = make_program(np.vstack([[0, 0], np.cumsum(steps, axis=0)]), blend_tolerance=0.02)
    path = smooth(program)
    assert_smooth(path)
    assert path.move[0, 0] == 0
    assert path.move[-1, 1] == 299
    assert (path.move[1:, 0] <= path.move[:-1, 1] + 1).all()
    np.testing.assert_array_equal(path.curve.control_points[-1, :2], program.target[-1, :2])
    assert audited(program, path).ok
    short = smooth(make_program([[0, 0], [1e-8, 0], [1e-8, 1e-8]], blend_tolerance=0.02))
    assert len(short) == 1


@pytest.mark.parametrize("axes", [1, 2, 3, 4, 5, 6, 7])
def test_random_points_are_followed_within_the_tolerance_stops_and_all(axes: int) -> None:
    rng = np.random.default_rng(axes)
    for case in range(12):
        step = 10.0 ** rng.uniform(-3, 1)
        tolerance = 10.0 ** rng.uniform(-3, -1)
        points = np.cumsum(rng.normal(0.4 * (case % 3), 1.0, (60, axes)) * step, axis=0)
        if case % 4 == 3:  # there and back
            points[30:39] = points[20:29][::-1]
        path = Path.from_points(points, tolerance, axes="XYZABCU"[:axes], corners=Corners.SMOOTH)
        assert path.corners is Corners.SMOOTH
        assert_smooth(path)
        assert path.fit.deviation <= tolerance
        np.testing.assert_array_equal(path.curve.control_points[0], points[0])
        np.testing.assert_array_equal(path.curve.control_points[-1], points[-1])
        # Every sample is near a move that its piece follows, or near one of their neighbours.
        share = np.linspace(0, 1, 9)
        for piece in range(len(path)):
            own = path.curve.evaluate(np.full(9, piece), share * path.width[piece])[0]
            first, last = max(path.move[piece, 0] - 1, 0), min(path.move[piece, 1] + 1, len(points) - 2)
            start, way = points[first : last + 1], np.diff(points[first : last + 2], axis=0)
            away = own[:, None] - start
            along = np.clip((away * way).sum(axis=2) / (way * way).sum(axis=1), 0, 1)
            off = np.linalg.norm(away - along[:, :, None] * way, axis=2).min(axis=1)
            assert off.max() <= tolerance * (1 + 1e-9)


def test_a_spline_of_the_program_is_followed_with_the_lines_beside_it(tmp_path: FilePath) -> None:
    file = tmp_path / "a.ngc"
    file.write_text("G64 P0.02\nF3000\nG1 X10\nG5 I5 J0 P-5 Q0 X30 Y10\nG1 X40\nM2\n")
    program = read_program(file, MILL)
    path = smooth(program)
    assert_smooth(path)
    assert len(path.runs) == 2
    assert audited(program, path).ok


def test_the_command_fit_tells_what_a_smooth_fit_makes_of_a_program(tmp_path: FilePath, capsys: Any) -> None:
    file = tmp_path / "a.ngc"
    file.write_text("G64 P0.1\nF3000\nG1 X10\nG1 Y10\nG1 X10.1 Y0\nM2\n")
    assert main(["fit", str(file), "--smooth"]) == 0
    out, err = capsys.readouterr()
    assert "in 2 runs" in out
    assert "warning: line 4: the path turns back" in err

"""Programs become paths: path control, runs, feeds, axes, travel and errors."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from feedplan.errors import InputError, MachineError, ProgramError
from feedplan.geometry.build import build_path
from feedplan.geometry.fit_settings import FitSettings
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.program.program import MoveKind, PathControl

MILL = Machine.load("mill")
SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]
CIRCLE = [[10 * math.cos(a), 10 * math.sin(a)] for a in np.linspace(0, 2 * math.pi, 201)]


def with_axes(**changes: Any) -> Machine:
    """The machine `mill` with the same change to all axes."""
    return dataclasses.replace(MILL, axes=tuple(dataclasses.replace(axis, **changes) for axis in MILL.axes))


def test_exact_stop_halts_at_every_corner_of_a_square(make_program: Any, check: Any) -> None:
    program = make_program(SQUARE, control=PathControl.EXACT_STOP)
    path = build_path(program, MILL)
    assert max(check(program, path)) < 1e-13
    np.testing.assert_array_equal(path.runs, [0, 1, 2, 3, 4])
    np.testing.assert_array_equal(path.width, 10.0)
    np.testing.assert_array_equal(path.move[:, 0], [0, 1, 2, 3])


def test_exact_stop_halts_on_a_straight_line_and_exact_path_does_not(make_program: Any) -> None:
    points = [[0, 0], [1, 1], [2, 2], [4, 4]]
    stops = build_path(make_program(points, control=PathControl.EXACT_STOP), MILL)
    path = build_path(make_program(points, control=PathControl.EXACT_PATH), MILL)
    np.testing.assert_array_equal(stops.runs, [0, 1, 2, 3])
    np.testing.assert_array_equal(path.runs, [0, 3])


def test_tolerance_rounds_the_corners_of_a_square_as_far_as_it_allows(make_program: Any, check: Any) -> None:
    program = make_program(SQUARE, blend_tolerance=0.05)
    path = build_path(program, MILL)
    assert check(program, path)[1] == pytest.approx(0.05, rel=1e-9)
    np.testing.assert_array_equal(path.runs, [0, 7])
    np.testing.assert_array_equal(path.move, [[0, 0], [0, 1], [1, 1], [1, 2], [2, 2], [2, 3], [3, 3]])
    length = 2 * 0.05 / math.sin(math.pi / 4)
    np.testing.assert_allclose(
        path.curve.by_piece[1, :, :2], [[10 - length, 0], [10, 0], [10, length]], atol=1e-12
    )
    np.testing.assert_array_equal(path.tolerance, 0.05)


def test_no_tolerance_means_exact_lines_with_stops(make_program: Any, check: Any) -> None:
    program = make_program(CIRCLE)
    path = build_path(program, MILL, tolerance=0.0)
    assert max(check(program, path)) < 1e-13
    assert len(path.runs) == 201
    assert len(build_path(make_program(CIRCLE, blend_tolerance=0.0), MILL).runs) == 201


def test_a_circle_of_short_lines_is_fitted_and_summed_up(make_program: Any, check: Any) -> None:
    program = make_program(CIRCLE)
    path = build_path(program, MILL)
    check(program, path)
    assert path.fit.points == 200
    assert path.fit.polynomials == len(path) < 50
    assert path.fit.polynomial_ratio == 200 / len(path)
    assert 0 < path.fit.deviation <= 0.005


def test_the_argument_wins_over_the_program_and_the_program_over_the_default(make_program: Any) -> None:
    def allowed(tolerance: float | None, **columns: Any) -> float:
        return float(build_path(make_program(SQUARE, **columns), MILL, tolerance).fit.deviation)

    assert allowed(None) == pytest.approx(FitSettings().default_tolerance)
    assert allowed(None, blend_tolerance=0.2) == pytest.approx(0.2)
    assert allowed(0.03, blend_tolerance=0.2) == pytest.approx(0.03)
    assert allowed(0.03, control=PathControl.EXACT_PATH) == 0.0
    assert allowed(0.03, control=PathControl.EXACT_STOP) == 0.0


def test_q_bounds_the_fit_and_not_the_corners(make_program: Any, check: Any) -> None:
    points = [*CIRCLE, [30, 0]]
    loose = make_program(points, blend_tolerance=0.1, fit_tolerance=0.1)
    tight = make_program(points, blend_tolerance=0.1, fit_tolerance=2e-3)
    paths = [build_path(program, MILL) for program in (loose, tight)]
    for program, path in zip((loose, tight), paths, strict=True):
        # The corner from the circle into the line uses the rest of the tolerance.
        assert check(program, path)[1] == pytest.approx(0.1, rel=0.05)
    assert len(paths[1]) > 1.3 * len(paths[0])
    unfitted = build_path(make_program(points, blend_tolerance=0.1, fit_tolerance=0.0), MILL)
    assert unfitted.fit.points == 0


def test_the_stricter_of_two_modes_governs_the_joint(make_program: Any, check: Any) -> None:
    control = [PathControl.TOLERANCE, PathControl.TOLERANCE, PathControl.EXACT_PATH, PathControl.TOLERANCE]
    program = make_program(SQUARE, control=control)
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.move[path.runs[1:] - 1, 1], [1, 2, 3])
    exact = path.curve.by_piece[(path.move == 2).all(axis=1)]
    np.testing.assert_array_equal(exact[:, [0, 2], :2], [[[10, 10], [0, 10]]])


def test_stops_and_dwells_end_runs(make_program: Any, check: Any) -> None:
    dwell = np.zeros(200)
    dwell[99] = 0.5
    program = make_program(CIRCLE, dwell=dwell, stop=[i in (49, 199) for i in range(200)])
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.dwell, [0, 0.5, 0])
    np.testing.assert_array_equal(path.move[path.runs[1:] - 1, 1], [49, 99, 199])
    np.testing.assert_array_equal(path.curve.by_piece[path.runs[1], 0], program.target[49])


def test_rapids_are_lines_without_a_feed_and_share_corners(make_program: Any, check: Any) -> None:
    kind = [MoveKind.RAPID, MoveKind.LINE, MoveKind.LINE, MoveKind.RAPID]
    program = make_program(SQUARE, kind=kind)
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    # Where the feed changes at a corner, it changes in the middle of the blend.
    np.testing.assert_array_equal(path.feed, [np.inf, np.inf, 50, 50, 50, 50, 50, np.inf, np.inf])
    np.testing.assert_array_equal(path.move[[1, 2]], [[0, 0], [1, 1]])


def test_feeds_change_at_the_vertex_and_leave_the_curve_whole(make_program: Any, check: Any) -> None:
    feed = np.where(np.arange(200) < 70, 20.0, 80.0)
    program = make_program(CIRCLE, feed=feed)
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, len(path)])
    (change,) = np.flatnonzero(np.diff(path.feed))
    assert np.linalg.norm(path.curve.by_piece[change, 2] - program.target[69]) < 0.005
    assert path.fit.polynomials in (len(path), len(path) - 1)


def test_corners_are_passed_with_a_velocity_jump_where_all_moving_axes_allow_one(make_program: Any) -> None:
    program = make_program(SQUARE, control=PathControl.EXACT_PATH)
    np.testing.assert_array_equal(build_path(program, with_axes(max_velocity_jump=5.0)).runs, [0, 4])
    one = (dataclasses.replace(MILL.axes[0], max_velocity_jump=5.0), *MILL.axes[1:])
    assert len(build_path(program, dataclasses.replace(MILL, axes=one)).runs) == 5
    moving = tuple(dataclasses.replace(axis, max_velocity_jump=5.0) for axis in MILL.axes[:2])
    still = dataclasses.replace(MILL, axes=(*moving, MILL.axes[2]))
    assert len(build_path(program, still).runs) == 2
    exact = make_program(SQUARE, control=PathControl.EXACT_STOP)
    assert len(build_path(exact, with_axes(max_velocity_jump=5.0)).runs) == 5


def test_the_path_has_the_axes_of_the_machine_in_its_order(make_program: Any, check: Any) -> None:
    machine = dataclasses.replace(MILL, axes=(MILL.axes[1], MILL.axes[0]))
    program = make_program([[1, 2, 5, 7], [4, 6, 5, 7]], axes="XYZA")
    path = build_path(program, machine)
    check(program, path)
    assert path.axes == ("Y", "X")
    np.testing.assert_array_equal(path.curve.by_piece[0, [0, 2]], [[2, 1], [6, 4]])


def test_an_axis_that_moves_must_be_there(make_program: Any) -> None:
    program = make_program([[0, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 3]], axes="XYZA")
    with pytest.raises(MachineError, match=r"test\.ngc, line 11: axis A moves and machine mill has none"):
        build_path(program, MILL)
    flat = dataclasses.replace(MILL, axes=MILL.axes[:1])
    full_turn = make_program([[1, 0], [2, 0], [2, 0]], arcs={1: ((1, 0, 0), 2, 2 * math.pi)})
    with pytest.raises(MachineError, match="line 11: axis Y moves"):
        build_path(full_turn, flat)


def test_a_feed_counts_along_the_linear_axes_where_they_move(make_program: Any, check: Any) -> None:
    rotary = dataclasses.replace(MILL, axes=(*MILL.axes, Axis("A", 100.0, 1000.0)))
    points = [[0, 0, 0, 0], [3, 0, 0, 4], [3, 0, 0, 10], [5, 0, 0, 10]]
    program = make_program(points, axes="XYZA", control=PathControl.EXACT_STOP, feed=6.0)
    path = build_path(program, rotary)
    np.testing.assert_array_equal(path.feed, 6.0)
    # The moves: X and A, A alone, X alone.
    free = np.inf
    np.testing.assert_array_equal(path.group_feed, [[6.0, free, free], [free, free, 6.0], [6.0, free, free]])
    helix = make_program(
        [[10, 0, 0, 0], [-10, 0, 0, 30 * math.pi]],
        axes="XYZA",
        arcs={0: ((0, 0, 0), 2, math.pi)},
        feed=6.0,
        control=PathControl.EXACT_PATH,
    )
    np.testing.assert_array_equal(build_path(helix, rotary).group_feed[:, 0], 6.0)
    blend = make_program([[0, 0, 0, 0], [9, 0, 0, 0], [9, 0, 0, 9]], axes="XYZA", feed=np.array([6.0, 2.0]))
    path = build_path(blend, rotary)
    # The whole blend keeps the feeds of both moves.
    corner = [[6.0, free, 2.0]] * (len(path) - 2)
    np.testing.assert_array_equal(path.group_feed, [[6.0, free, free], *corner, [free, free, 2.0]])
    assert build_path(make_program([[0, 0, 0], [3, 0, 4]]), rotary).group_feed is None
    # A sequence of points is not fitted as one curve where an equal feed counts along other axes.
    turn = [[0.2 * min(i, 10), 0, 0, 0.2 * max(i, 10)] for i in range(21)]
    path = build_path(make_program(turn, axes="XYZA", feed=6.0), rotary)
    assert (np.isfinite(path.group_feed).sum(axis=1) == 1).sum() >= 2


def test_positions_outside_the_travel_name_line_axis_and_limit(make_program: Any) -> None:
    machine = with_axes(travel=(-10.0, 10.0))
    build_path(make_program(SQUARE), machine)
    with pytest.raises(InputError, match=r"line 11: Y reaches 10\.5 mm, its travel ends at 10 mm"):
        build_path(make_program([[0, 0], [1, 0], [1, 10.5], [0, 0]]), machine)
    with pytest.raises(InputError, match=r"line 10: X reaches -11 mm, its travel begins at -10 mm"):
        build_path(make_program([[-11, 0], [1, 0]]), machine)
    turning = dataclasses.replace(
        machine, axes=(*machine.axes, Axis("A", 100.0, 1000.0, travel=(-90.0, 90.0)))
    )
    with pytest.raises(InputError, match=r"line 10: A reaches 400 deg, its travel ends at 90 deg: move"):
        build_path(make_program([[0, 0, 0, 0], [1, 0, 0, 400]], axes="XYZA"), turning)
    # The programmed arc only touches the limit and is accepted; its fitted curve exceeds it slightly.
    touching = make_program([[0, -10], [0, 10]], arcs={0: ((0, 0, 0), 2, math.pi)})
    build_path(touching, machine)
    beyond = make_program([[0, -10], [0, 10]], arcs={0: ((0.01, 0, 0), 2, math.pi)})
    with pytest.raises(InputError, match=r"line 10: X reaches 10\.01 mm"):
        build_path(beyond, machine)


def test_faulty_moves_are_named(make_program: Any) -> None:
    def fault(points: Any, **columns: Any) -> str:
        with pytest.raises(ProgramError) as caught:
            build_path(make_program(points, **columns), MILL)
        assert caught.value.line == 11
        return str(caught.value)

    assert "no length" in fault([[0, 0], [1, 0], [1, 0]])
    assert "not a finite number" in fault([[0, 0], [1, 0], [math.nan, 0]])
    assert "no positive feed" in fault([[0, 0], [1, 0], [2, 0]], feed=[1.0, 0.0])
    assert "no radius" in fault([[0, 0], [1, 0], [2, 0]], arcs={1: ((1, 0, 0), 2, 1.0)})
    assert "does not lead to its end" in fault([[0, 0], [1, 0], [3, 0]], arcs={1: ((2, 0, 0), 2, 1.0)})
    assert "too many turns" in fault([[0, 0], [1, 0], [1, 0]], arcs={1: ((2, 0, 0), 2, 2e9 * math.pi)})


def test_unusable_arguments_are_refused(make_program: Any) -> None:
    for tolerance in (-1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="tolerance is"):
            build_path(make_program(SQUARE), MILL, tolerance)
    for setting in ({"alpha": 0.0}, {"max_chord": math.nan}, {"fit_share": 1.0}):
        with pytest.raises(InputError, match=f"fit setting {next(iter(setting))}"):
            FitSettings(**setting)


def test_one_move_and_no_move_make_paths(make_program: Any, check: Any) -> None:
    program = make_program([[0, 0], [1e-6, 0]])
    path = build_path(program, MILL)
    check(program, path)
    np.testing.assert_array_equal(path.runs, [0, 1])
    empty = build_path(make_program([[0, 0]]), MILL)
    assert len(empty) == 0
    np.testing.assert_array_equal(empty.runs, [0])
    assert len(empty.dwell) == 0

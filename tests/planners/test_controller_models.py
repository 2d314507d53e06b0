"""The rules of grbl, Klipper, Marlin and LinuxCNC: by hand, block by block, and against a simulator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan import Axis, InputError, Machine, plan
from feedplan.constraints.problem import Problem, build_problem
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.geometry.path import Path
from feedplan.machine.controller import Controller
from feedplan.planners import junction_deviation, linuxcnc, planner
from feedplan.planners._junctions import Junctions
from feedplan.planners._look_ahead import look_ahead
from feedplan.planners._queue import Chords
from feedplan.planners._segments import CurvePlaces
from feedplan.planners.junction_deviation import corner_speed
from feedplan.program.read import read_program
from feedplan.today import time_by
from tests.planners import controller_programs
from tests.turns import arc

Array = NDArray[np.float64]

A = 500.0
PLANE = Machine("plane", tuple(Axis(name, 100.0, A) for name in "XYZ"), period=0.001)


def program(points: Any, feed: float = 6000.0, tolerance: float | None = 0.01) -> str:
    """A program of lines through points from the origin; feed [mm/min]."""
    mode = "G64" if tolerance is None else f"G64 P{tolerance:g}"
    rows = [" ".join(f"{name}{v:.9f}" for name, v in zip("XYZ", point, strict=False)) for point in points]
    return "\n".join(["G21 G90 G17 G94", mode, f"F{feed:.9g}", *(f"G1 {row}" for row in rows), "M2"]) + "\n"


def problem_of(text: str, corners: Corners = Corners.PROGRAMMED, machine: Machine = PLANE) -> Problem:
    path = build_path(read_program(text, machine), machine, corners=corners)
    return build_problem(path, machine)


def speeds(profile: Any, problem: Problem) -> Array:
    """Speeds at the starts of the pieces and at the end [mm/s], on lines with constant |C'|."""
    first = np.searchsorted(profile.piece, np.arange(len(problem.path)))
    rate = np.linalg.norm(problem.curve.evaluate(profile.piece[first], profile.u0[first], 1)[1], axis=1)
    return np.append(np.sqrt(profile.p0[first]) * rate, 0.0)


def random_polyline(seed: int, count: int = 60) -> Array:
    random = np.random.default_rng(seed)
    length, way = 10.0 ** random.uniform(-1.5, 1.0, count), np.cumsum(random.normal(0.0, 0.6, count))
    return np.cumsum(length[:, None] * np.stack([np.cos(way), np.sin(way)], axis=1), axis=0)


@pytest.mark.parametrize("blocks", [2, 3, 5])
def test_a_chain_is_as_fast_as_the_blocks_behind_allow_a_stop(blocks: int) -> None:
    # Lines of 1 mm that hardly turn: the buffer limits the speed, not the junctions: v² = 2 A (blocks − 1).
    points = [(i, 1e-4 * (i % 2)) for i in range(1, 31)]
    problem = problem_of(program(points))
    known = speeds(junction_deviation.plan(problem, 1e6, blocks=blocks), problem)
    reach = 2.0 * A * np.minimum(np.minimum(np.arange(31), blocks - 1), np.arange(30, -1, -1))
    np.testing.assert_allclose(known, np.minimum(np.sqrt(reach), 100.0), rtol=1e-5)
    # If all blocks fit into the buffer, the end of the program is known.
    all_known = junction_deviation.plan(problem, 1e6)
    assert junction_deviation.plan(problem, 1e6, blocks=31).time == all_known.time
    assert junction_deviation.plan(problem, 1e6, blocks=blocks).time > all_known.time


def ring_buffer(limit: Array, gain: Array, blocks: int) -> Array:
    """Speeds at the ends of blocks [mm/s] by a buffer of `blocks` blocks that leave one after the other."""
    square = np.zeros(len(gain) + 1)
    for first in range(len(gain)):
        known = range(first, min(first + blocks, len(gain)))
        # Planned to a stop at the end of the last known block, from the present speed of the first one.
        back = 0.0
        for i in reversed(known):
            if i == first:
                break
            back = min(limit[i] ** 2, back + gain[i])
        square[first + 1] = min(back, square[first] + gain[first])
    return np.sqrt(square)


@pytest.mark.parametrize("seed", range(6))
def test_limited_look_ahead_is_what_a_ring_buffer_does(seed: int) -> None:
    problem = problem_of(program(random_polyline(seed)))
    limit = np.minimum(corner_speed(problem, Junctions(0.02)), 100.0)
    profile = junction_deviation.plan(problem, 0.02, blocks=7)
    control, offsets = problem.curve.control_points, problem.curve.offsets
    way = control[offsets[1:] - 1] - control[offsets[:-1]]
    length = np.linalg.norm(way, axis=1)
    gain = 2.0 * length * (A * length / np.abs(way).max(axis=1))
    expected = ring_buffer(limit, gain, 7)
    np.testing.assert_allclose(speeds(profile, problem), expected, rtol=1e-6, atol=1e-6)


def test_more_blocks_are_never_slower() -> None:
    problem = problem_of(program(random_polyline(11, 200)))
    times = [junction_deviation.plan(problem, 0.01, blocks=blocks).time for blocks in (2, 3, 6, 15, 100, 500)]
    assert times == sorted(times, reverse=True)
    assert times[0] > times[-1] == junction_deviation.plan(problem, 0.01).time


def circle(radius: float, feed: float = 1e4) -> Problem:
    """Half a circle, on a machine with acceleration A along the axes and up to √2 A along diagonals."""
    curve = arc([radius, 0.0], (0.0, 0.0), math.pi).with_width([radius * 1.5] * 2)
    machine = Machine("fast", tuple(Axis(name, 1e4, A) for name in "XY"), period=0.001)
    return build_problem(Path.from_curve(curve, feed=feed), machine)


def top(profile: Any, problem: Problem) -> float:
    """The greatest speed at the starts of a profile's arcs [mm/s]."""
    rate = np.linalg.norm(problem.curve.evaluate(profile.piece, profile.u0, 1)[1], axis=1)
    return float((np.sqrt(profile.p0) * rate).max())


def test_chopped_arcs_have_the_speed_from_chord_to_chord() -> None:
    # grbl divides arcs into chords with an error up to e: v² = a δ s/(1 − s) with s = cos(turn/2) = 1 − e/r,
    # about a r δ/e. With grbl's own δ = 0.01 mm and e = 0.002 mm this exceeds the axes by far, so δ is
    # smaller here. The acceleration a is least along an axis, and √2 times that along a diagonal.
    radius, problem = 5.0, circle(5.0)
    s = 1.0 - 0.002 / radius
    slow = math.sqrt(A * 0.001 * s / (1.0 - s))
    assert slow == pytest.approx(math.sqrt(0.5 * A * radius), rel=1e-3)
    reached = top(junction_deviation.plan(problem, 0.001, arc_tolerance=0.002), problem)
    assert slow * (1.0 - 1e-3) < reached < slow * 2.0**0.25 * (1.0 + 1e-3)
    faster = top(junction_deviation.plan(problem, 0.0015, arc_tolerance=0.002), problem)
    assert faster == pytest.approx(math.sqrt(1.5) * reached, rel=1e-9)


def test_klipper_chops_arcs_by_length_and_keeps_half_of_each_chord() -> None:
    # Chords of 1 mm on a circle of 20 mm turn by 0.05 rad: the rule for half of each chord gives v² = a r.
    problem = circle(20.0)
    options: dict[str, Any] = {"arc_segment": 1.0, "short_lines": "half", "max_acceleration": A}
    fast = junction_deviation.plan(problem, square_corner_velocity=100.0, **options)
    assert top(fast, problem) == pytest.approx(math.sqrt(A * 20.0), rel=2e-3)
    # The corner speed v₉₀ = 2 mm/s limits to v² = v₉₀² (√2 − 1) s/(1 − s).
    s = math.cos(0.025)
    slow = junction_deviation.plan(problem, square_corner_velocity=2.0, **options)
    expected = 2.0 * math.sqrt((math.sqrt(2.0) - 1.0) * s / (1.0 - s))
    assert expected < math.sqrt(A * 20.0)
    assert top(slow, problem) == pytest.approx(expected, rel=1e-3)


def test_chords_turn_by_a_right_angle_at_most() -> None:
    radius = np.array([1e-3, 1.0, np.inf])
    np.testing.assert_allclose(2.0 * Chords(length=1.0).half_turn(radius), [math.pi / 2, 1.0, 0.0])
    half = Chords(tolerance=0.002).half_turn(radius)
    np.testing.assert_allclose(1.0 - np.cos(half[1]), 0.002, rtol=1e-9)
    assert half[0] == math.pi / 4
    assert half[2] == 0.0


def test_short_lines_hold_klipper_and_marlin_back() -> None:
    turn, length = 0.5, 0.4
    ways = np.where(np.arange(30) % 2, turn / 2, -turn / 2)
    points = np.cumsum(length * np.stack([np.cos(ways), np.sin(ways)], axis=1), axis=0)
    problem = problem_of(program(points))
    corners = slice(2, -2)
    half = corner_speed(problem, Junctions(10.0, short_lines="half", acceleration=A))[corners]
    np.testing.assert_allclose(half, math.sqrt(0.5 * A * length / math.tan(turn / 2)), rtol=1e-5)
    chord = corner_speed(problem, Junctions(10.0, short_lines="arc"))[corners]
    np.testing.assert_allclose(chord, math.sqrt(A * length / turn), rtol=1e-5)
    # Marlin's rule holds only for lines below 1 mm and turns below 45°.
    assert (corner_speed(problem, Junctions(10.0))[corners] > chord).all()
    long = problem_of(program(3.0 * points))
    assert (corner_speed(long, Junctions(10.0, short_lines="arc"))[corners] > 30.0).all()


def test_classic_jerk_is_the_jump_of_each_axis() -> None:
    square = problem_of(program([(10, 0), (10, 10), (4, 10), (10, 10), (10, 10, 5)]))
    speed = corner_speed(square, Junctions(0.01, axis_jumps=(8.0, 9.0, 0.5)))
    # A right angle: X stops and Y starts; a reversal of X counts once; the limit of Z is the least.
    np.testing.assert_allclose(speed[1:-1], [8.0, 8.0, 8.0, 0.5])


def test_half_of_a_single_line_is_at_one_speed_by_a_cruise_ratio_of_a_half() -> None:
    length = 8.0
    problem = problem_of(program([(length, 0)], feed=6e4))
    for ratio in (0.0, 0.5, 0.8):
        profile = junction_deviation.plan(problem, cruise_ratio=ratio)
        v = math.sqrt((1.0 - ratio) * A * length)
        assert profile.time == pytest.approx(2.0 * v / A + ratio * length / v, rel=1e-9)


def by_hills(limit: Array, gain: Array, part: float) -> Array:
    """The greatest speed of each block [mm/s]: that of its hill's top with `part` of the acceleration."""
    less, square = part * gain, limit.astype(float) ** 2
    square[[0, -1]] = 0.0
    for i in range(len(less)):
        square[i + 1] = min(square[i + 1], square[i] + less[i])
    for i in reversed(range(len(less))):
        square[i] = min(square[i], square[i + 1] + less[i])
    tops = np.empty(len(less))
    for i in range(len(less)):
        # A hill: forward as long as the smoothed speeds rise, or back as long as they fall.
        up = i
        while square[up] + less[up] <= square[up + 1] * (1 + 1e-9) and up + 1 < len(less):
            up += 1
        down = i
        while square[down] >= (square[down + 1] + less[down]) * (1 - 1e-9) and down > 0:
            down -= 1
        falls = square[i] >= (square[i + 1] + less[i]) * (1 - 1e-9)
        j = down if falls else up
        tops[i] = 0.5 * (square[j] + square[j + 1] + less[j])
        if falls:  # the top of a full rise and a full fall is where they meet
            tops[i] = max(tops[i], square[down])
    return np.sqrt(tops)


@pytest.mark.parametrize("seed", range(4))
def test_the_cruise_ratio_keeps_every_hill_below_its_smoothed_top(seed: int) -> None:
    problem = problem_of(program(random_polyline(seed + 50)))
    rough = junction_deviation.plan(problem, square_corner_velocity=5.0)
    smooth = junction_deviation.plan(problem, square_corner_velocity=5.0, cruise_ratio=0.5)
    assert smooth.time > rough.time
    limit = np.minimum(corner_speed(problem, Junctions(0.01, 5.0)), 100.0)
    control, offsets = problem.curve.control_points, problem.curve.offsets
    way = control[offsets[1:] - 1] - control[offsets[:-1]]
    length = np.linalg.norm(way, axis=1)
    gain = 2.0 * length * (A * length / np.abs(way).max(axis=1))
    tops = np.minimum(by_hills(limit, gain, 0.5), 100.0)
    rate = np.linalg.norm(problem.curve.evaluate(smooth.piece, smooth.u0, 1)[1], axis=1)
    greatest = np.maximum(np.sqrt(smooth.p0), np.sqrt(smooth.p1)) * rate
    by_piece = np.zeros(len(problem.path))
    np.maximum.at(by_piece, smooth.piece, greatest)
    assert (by_piece <= tops * (1.0 + 1e-6)).all()
    # Hills with enough room reach their tops.
    assert (by_piece >= tops * (1.0 - 1e-6)).any()


def test_limits_along_the_path_hold_in_every_direction() -> None:
    problem = problem_of(program([(10, 10)], feed=6e4))
    length = 10.0 * math.sqrt(2.0)
    free = junction_deviation.plan(problem)
    assert free.time == pytest.approx(2.0 * math.sqrt(length / (math.sqrt(2.0) * A)), rel=1e-9)
    held = junction_deviation.plan(problem, max_acceleration=400.0, max_velocity=50.0)
    assert held.time == pytest.approx(length / 50.0 + 50.0 / 400.0, rel=1e-9)
    # The plan keeps the limits of the axes, and each axis has 1/√2 of the acceleration along the path.
    made = plan(program([(10, 10)], feed=6e4), PLANE, "junction-deviation", max_acceleration=400.0)
    assert made.audit().ok
    assert abs(made.at(1e-3).acceleration[0]) == pytest.approx(400.0 / math.sqrt(2.0), rel=1e-9)
    for model in (junction_deviation.plan, linuxcnc.plan):
        with pytest.raises(
            InputError, match=r"the greatest velocity along the path is 0 mm/s: give a positive"
        ):
            model(problem, max_velocity=0.0)


def test_linuxcnc_turns_a_square_on_arcs_with_half_of_the_acceleration_along_them() -> None:
    feed, tolerance = 40.0, 0.1
    problem = problem_of(program([(10, 0), (10, 10), (0, 10), (0, 0)], 60 * feed, tolerance), Corners.JOINED)
    radius = tolerance / (math.sqrt(2.0) - 1.0)
    v = math.sqrt(0.5 * math.sqrt(3.0) * A * radius)

    def line(length: float, before: float, after: float, a: float = A) -> float:
        ramps = (2.0 * feed**2 - before**2 - after**2) / (2.0 * a)
        return (2.0 * feed - before - after) / a + (length - ramps) / feed

    # The last line, before the stop, has only half of the acceleration.
    ends = line(10 - radius, 0, v) + line(10 - radius, v, 0, 0.5 * A)
    lines = ends + 2.0 * line(10 - 2.0 * radius, v, v)
    assert planner("linuxcnc")(problem).time == pytest.approx(lines + 1.5 * math.pi * radius / v, rel=1e-9)


def test_arcs_of_linuxcnc_leave_along_the_path_what_the_circle_leaves() -> None:
    along_x, along_y = np.array([[1.0, 0.0]] * 2), np.array([[0.0, 1.0]] * 2)
    # A bend that uses 0.6 A leaves 0.8 A along the path; where the bend itself limits the speed, 0.5 A.
    speed = np.sqrt(A * 10.0 * np.array([0.6, 5.0]))
    places = CurvePlaces(along_x, along_y, np.full((2, 2), A), np.full(2, 10.0), speed)
    ways, across = linuxcnc.on_arcs(places)
    np.testing.assert_allclose(ways, [[0.8 * A, 0.5 * A]] * 2, rtol=1e-12)
    np.testing.assert_allclose(across, 0.5 * math.sqrt(3.0) * A, rtol=1e-12)


def test_linuxcnc_knows_so_many_segments_and_gives_no_block_less_than_a_period() -> None:
    # Lines of 1 mm on a smooth circle of 40 sides: arcs between them touch; a corner counts as two segments.
    turn = 2.0 * np.pi * np.arange(1, 41) / 40
    points = 6.37 * np.stack([np.sin(turn), 1.0 - np.cos(turn)], axis=1)
    problem = problem_of(program(points, tolerance=0.02), Corners.ARCS)
    deep = linuxcnc.plan(problem)
    shallow = linuxcnc.plan(problem, depth=2)
    assert shallow.time > 1.2 * deep.time
    for depth in (0, 1.5, "4"):
        with pytest.raises(InputError, match=r"the depth is .*: give a whole number from 1"):
            linuxcnc.plan(problem, depth=depth)  # type: ignore[arg-type]
    # Blocks of 0.05 mm at a period of 2 ms: the speed is at most 0.05/0.00204 mm/s.
    coarse = Machine("coarse", PLANE.axes, period=0.002)
    points = [(0.05 * i, 0.0003 * (i % 2)) for i in range(1, 200)]
    slow = problem_of(program(points, tolerance=0.02), Corners.ARCS, coarse)
    profile = linuxcnc.plan(slow)
    time = np.bincount(slow.path.move[profile.piece, 1], profile.duration)
    np.testing.assert_allclose(time[30:-30], 1.02 * 0.002, rtol=1e-6)
    assert look_ahead(slow, slow.junction_speed, linuxcnc.on_arcs).time < 0.9 * profile.time


@pytest.mark.parametrize("seed", range(4))
def test_points_near_lines_are_left_out_and_no_others(seed: int) -> None:
    random = np.random.default_rng(seed)
    turn = np.linspace(0.0, 5.0, 300)
    points = 20.0 * np.stack([np.cos(turn), np.sin(2.0 * turn)], axis=1) + random.normal(0.0, 0.004, (300, 2))
    points = np.vstack([[0.0, 0.0], points])
    text = program(points[1:], tolerance=0.05)
    path = build_path(read_program(text, PLANE), PLANE, corners=Corners.JOINED)
    ends = np.unique(path.move[:, 1]) + 1
    starts = np.concatenate([[0], ends[:-1]])
    assert len(ends) < 150
    for first, last in zip(starts, ends, strict=True):
        assert distance(points[first : last + 1]) <= 0.05 + 1e-6
        # With the next point one of the points would be too far from the line.
        assert last == 300 or distance(points[first : last + 2]) > 0.05 - 1e-6
    # Each piece knows the moves that it follows, and its tolerance.
    np.testing.assert_array_equal(path.move[1:, 0] <= path.move[:-1, 1] + 1, True)
    np.testing.assert_allclose(path.tolerance, 0.1)


def distance(points: Array) -> float:
    """The greatest distance of points from the line between the first and the last one."""
    way = points[-1] - points[0]
    share = np.clip((points - points[0]) @ way / (way @ way), 0.0, 1.0)
    return float(np.linalg.norm(points - points[0] - share[:, None] * way, axis=1).max())


def test_what_may_not_be_joined_is_not() -> None:
    straight = "".join(f"G1 X{i}\n" for i in range(1, 9))
    joined = problem_of("G21 G90 G64 P0.01 F600\n" + straight + "M2\n", Corners.JOINED)
    assert len(joined.path) == 1
    np.testing.assert_array_equal(joined.path.move, [[0, 7]])
    for words, pieces in (
        (straight.replace("X4", "X4 F700"), 2),  # another feed, from X4 on
        (straight.replace("X4\n", "X4\nM8\n"), 2),  # a stop
        (straight.replace("G1 X4", "G0 X4"), 3),  # a rapid
        (straight.replace("G1 X4\n", "G1 X4\nG61\n"), 5),  # the exact path after X4
    ):
        assert len(problem_of("G21 G90 G64 P0.01 F600\n" + words + "M2\n", Corners.JOINED).path) == pieces
    # Q0 joins no lines: Q has priority over P.
    assert len(problem_of("G21 G90 G64 P0.01 Q0 F600\n" + straight + "M2\n", Corners.JOINED).path) == 8


# Times in the simulator of LinuxCNC 2.9 [s], at 100 mm/s and 500 mm/s² for each axis, servo period 1 ms.
MEASURED = {"trochoid": 10.510, "zigzag": 12.029, "slots": 13.262, "pause": 3.695}


@pytest.mark.parametrize("name", MEASURED)
def test_the_model_of_linuxcnc_is_within_one_percent_of_its_simulator(name: str) -> None:
    text = getattr(controller_programs, name)()
    time = time_by(Controller("linuxcnc"), read_program(text, PLANE), PLANE, None)
    assert time == pytest.approx(MEASURED[name], rel=0.01)


def test_every_option_is_checked_in_a_sentence() -> None:
    cases: tuple[tuple[dict[str, Any], str], ...] = (
        ({"blocks": 1}, r"the number of blocks is 1: give a whole number from 2"),
        ({"arc_tolerance": -1.0}, r"the arc tolerance is -1 mm: give a positive number"),
        ({"arc_segment": 0.0}, r"the arc segment is 0 mm: give a positive number"),
        ({"short_lines": "some"}, r"short_lines 'some': use one of free, half, arc"),
        ({"cruise_ratio": 1.0}, r"the cruise ratio is 1(\.0)?: give a number from 0 to less than 1"),
        ({"axis_jumps": [1.0, 2.0]}, r"axis_jumps is \[1.0, 2.0\]: give three positive numbers"),
        ({"axis_jumps": [1.0, 2.0, 0.0]}, r"a jump of axis_jumps is 0 mm/s: give a positive number"),
    )
    for options, sentence in cases:
        with pytest.raises(InputError, match=sentence):
            plan(program([(1, 0), (1, 1)]), PLANE, "junction-deviation", **options)

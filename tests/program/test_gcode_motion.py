"""Straight moves, arcs and their feeds: cases that can be checked by hand."""

import math

import numpy as np
import pytest

from feedplan.program.gcode import read_gcode
from feedplan.program.program import MoveKind, Program

INF = math.inf


def read(text: str) -> Program:
    return read_gcode(f"G21\n{text}\nM2\n".encode())


def test_a_square_comes_back_as_its_corners() -> None:
    program = read("G0 X10 Y0\nG1 Y10 F600\nX0\nY0\nX10")
    assert program.axes == ("X", "Y", "Z")
    assert program.start.tolist() == [0, 0, 0]
    assert program.kind.tolist() == [MoveKind.RAPID] + 4 * [MoveKind.LINE]
    assert program.target.tolist() == [[10, 0, 0], [10, 10, 0], [0, 10, 0], [0, 0, 0], [10, 0, 0]]
    assert program.feed.tolist() == [INF, 10, 10, 10, 10]
    assert program.line.tolist() == [2, 3, 4, 5, 6]
    assert program.stop.tolist() == [False, False, False, False, True]
    assert program.warnings == ()


def test_inches_scale_lengths_and_feeds() -> None:
    program = read("G20 G0 X1\nG1 Y2 F60\nG21 X0")
    assert program.target.tolist() == [[25.4, 0, 0], [25.4, 50.8, 0], [0, 50.8, 0]]
    assert program.feed.tolist() == [INF, 25.4, 25.4]


def test_the_feed_counts_in_the_units_of_its_own_block() -> None:
    assert read("G20 G1 X1 F60").feed.tolist() == [25.4]
    assert read("F60\nG20 G1 X1").feed.tolist() == [1.0]


def test_incremental_moves_add_up() -> None:
    program = read("G91 G0 X1 Y2\nX1\nG90 X5\nG91 Y-2")
    assert program.target.tolist() == [[1, 2, 0], [2, 2, 0], [5, 2, 0], [5, 0, 0]]


def test_columns_appear_in_axis_order_with_the_letters_that_occur() -> None:
    program = read("G0 X1\nW3\nG1 A90 F60")
    assert program.axes == ("X", "Y", "Z", "A", "W")
    assert program.target.tolist() == [[1, 0, 0, 0, 0], [1, 0, 0, 0, 3], [1, 0, 0, 90, 3]]


def test_rotary_axes_know_no_inches() -> None:
    program = read("G20 G1 X1 A90 F60\nA180\nU1")
    assert program.target[:, 3].tolist() == [90, 180, 180]
    assert program.feed.tolist() == [25.4, 1.0, 25.4]


def test_inverse_time_feeds_are_lengths_times_the_rate() -> None:
    program = read("G93\nG1 X3 Y4 F60\nX3 Y4 A30 F2\nG3 X-5 Y0 I-3 J-4 F6\nG0 Z1\nU6 W8\nG1 U0 W0 F60")
    quarter = math.atan2(4, 3)
    expected = [5.0, 30 * 2 / 60, 5 * (math.pi - quarter) * 6 / 60, INF, INF, 10.0]
    np.testing.assert_allclose(program.feed, expected, rtol=1e-14)


def test_feed_per_turn_follows_the_spindle() -> None:
    program = read("G95 S1200 M3\nG1 X1 F0.5\nS600\nX2\nG94 X3 F60")
    assert program.feed.tolist() == [10.0, 5.0, 1.0]


def test_a_quarter_circle_has_centre_normal_and_sweep() -> None:
    program = read("G0 X10\nG3 X0 Y10 I-10 J0 F600")
    assert program.kind.tolist() == [MoveKind.RAPID, MoveKind.ARC]
    assert program.arc_move.tolist() == [1]
    assert program.arc_centre.tolist() == [[0, 0, 0]]
    assert program.arc_normal.tolist() == [2]
    assert program.arc_angle == pytest.approx([math.pi / 2], abs=1e-15)
    assert program.target[-1].tolist() == [0, 10, 0]


@pytest.mark.parametrize(
    ("block", "angle"),
    [
        ("G3 X0 Y10 I-10", math.pi / 2),
        ("G2 X0 Y10 I-10", -3 * math.pi / 2),
        ("G3 X0 Y10 R10", math.pi / 2),
        ("G3 X10 Y0 I-10", 2 * math.pi),
        ("G3 I-10", 2 * math.pi),
        ("G2 I-10 Z4", -2 * math.pi),
        ("G3 X0 Y10 I-10 P3", 4.5 * math.pi),
        ("G3 X0 Y10 R10 P2", 2.5 * math.pi),
        ("G90.1 G3 X0 Y10 I0 J0", math.pi / 2),
        ("G91 G3 X-10 Y10 I-10", math.pi / 2),
    ],
)
def test_each_way_to_write_an_arc_about_the_origin(block: str, angle: float) -> None:
    program = read(f"G0 X10\nF600 {block}")
    assert program.arc_angle == pytest.approx([angle], abs=1e-14)
    np.testing.assert_allclose(program.arc_centre, [[0, 0, 0]], atol=1e-14)


def test_a_helix_climbs_to_its_target() -> None:
    program = read("G0 X10 Z1\nG2 X-10 I-10 Z5 F600")
    assert program.target[-1].tolist() == [-10, 0, 5]
    assert program.arc_centre.tolist() == [[0, 0, 1]]


def test_the_planes_turn_about_their_normals() -> None:
    xz = read("G18 G0 Z10\nG3 X10 Z0 K-10 F600")
    assert (xz.arc_normal.tolist(), xz.arc_centre.tolist()) == ([1], [[0, 0, 0]])
    assert xz.arc_angle == pytest.approx([math.pi / 2])
    yz = read("G19 G0 Y10\nG3 Y0 Z10 J-10 F600")
    assert (yz.arc_normal.tolist(), yz.arc_centre.tolist()) == ([0], [[0, 0, 0]])
    assert yz.arc_angle == pytest.approx([math.pi / 2])


def test_centre_words_alone_repeat_a_modal_circle() -> None:
    program = read("G0 X10\nG3 I-10 F600\nI-10\nX0 Y10 I-10")
    assert program.arc_move.tolist() == [1, 2, 3]
    assert program.arc_angle == pytest.approx([2 * math.pi, 2 * math.pi, math.pi / 2])


def test_moves_without_length_are_dropped_and_their_stops_kept() -> None:
    program = read("M3\nG1 X1 F60\nX1 M0\nG4 P1\nG0 X1\nX2")
    assert program.line.tolist() == [3, 7]
    assert program.stop.tolist() == [True, True]
    assert program.dwell.tolist() == [1, 0]


def test_rounding_of_offsets_is_no_motion() -> None:
    program = read("G92 X0.3\nG1 X0.6 F60\nG92.1\nX0.3\nX1")
    np.testing.assert_allclose(program.target[:, 0], [0.3, 1.0], atol=1e-15)


def test_a_pause_before_the_first_move_is_kept() -> None:
    program = read("M3 S1000\nG4 P2\nG4 X0.5\nG0 X1")
    assert program.start_dwell == 2.5
    assert program.dwell.tolist() == [0]


def test_g53_moves_to_machine_coordinates_in_its_block_only() -> None:
    program = read("G92 X10\nG53 G0 X5\nX5")
    assert program.target[:, 0].tolist() == [5, -5]


def test_a_motion_code_without_words_is_kept() -> None:
    program = read("G1\nF60\nX1\nG0\nX2")
    assert program.feed.tolist() == [1, INF]


def test_what_changes_within_a_block_counts_for_its_own_motion() -> None:
    program = read("G0 X1 G91 G20 F60\nG1 X1 G90 G21 M5 F120")
    assert program.target[:, 0].tolist() == [25.4, 1]
    assert program.feed.tolist() == [INF, 2]
    assert program.stop.tolist() == [True, True]

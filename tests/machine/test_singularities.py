"""Joints along whole paths: angles keep counting turns; singular places and ends of travel are named."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from feedplan import Machine
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.kinematics.cylindrical import Cylindrical
from feedplan.machine.kinematics.polar import Polar
from feedplan.machine.numbers import Number, atan2, degrees
from feedplan.machine.rotary import RotaryAxis, RotaryChain, ToolVector
from feedplan.machine.singularities import JointPath, Place, joint_path

CYLINDER = Cylindrical(("C", "X", "Z"))
FIVE = RotaryChain(("X", "Y", "Z", "A", "C"), tables=(RotaryAxis("A"), RotaryAxis("C")))
FREE = [(-np.inf, np.inf)] * 3


def polygon(radius: float, corners: int, laps: float, centre: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Straight pieces around a centre, counter-clockwise, `corners` per lap."""
    angle = np.arange(round(corners * laps) + 1) * (2 * np.pi / corners)
    points = np.stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle), 0 * angle], 1)
    return np.stack([points[:-1], points[1:]], axis=1)


def lengths(pieces: np.ndarray) -> np.ndarray:
    return np.linalg.norm(pieces[:, -1, :3] - pieces[:, 0, :3], axis=1) + 1e-3


def ends(path: JointPath) -> np.ndarray:
    """Joints at the start of every piece, and at the end of the last one."""
    count = len(path.tips.width)
    starts = path.positions(np.arange(count), np.zeros(count))
    return np.concatenate([starts, path.positions(np.array([count - 1]), np.ones(1))])


def test_two_and_a_half_laps_are_nine_hundred_degrees() -> None:
    pieces = polygon(50.0, 8, 2.5)
    path = joint_path(CYLINDER, pieces, lengths(pieces))
    assert ends(path)[:, 0] == pytest.approx(45.0 * np.arange(21))
    assert path.places == ()


def test_one_curve_round_the_axis_turns_a_whole_turn() -> None:
    # A closed quintic loop around the axis: it turns by more than half a turn within one piece.
    angle = np.linspace(0, 2 * np.pi, 6)
    loop = np.stack([100 * np.cos(angle), 100 * np.sin(angle), 0 * angle], axis=1)[None]
    path = joint_path(CYLINDER, loop, np.array([600.0]))
    dense = path.positions(np.zeros(2001, dtype=int), np.linspace(0, 1, 2001))[:, 0]
    assert dense[-1] - dense[0] == pytest.approx(360)
    assert (np.diff(dense) > 0).all()
    assert np.diff(dense).max() < 2


class TwoAxes(Kinematics):
    """An angle that adds the turns about two points, as the elbow and the shoulder of an arm do."""

    tip_names = ("X", "Y", "Z")
    joint_names = ("C", "X", "Z")
    turning = (True, False, False)

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        x, y, z = tip
        return degrees(atan2(y, x - 1.0) + atan2(y, x + 1.0)), x, z


def test_an_angle_that_is_a_sum_of_two_goes_on_turning() -> None:
    angle = np.linspace(0, 2 * np.pi, 6)
    loop = np.stack([3 * np.cos(angle), 3 * np.sin(angle), 0 * angle], axis=1)[None]
    path = joint_path(TwoAxes(), loop, np.array([20.0]))
    dense = path.positions(np.zeros(2001, dtype=int), np.linspace(0, 1, 2001))[:, 0]
    assert dense[-1] - dense[0] == pytest.approx(720)
    assert np.abs(np.diff(dense)).max() < 20
    assert ((path.range.hi - path.range.lo)[:, 0] < 180).all()


def test_a_clockwise_path_across_the_cut_goes_on_below() -> None:
    pieces = polygon(50.0, 8, 1.0)[::-1, ::-1]
    assert ends(joint_path(CYLINDER, pieces, lengths(pieces)))[:, 0] == pytest.approx(
        -45.0 * np.arange(9), abs=1e-9
    )


def test_angles_begin_on_the_turn_where_the_joint_stands() -> None:
    pieces = polygon(50.0, 8, 1.0)
    path = joint_path(CYLINDER, pieces, lengths(pieces), start=np.array([710.0, 50.0, 0.0]))
    assert ends(path)[0, 0] == pytest.approx(720)


def test_angles_begin_on_the_turn_that_fits_the_travel() -> None:
    pieces = polygon(50.0, 8, 1.0)
    for travel, first in (((-370.0, 5.0), -360), ((-1.0, 361.0), 0), ((720.0, 1080.0), 720)):
        path = joint_path(CYLINDER, pieces, lengths(pieces), [travel, *FREE[1:]])
        assert ends(path)[0, 0] == pytest.approx(first)
        assert path.places == ()


def test_a_line_through_the_axis_is_singular_where_it_meets_it() -> None:
    pieces = np.array([[[-60.0, 0.0, 0.0], [-30.0, 0.0, 0.0]], [[-30.0, 0.0, 0.0], [60.0, 0.0, 0.0]]])
    (place,) = joint_path(CYLINDER, pieces, lengths(pieces)).places
    assert (place.piece, place.fraction) == (1, pytest.approx(1 / 3, abs=1e-8))
    assert place.sentence(CYLINDER, 42) == (
        "line 42: the tool is at the axis of the column, where C cannot follow it: "
        "keep the path off it, or program that stretch in joint positions"
    )


@pytest.mark.parametrize("miss", [0.05, 1e-3, 1e-6])
def test_a_line_near_the_axis_is_not_singular(miss: float) -> None:
    pieces = np.array([[[-100.0, miss, 0.0], [130.0, miss, 0.0]]])
    path = joint_path(CYLINDER, pieces, np.array([230.0]))
    assert path.places == ()
    turned = ends(path)[:, 0]
    assert turned[0] - turned[1] == pytest.approx(180, abs=0.1)


def test_standing_on_the_axis_is_one_place_and_ends_soon() -> None:
    pieces = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]], [[0.0, 0.0, 5.0], [50.0, 0.0, 5.0]]])
    places = joint_path(CYLINDER, pieces, np.array([5.0, 50.0])).places
    assert [place.piece for place in places] == [0, 1]
    assert places[1].fraction == pytest.approx(0, abs=1e-8)


def test_the_tool_parallel_to_the_table_s_axis_is_singular() -> None:
    vector = ToolVector(FIVE)
    tilt = np.array([[[10.0, 20, 0, -0.5, 0, 1.0], [20, 20, 0, 0.5, 0, 1.0]]])
    (place,) = joint_path(vector, tilt, np.array([10.0])).places
    assert place.fraction == pytest.approx(0.5, abs=1e-8)
    assert "a tool axis parallel to C, where A and C cannot follow" in place.sentence(vector, 7)


def test_tilting_past_the_pole_turns_the_table_by_half_a_turn() -> None:
    vector = ToolVector(FIVE)
    past = np.array([[[10.0, 20, 0, -0.5, 0.01, 1.0], [20, 20, 0, 0.5, 0.01, 1.0]]])
    path = joint_path(vector, past, np.array([10.0]))
    assert path.places == ()
    turned = path.positions(np.zeros(2, dtype=int), np.array([0.0, 1.0]))[:, 4]
    assert abs(turned[1] - turned[0]) == pytest.approx(180 - 2 * math.degrees(math.atan(0.02)), abs=1e-6)


def test_programmed_angles_pass_the_pole_freely() -> None:
    straight = np.array([[[10.0, 20, 0, -30, 700], [20, 20, 0, 30, 710]]])
    path = joint_path(FIVE, straight, np.array([10.0]))
    assert path.places == ()
    assert ends(path)[:, 4] == pytest.approx([700, 710])


def test_a_travel_end_is_found_where_it_is_passed() -> None:
    pieces = np.array([[[20.0, 0.0, 0.0], [120.0, 0.0, 0.0]], [[120.0, 0.0, 0.0], [60.0, 0.0, 0.0]]])
    places = joint_path(CYLINDER, pieces, lengths(pieces), [FREE[0], (10.0, 100.0), FREE[2]]).places
    assert [(p.piece, p.joint, p.limit) for p in places] == [(0, 1, 100.0), (1, 1, 100.0)]
    assert places[0].fraction == pytest.approx(0.8, abs=1e-6)
    assert places[0].value == pytest.approx(120, abs=0.1)
    assert places[1].fraction == 0
    assert places[0].sentence(CYLINDER, 9).startswith("line 9: X would go to 1")
    assert "its travel ends at 100 mm: place the part elsewhere" in places[0].sentence(CYLINDER, 9)


def test_touching_a_travel_end_is_allowed() -> None:
    pieces = np.array([[[20.0, 0.0, 0.0], [100.0, 0.0, 0.0]], [[100.0, 0.0, 0.0], [20.0, 0.0, 0.0]]])
    assert joint_path(CYLINDER, pieces, lengths(pieces), [FREE[0], (20.0, 100.0), FREE[2]]).places == ()


def test_a_turn_too_many_is_a_travel_end() -> None:
    pieces = polygon(50.0, 8, 2.0)
    machine = Machine.load("cylindrical")
    travel = [axis.travel for axis in machine.axes]
    places = joint_path(machine.inverse, pieces, lengths(pieces), travel).places
    assert places[0].joint == 0
    assert places[0].piece == 6
    assert places[0].sentence(machine.inverse, 3).count("deg") == 2


def test_a_table_that_turns_without_end_needs_no_turn() -> None:
    pieces = polygon(60.0, 12, 30.0)
    polar = Polar(("X", "Z", "C"))
    path = joint_path(polar, pieces, lengths(pieces), [(-20.0, 250.0), *FREE[1:]])
    assert path.places == ()
    assert ends(path)[-1, 2] == pytest.approx(360 * 30)


def test_a_user_s_singular_place_has_a_name_of_its_own() -> None:
    place = Place(0, 0.5, what="a singular position of the machine")
    assert "line 5: the tool is at a singular position" in place.sentence(CYLINDER, 5)


def test_a_rational_arc_round_the_axis_keeps_turning() -> None:
    half = math.sqrt(0.5)
    corners = np.array(
        [[50, 0], [50, 50], [0, 50], [-50, 50], [-50, 0], [-50, -50], [0, -50], [50, -50], [50, 0]]
    )
    flat = np.concatenate([corners, np.zeros((9, 1))], axis=1).astype(float)
    pieces = np.stack([flat[i : i + 3] for i in (0, 2, 4, 6)])
    weights = np.tile([1.0, half, 1.0], (4, 1))
    path = joint_path(CYLINDER, pieces, np.ones(4), weights=weights)
    assert ends(path)[:, 0] == pytest.approx([0, 90, 180, 270, 360])
    assert path.positions(np.array([2]), np.array([0.5]))[0, :2] == pytest.approx([225, 50])

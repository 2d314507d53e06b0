"""Axis words as joint positions, tip or tool direction: their kinematics, column by column."""

import numpy as np
import pytest

from feedplan import Machine, MachineError
from feedplan.machine.axis_words import axis_words
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.path_derivatives import derivatives, positions


def test_words_of_a_five_axis_machine_are_joints_until_said_otherwise() -> None:
    words = axis_words(Machine.load("trunnion-ac"), ("X", "Y", "Z", "A", "C"))
    point = np.array([[1.0, 2.0, 3.0, 40.0, 50.0]])
    assert words.coordinate_mode is CoordinateMode.JOINTS
    assert (positions(words.kinematics, words.tip(point)) == point).all()


def test_words_of_a_cylindrical_machine_are_the_tip() -> None:
    words = axis_words(Machine.load("cylindrical"), ("X", "Y", "Z"))
    assert words.coordinate_mode is CoordinateMode.TIP
    assert positions(words.kinematics, words.tip(np.array([[0.0, 30.0, 4.0]]))) == pytest.approx(
        np.array([[90, 30, 4]])
    )


def test_joint_positions_of_a_cylindrical_machine_can_be_programmed() -> None:
    words = axis_words(Machine.load("cylindrical"), ("X", "Z", "C"), CoordinateMode.JOINTS)
    assert positions(words.kinematics, words.tip(np.array([[30.0, 4.0, 90.0]]))).tolist() == [[90, 30, 4]]


def test_a_run_by_the_tip_has_its_own_tool_and_axes_that_are_not_programmed_stay_at_0() -> None:
    letters = ("X", "Y", "Z", "C")
    words = axis_words(Machine.load("trunnion-ac"), letters, CoordinateMode.TIP, tool_length=77.0)
    # The table turns the part's point (10, 0) to (0, −10).
    joints = positions(words.kinematics, words.tip(np.array([[10.0, 0.0, 0.0, 90.0]])))
    assert joints == pytest.approx(np.array([[0, -10, 77, 0, 90]]))


def test_a_direction_points_the_tool_at_any_piece() -> None:
    words = axis_words(Machine.load("trunnion-ac"), ("X", "Y", "Z", "I", "J", "K"), CoordinateMode.VECTOR)
    curve = np.array([[[0.0, 0, 0, 1, 0, 1], [9, 0, 0, 1, 1, 1]]])
    q = derivatives(words.kinematics, words.tip(curve), np.array([9.0]), np.array([0.0]), 1)
    assert q[0, 0, 3:] == pytest.approx([45, 90])
    # c = atan2(i, −j): dc/dj = 1 rad per 1 at (1, 0), and j grows by 1 in 9 mm.
    assert q[1, 0, 4] == pytest.approx(np.degrees(1 / 9))


def test_a_letter_the_machine_has_not_is_named() -> None:
    with pytest.raises(MachineError, match="the program uses B, but machine trunnion-ac takes X, Y, Z, A, C"):
        axis_words(Machine.load("trunnion-ac"), ("X", "B"), CoordinateMode.TIP)
    with pytest.raises(MachineError, match="machine mill has no two rotary axes"):
        axis_words(Machine.load("mill"), ("X", "I", "J", "K"), CoordinateMode.VECTOR)
    with pytest.raises(MachineError, match="needs all of I, J and K"):
        axis_words(Machine.load("head-head"), ("X", "I", "J"), CoordinateMode.VECTOR)

"""Paths on machines whose axis words are the tool tip, and moves in different coordinate modes."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from feedplan.errors import InputError, MachineError
from feedplan.geometry.build import build_path
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.program.program import PathControl

SQUARE = [[20, 0], [30, 0], [30, 10], [20, 10], [20, 0]]


def test_every_bundled_machine_takes_a_square_and_a_circle(make_program: Any) -> None:
    for name in bundled_machines():
        machine = Machine.load(name)
        if not set("XY") <= set(machine.inverse.tip_names):
            continue
        names = [axis for axis in machine.inverse.tip_names if axis in "XYZ"]
        path = build_path(make_program(SQUARE), machine)
        assert list(path.axes) == names, name
        # Corners use the tolerance, whatever the joints are.
        assert path.fit.deviation == pytest.approx(0.01), name
        arc = build_path(make_program([[20, 0], [20, 0]], arcs={0: ((25, 0, 0), 2, 2 * np.pi)}), machine)
        assert len(arc) == 4


def test_the_travel_of_joints_says_nothing_of_the_tip(make_program: Any) -> None:
    machine = Machine.load("polar")
    axes = tuple(dataclasses.replace(axis, travel=(-5.0, 5.0)) for axis in machine.axes)
    path = build_path(make_program(SQUARE), dataclasses.replace(machine, axes=axes))
    assert path.axes == ("X", "Y", "Z")
    trunnion = Machine.load("trunnion-ac")
    short = tuple(
        dataclasses.replace(axis, travel=(-25.0, 25.0)) if axis.name == "X" else axis
        for axis in trunnion.axes
    )
    machine = dataclasses.replace(trunnion, axes=short)
    coordinate_mode = np.array(
        [CoordinateMode.TIP, CoordinateMode.TIP, CoordinateMode.TIP, CoordinateMode.TIP], dtype=np.uint8
    )
    build_path(make_program(SQUARE, coordinate_mode=coordinate_mode), machine)
    coordinate_mode[1] = CoordinateMode.JOINTS
    with pytest.raises(InputError, match="line 11: X reaches 30 mm"):
        build_path(make_program(SQUARE, coordinate_mode=coordinate_mode), machine)


def test_runs_end_where_the_meaning_or_the_tool_changes(make_program: Any) -> None:
    machine = Machine.load("trunnion-ac")
    points = [[x, 0, 0, 0, 0] for x in range(7)]
    coordinate_mode = np.array([0, 0, 1, 1, 1, 1], dtype=np.uint8)
    tool = np.array([np.nan, np.nan, 50.0, 50.0, 60.0, 60.0])
    program = make_program(points, axes="XYZAC", coordinate_mode=coordinate_mode, tool_length=tool)
    path = build_path(program, machine)
    np.testing.assert_array_equal(path.move[path.runs[:-1], 0], [0, 2, 4])
    np.testing.assert_array_equal(path.coordinate_mode, [0, 1, 1])
    np.testing.assert_array_equal(path.tool_length, [np.nan, 50.0, 60.0])
    even = build_path(make_program(points, axes="XYZAC"), machine)
    np.testing.assert_array_equal(even.runs, [0, len(even)])
    assert even.coordinate_mode is None
    assert even.tool_length is None


def test_feeds_are_numbers_of_the_program_whatever_its_words_mean(make_program: Any) -> None:
    machine = Machine.load("trunnion-ac")
    points = [[0, 0, 0, 0, 0], [3, 0, 0, 4, 0], [6, 0, 0, 8, 0]]
    coordinate_mode = np.array([CoordinateMode.JOINTS, CoordinateMode.TIP], dtype=np.uint8)
    program = make_program(points, axes="XYZAC", feed=6.0, coordinate_mode=coordinate_mode)
    path = build_path(program, machine)
    np.testing.assert_array_equal(path.feed, 6.0)


def test_a_direction_has_columns_of_its_own(make_program: Any) -> None:
    machine = Machine.load("trunnion-ac")
    points = [[0, 0, 0, 0, 0, 1], [10, 0, 0, 0.1, 0, 1], [20, 0, 0, 0.2, 0.1, 1]]
    coordinate_mode = np.full(2, CoordinateMode.VECTOR, dtype=np.uint8)
    program = make_program(
        points, axes="XYZIJK", coordinate_mode=coordinate_mode, control=PathControl.EXACT_PATH, feed=7.0
    )
    path = build_path(program, machine)
    assert path.axes == ("X", "Y", "Z", "I", "J", "K")
    np.testing.assert_array_equal(path.feed, 7.0)
    np.testing.assert_array_equal(path.runs, [0, 1, 2])
    with pytest.raises(MachineError, match="line 10: axis I moves and machine trunnion-ac has none"):
        build_path(make_program(points, axes="XYZIJK"), machine)
    with pytest.raises(MachineError, match="no two rotary axes"):
        build_path(program, Machine.load("mill"))


def test_rotary_words_and_directions_stand_side_by_side(make_program: Any) -> None:
    machine = Machine.load("trunnion-ac")
    points = [[0] * 8, [1, 1, 1, 5, 5, 0, 0, 0], [2, 2, 2, 5, 5, 0.1, 0.1, 1]]
    coordinate_mode = np.array([CoordinateMode.JOINTS, CoordinateMode.VECTOR], dtype=np.uint8)
    path = build_path(make_program(points, axes="XYZACIJK", coordinate_mode=coordinate_mode), machine)
    assert path.axes == tuple("XYZACIJK")
    np.testing.assert_array_equal(path.new_words, [False, True])

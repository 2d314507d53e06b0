"""The problem: feeds, overrides and junction speeds."""

from dataclasses import replace

import numpy as np
import pytest

from feedplan import InputError, Machine, Path
from feedplan.constraints.problem import build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.axis import Axis
from tests.along import path_along


def polyline(points: list[list[float]], feed: float = 10.0, runs: list[int] | None = None) -> Path:
    corners = np.array(points)
    control = np.stack([corners[:-1], (corners[:-1] + corners[1:]) / 2, corners[1:]], axis=1)
    curve = CompositeCurve.from_pieces(control, np.linalg.norm(control[:, 2] - control[:, 0], axis=1))
    return path_along(curve, feed=feed, runs=runs or [0, len(curve)])


def machine(jump: float = 0.0) -> Machine:
    return Machine("test", tuple(Axis(name, 100.0, 1000.0, max_velocity_jump=jump) for name in "XY"))


def test_a_right_angle_is_passed_at_the_allowed_jump_of_either_axis() -> None:
    problem = build_problem(polyline([[0, 0], [5, 0], [5, 5]]), machine(jump=3.0))
    assert problem.junction_speed.tolist() == [0.0, 3.0, 0.0]


def test_a_right_angle_stops_without_an_allowed_jump() -> None:
    problem = build_problem(polyline([[0, 0], [5, 0], [5, 5]]), machine())
    assert problem.junction_speed.tolist() == [0.0, 0.0, 0.0]


def test_a_straight_joint_far_from_the_origin_is_no_corner() -> None:
    step = np.array([1.2345678e-3, 3.3333e-3])
    points = [(np.array([9000.0, -7000.0]) + k * step).tolist() for k in range(40)]
    problem = build_problem(polyline(points), machine())
    assert np.all(problem.junction_speed[1:-1] == np.inf)


def test_run_ends_stop() -> None:
    problem = build_problem(polyline([[0, 0], [5, 0], [9, 0]], runs=[0, 1, 2]), machine(), end_speed=4.0)
    assert problem.junction_speed.tolist() == [0.0, 0.0, 4.0]


def test_feed_is_replaced_and_overridden_but_rapids_are_not() -> None:
    path = replace(polyline([[0, 0], [5, 0], [9, 0]]), feed=[10.0, np.inf])
    assert build_problem(path, machine(), feed_override=0.5).feed[0] == 5.0
    changed = build_problem(path, machine(), feed=20.0, feed_override=0.5).feed
    assert changed[0] == 10.0
    assert 100.0 * np.sqrt(2) < changed[1] < np.inf


def test_a_feed_that_no_plan_can_time_is_refused() -> None:
    path = polyline([[0, 0], [10, 0], [10, 10]], 10.0)
    assert build_problem(path, machine(), feed=1e-6).feed[0] == 1e-6
    said = r"^line 10: the feed is 1e-08 mm/s: give one from 1e-06 mm/s$"
    with pytest.raises(InputError, match=said):
        build_problem(path, machine(), feed_override=1e-9)
    path = replace(path, line=[7, 8], feed=[10.0, 1e-9])
    with pytest.raises(InputError, match=r"^line 8: the feed is 1e-09 mm/s") as caught:
        build_problem(path, machine())
    assert caught.value.line == 8


def test_nobody_writes_into_a_path_or_a_problem() -> None:
    problem = build_problem(polyline([[0, 0], [5, 0], [9, 0]]), machine())
    for column in (problem.path.feed, problem.path.new_words, problem.feed, problem.max_jerk):
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 0


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_feeds_are_refused(bad: float) -> None:
    path = polyline([[0, 0], [5, 0]])
    with pytest.raises(InputError, match="feed"):
        build_problem(path, machine(), feed=bad)
    with pytest.raises(InputError, match="override"):
        build_problem(path, machine(), feed_override=bad)
    if bad != 0.0:
        with pytest.raises(InputError, match="start speed"):
            build_problem(path, machine(), start_speed=bad)

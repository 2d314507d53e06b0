"""A plan as functions of time and of length: closed forms, agreement with setpoints, and refused values."""

from __future__ import annotations

import pickle
from pathlib import Path as FilePath

import numpy as np
import pytest

from feedplan import Axis, InputError, Machine, Path, Plan, plan
from feedplan.curves.composite import CompositeCurve

LINE = Machine("line", (Axis("X", 100.0, 1000.0, max_jerk=20_000.0),))


def _line() -> Plan:
    """100 mm: 0.1 s and 5 mm up to 100 mm/s, 0.9 s at 100 mm/s, 0.1 s down."""
    return plan(Path.from_bezier([[0.0], [100.0]]), LINE)


def test_a_line_is_its_closed_form() -> None:
    made = _line()
    assert made.trajectory.duration == pytest.approx(1.1, abs=1e-12)
    state = made.at(0.05)
    assert state.position == pytest.approx([1.25], abs=1e-12)
    assert state.velocity == pytest.approx([50.0], abs=1e-10)
    assert state.acceleration == pytest.approx([1000.0])
    states = made.at([0.0, 0.1, 0.6, 1.05, 1.1])
    assert states.position[:, 0] == pytest.approx([0.0, 5.0, 55.0, 98.75, 100.0], abs=1e-10)
    assert states.velocity[:, 0] == pytest.approx([0.0, 100.0, 100.0, 50.0, 0.0], abs=1e-6)
    way = made.trajectory
    assert way.length == pytest.approx(100.0)
    assert way.distance([0.05, 0.6]) == pytest.approx([1.25, 55.0])
    assert way.speed([0.0, 1.25, 55.0, 98.75, 100.0]) == pytest.approx(
        [0.0, 50.0, 100.0, 50.0, 0.0], abs=1e-5
    )
    assert way.time([0.0, 1.25, 55.0, 98.75, 100.0]) == pytest.approx([0.0, 0.05, 0.6, 1.05, 1.1], abs=1e-9)


def test_its_clock_has_the_pauses_but_no_waits_for_whole_periods(tmp_path: FilePath) -> None:
    program = tmp_path / "part.ngc"
    program.write_text("G21 G90 G61.1\nG4 P0.5\nG1 X7 F6000\nG4 P0.25\nG1 Y3\nM2\n")
    made = plan(program, "mill")
    first = made.profile.run_times[0]
    rest = made.at(0.5 + first + 0.1)
    assert rest.position.tolist() == [7.0, 0.0, 0.0]
    assert rest.velocity.tolist() == [0.0, 0.0, 0.0]
    assert made.at(0.4).position.tolist() == [0.0, 0.0, 0.0]
    assert made.at(made.time).position.tolist() == [7.0, 3.0, 0.0]
    assert made.trajectory.duration == made.time
    assert (rest.line, made.at(made.time).line) == (3, 5)


@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited"])
def test_it_agrees_with_setpoints_of_a_single_run(method: str) -> None:
    points = [[0.0, 0.0, 0.0], [10.0, 20.0, 5.0], [30.0, -10.0, 0.0], [40.0, 15.0, 3.0], [60.0, 0.0, 0.0]]
    made = plan(Path.from_bezier(points, feed=150.0), "mill", method)
    chunk = made.setpoints().all()
    inner = chunk.t <= made.time
    state = made.at(chunk.t[inner])
    for name in ("position", "velocity", "acceleration", "jerk"):
        same = getattr(chunk, name)[inner]
        assert getattr(state, name) == pytest.approx(same, rel=1e-9, abs=1e-6), name
    s = np.linspace(0.0, made.trajectory.length, 100)
    assert made.trajectory.distance(made.trajectory.time(s)) == pytest.approx(s, abs=1e-8)
    t = made.trajectory.time(s[1:-1])
    speed = np.linalg.norm(made.at(t).velocity, axis=1)
    assert made.trajectory.speed(s[1:-1]) == pytest.approx(speed, rel=1e-6)


def test_a_tool_speed_is_that_of_the_tool_where_joints_move() -> None:
    made = plan(Path.from_bezier([[60.0, 10.0, 0.0], [60.0, 60.0, 0.0]], feed=5.0), "cylindrical")
    assert made.trajectory.speed([20.0, 30.0]) == pytest.approx([5.0, 5.0])


@pytest.mark.parametrize(
    ("t", "sentence"),
    [
        (-0.1, "the time is -0.1 s: give one from 0 to 1.1 s"),
        ([0.0, 2.0], "the time is 2 s: give one"),
        (1.1 + 1e-9, "the time is 1.100000001 s: give one from 0 to 1.1 s"),
        (float("nan"), "the time is nan s: give one"),
        ("soon", "the time is 'soon': give a number"),
        ([[0.0]], "2 dimensions: give a number"),
    ],
)
def test_a_time_that_is_not_within_the_plan_is_refused(t: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        _line().at(t)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the length is 101 mm: give one from 0 to 100 mm"):
        _line().trajectory.speed(101.0)


def test_a_path_is_told_by_its_length() -> None:
    # A quarter circle of radius 20 mm about (0, 0), then a line along −X.
    root = 0.5**0.5
    arc = CompositeCurve.from_bezier([[20, 0], [20, 20], [0, 20]], [1, root, 1])
    line = CompositeCurve.from_bezier([[0, 20], [-7, 20]])
    path = Path.from_curve(CompositeCurve.joined([arc, line]))
    quarter = 10.0 * np.pi
    assert path.length == pytest.approx(quarter + 7.0, rel=1e-13)
    places = path.evaluate([0.0, 0.5 * quarter, quarter + 4.0, path.length])
    assert places == pytest.approx(np.array([[20, 0], [20 * root, 20 * root], [-4, 20], [-7, 20]]), abs=1e-11)
    assert path.evaluate(0.5 * quarter, 1) == pytest.approx([-root, root], abs=1e-12)
    assert path.evaluate(0.5 * quarter, 2) == pytest.approx([-root / 20, -root / 20], abs=1e-12)
    assert path.evaluate(quarter + 1.0, 2) == pytest.approx([0, 0], abs=1e-15)
    again = pickle.loads(pickle.dumps(path))
    assert again.length == path.length
    planned = plan(path, "mill")
    assert planned.path.length == planned.trajectory.length
    with pytest.raises(InputError, match="the length is 40 mm: give one from 0 to 38"):
        path.evaluate(40.0)
    with pytest.raises(InputError, match="of order 3: give 0, 1 or 2"):
        path.evaluate(1.0, 3)

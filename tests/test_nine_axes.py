"""Up to nine axes of any names, in every method and every file; seven joints as toppra plans them."""

from __future__ import annotations

import math
import sys
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.checking import check
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.errors import InputError, MachineError
from feedplan.geometry.path import Path
from feedplan.machine.axis import AXIS_LETTERS, Axis
from feedplan.machine.machine import Machine

METHODS = ("bang-bang", "jerk-limited", "s-curve", "ruckig", "casadi", "clarabel")
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="toppra is for Linux")


def names_of(count: int) -> tuple[str, ...]:
    return tuple(f"joint_{k + 1}" for k in range(count))


def cubic(points: np.ndarray, names: Any) -> Path:
    knots = np.concatenate([np.zeros(3), np.arange(len(points) - 2.0), np.full(3, len(points) - 3.0)])
    return Path.from_bspline(points, knots, 3, axes=names)


def arm(count: int, **changes: Any) -> Machine:
    axes = tuple(
        Axis(name, 2.0 + 0.1 * k, 5.0 + 0.3 * k, 60.0 + k, **changes)
        for k, name in enumerate(names_of(count))
    )
    return Machine("arm", axes, period=0.002)


def spline(count: int, seed: int = 5) -> Path:
    points = np.random.default_rng(seed).standard_normal((7, count))
    return cubic(points, names_of(count))


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9])
def test_axes_of_any_names_go_through_the_exact_planner_and_all_files(count: int, tmp_path: FilePath) -> None:
    plan = feedplan.plan(spline(count), arm(count))
    assert plan.gap < 1e-6
    assert plan.audit().ok
    feedplan.write_plan(plan, tmp_path, ("npz", "csv"))
    for file in (tmp_path, tmp_path / "setpoints.npz", tmp_path / "setpoints.csv"):
        assert check(file).ok
    assert plan.setpoints().axes == names_of(count)
    assert names_of(count)[-1] in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("count", range(1, 10))
def test_each_axis_counts_in_the_length(count: int) -> None:
    line = CompositeCurve.from_bezier(np.outer([0.0, 3.0], np.arange(count) == count - 1))
    assert CurveLength(line).total == 3.0


@pytest.mark.parametrize("method", METHODS)
def test_nine_joints_are_planned_by_every_method(method: Any) -> None:
    best = feedplan.plan(spline(9), arm(9))
    plan = feedplan.plan(spline(9), arm(9), method)
    assert plan.audit().ok
    assert plan.time >= best.lower_bound * (1.0 - 1e-9)


def test_an_axis_more_that_rests_changes_nothing() -> None:
    points = np.random.default_rng(3).standard_normal((7, 3))
    names = names_of(9)
    times = []
    for count in (3, 6, 7, 9):
        wide = np.zeros((7, count))
        wide[:, :3] = points
        times.append(feedplan.plan(cubic(wide, names[:count]), arm(count)).time)
    assert times == pytest.approx([times[0]] * 4, rel=1e-12)


def test_the_order_of_nine_axes_changes_nothing() -> None:
    """The ninth axis is treated like the first: no set of axes ends at eight."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        points = rng.standard_normal((6, 9)) * 10.0 ** rng.uniform(-1, 1, 9)
        order = rng.permutation(9)
        machine = arm(9)
        axes = [machine.axes[k] for k in order]
        path = cubic(points, names_of(9))
        other = cubic(points[:, order], [axis.name for axis in axes])
        plans = [feedplan.plan(path, machine), feedplan.plan(other, Machine("arm", tuple(axes)))]
        assert plans[0].time == pytest.approx(plans[1].time, rel=1e-9)
        assert plans[0].gap < 1e-6


@pytest.mark.parametrize("corners", ["bang-bang", "jerk-limited"])
def test_points_of_seven_joints(corners: Any) -> None:
    t = np.linspace(0.0, 2.0, 60)[:, None]
    points = np.sin(t * np.arange(1, 8)) + t
    path = Path.from_points(points, 1e-3, axes=names_of(7))
    plan = feedplan.plan(path, arm(7), corners)
    assert plan.audit().ok


def test_a_program_that_moves_all_nine_letters(tmp_path: FilePath) -> None:
    axes = tuple(Axis(letter, 200.0, 2000.0, 40_000.0) for letter in AXIS_LETTERS)
    program = tmp_path / "nine.ngc"
    words = [" ".join(f"{letter}{(k + 2) * n}" for k, letter in enumerate(AXIS_LETTERS)) for n in (1, 2, -1)]
    program.write_text("G21 G90 G94 F3000\n" + "".join(f"G1 {row}\n" for row in words))
    for method in ("bang-bang", "jerk-limited", "s-curve", "junction-deviation"):
        plan = feedplan.plan(program, Machine("nine", axes), method)  # type: ignore[arg-type]
        assert plan.path.axes == tuple(AXIS_LETTERS)
        assert plan.audit().ok
    feedplan.write_plan(plan, tmp_path / "out")
    assert check(tmp_path / "out").ok


def cubic_through(points: np.ndarray) -> tuple[Any, CompositeCurve]:
    """toppra's spline through waypoints at even parameters, and its pieces as Bézier curves."""
    import toppra

    given = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(points)), points)
    knots, coefficients = given.cspl.x, given.cspl.c
    pieces = []
    for i, h in enumerate(np.diff(knots)):
        c3, c2, c1, c0 = coefficients[:, i]
        control = [
            c0,
            c0 + c1 * h / 3,
            c0 + 2 * c1 * h / 3 + c2 * h**2 / 3,
            c0 + c1 * h + c2 * h**2 + c3 * h**3,
        ]
        pieces.append(CompositeCurve.from_bezier(np.array(control)).with_width(np.array([h])))
    return given, CompositeCurve.joined(pieces, 1e-9)


@LINUX
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_quick_start_of_toppra(seed: int) -> None:
    """Seven joints through random waypoints: toppra's time falls towards ours as its grid is refined."""
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("CRITICAL")
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((5, 7))
    velocity, acceleration = 10.0 + rng.random(7) * 20.0, 10.0 + rng.random(7) * 2.0
    given, curve = cubic_through(points)
    axes = tuple(Axis(n, v, a) for n, v, a in zip(names_of(7), velocity, acceleration, strict=True))
    plan = feedplan.plan(Path.from_curve(curve, axes=names_of(7)), Machine("arm", axes))
    assert plan.audit().ok
    assert plan.gap < 1e-6
    limits = [
        constraint.JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        constraint.JointAccelerationConstraint(
            np.column_stack([-acceleration, acceleration]),
            discretization_scheme=constraint.DiscretizationType.Interpolation,
        ),
    ]
    times = []
    for cells in (500, 2000):
        solver = algorithm.TOPPRA(
            limits,
            given,
            gridpoints=np.linspace(0.0, 1.0, cells + 1),
            parametrizer="ParametrizeConstAccel",
        )
        times.append(solver.compute_trajectory().duration)
    assert plan.time <= times[1] <= times[0]
    assert times[1] == pytest.approx(plan.time, rel=2e-3)


@pytest.mark.parametrize("name", ["", "1x", "a b", "j-1", "é", "j" * 33, "I", "K", 3, None])
def test_a_name_that_is_none_is_refused(name: Any) -> None:
    with pytest.raises(MachineError, match=r"axis name is .*: give 1 to 32 letters, digits and underscores"):
        Axis(name, 1.0, 1.0)


@pytest.mark.parametrize("name", ["X", "x", "j1", "_", "elbow_joint", "j" * 32, "XY", "AB"])
def test_a_name_that_is_one_is_taken(name: str) -> None:
    """Names that are part of a row of letters, such as XY and AB, do not mean these letters."""
    axis = Axis(name, 1.0, 1.0)
    assert axis.kind == "linear"
    path = Path.from_bezier([[0.0], [2.0]], axes=[name])
    plan = feedplan.plan(path, Machine("own", (axis,)))
    assert plan.time == pytest.approx(3.0)
    assert plan.audit().ok


@pytest.mark.parametrize(
    ("axes", "word"),
    [
        ((*arm(9).axes, Axis("X", 1, 1)), "the machine has 10 axes: give a list of 1 to 9 axes"),
        ((*arm(9).axes[:8], "X"), "axis 9 is 'X': give an Axis"),
        (arm(9).axes[:8] + arm(1).axes, "axis joint_1 comes twice"),
        (Axis("X", 1, 1), "axes is the axis X alone"),
    ],
)
def test_an_error_names_the_axis_and_prints_no_other(axes: Any, word: str) -> None:
    with pytest.raises(MachineError, match=word) as caught:
        Machine("own", axes)
    assert "Axis(name" not in str(caught.value)


def test_names_and_columns_fit() -> None:
    points = np.zeros((3, 7))
    with pytest.raises(InputError, match="7 coordinates and no names"):
        Path.from_points(points, 0.1)
    with pytest.raises(InputError, match="points of 7 coordinates: name each once"):
        Path.from_points(points, 0.1, axes=names_of(6))
    with pytest.raises(InputError, match="an axis name is 'a b'"):
        Path.from_points(points, 0.1, axes=[*names_of(6), "a b"])
    with pytest.raises(InputError, match=r"10\): give .* 1 to 9 axes"):
        Path.from_points(np.zeros((3, 10)), 0.1)


def test_a_program_on_a_machine_with_other_axes_beside(tmp_path: FilePath) -> None:
    """Axes without a letter rest, and home has a number for each of them too."""
    machine = Machine(
        "cell",
        (Axis("X", 100, 1000), Axis("gripper", 10, 100), Axis("Y", 100, 1000)),
        home=(1.0, 5.0, 2.0),
    )
    plan = feedplan.plan("G21 G90 F600\nG1 X10 Y5\nG28\n", machine)
    assert plan.path.axes == ("X", "Y")
    np.testing.assert_allclose(plan.at(plan.time).position, [1.0, 2.0], atol=1e-9)
    assert math.isfinite(plan.time)
    assert plan.audit().ok

"""Limits that differ by direction: by hand, exact in the optimal planners, kept by every method."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.checking import check
from feedplan.errors import MachineError
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from tests.campaign import seeds
from tests.planners.differences import exceeded
from tests.planners.sided import KNOTS, Pair, arm, even, names_of, pairs, random_path, swapped

ONE = Machine("one", (Axis("X", (-1.0, 2.0), (-4.0, 1.0)),))
BY_HAND = [
    # Forward: 2 s and 2 mm up to 2 mm/s, 0.5 s and 0.5 mm down from it, 7.5 mm at 2 mm/s.
    (0.0, 10.0, 2.0 + 0.5 + 3.75),
    # Backward: 0.25 s and 0.125 mm up to 1 mm/s, 1 s and 0.5 mm down from it, 9.375 mm at 1 mm/s.
    (10.0, 0.0, 0.25 + 1.0 + 9.375),
    # A triangle: 0.8 mm up at 1 mm/s² to √1.6 mm/s, 0.2 mm down at 4 mm/s².
    (0.0, 1.0, 1.25 * math.sqrt(1.6)),
]


@pytest.mark.parametrize(("start", "end", "time"), BY_HAND)
def test_one_axis_by_hand(start: float, end: float, time: float) -> None:
    plan = feedplan.plan(Path.from_bezier([[start], [end]]), ONE)
    assert plan.time == pytest.approx(time, rel=1e-12)
    assert plan.lower_bound == pytest.approx(time, rel=1e-9)
    assert plan.audit().ok
    assert plan.audit().check("velocity", "X").ratio <= 1.0 + 1e-9


def test_there_and_back_by_hand() -> None:
    """A line there and back, at rest where it turns: each direction has its own limits."""
    path = Path.from_points([[0.0], [10.0], [0.0]], 0.0)
    plan = feedplan.plan(path, ONE)
    assert plan.time == pytest.approx(6.25 + 10.625, rel=1e-12)
    audit = plan.audit()
    assert audit.ok
    assert audit.check("velocity", "X").ratio == pytest.approx(1.0)
    assert audit.check("acceleration", "X").ratio == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["curves", "lines", "rounded", "rational"])
@pytest.mark.parametrize("seed", range(seeds(6)))
def test_the_exact_plan_meets_its_bound_and_the_audit(seed: int, kind: str) -> None:
    rng = np.random.default_rng([seed, len(kind)])
    count = int(rng.integers(1, 10))
    plan = feedplan.plan(random_path(rng, count, kind), arm(pairs(rng, count, 2.0), pairs(rng, count, 9.0)))
    assert plan.audit().ok, plan.audit().failures
    assert plan.gap < 1e-9


@pytest.mark.parametrize("seed", range(seeds(4)))
def test_mirrored_and_run_backward_it_takes_the_same_time(seed: int) -> None:
    """Mirroring q → −q exchanges all limits; reversing time q(t) → q(T − t) exchanges those of velocity."""
    rng = np.random.default_rng(seed)
    velocity, acceleration = pairs(rng, 3, 2.0), pairs(rng, 3, 9.0)
    points = rng.standard_normal((7, 3))

    def negated(limits: list[Pair]) -> list[Pair]:
        return [(-high, -low) for low, high in limits]

    plans = [
        feedplan.plan(Path.from_bspline(own, KNOTS, 3, axes=names_of(3)), arm(v, a))
        for own, v, a in (
            (points, velocity, acceleration),
            (-points, negated(velocity), negated(acceleration)),
            (points[::-1], negated(velocity), acceleration),
        )
    ]
    for other in plans[1:]:
        assert other.time == pytest.approx(plans[0].time, rel=1e-9)
    assert plans[0].gap < 1e-6


@pytest.mark.parametrize("method", ["clarabel", "casadi", "toppra"])
@pytest.mark.parametrize("seed", [1, 2])
def test_other_solvers_agree(method: Any, seed: int) -> None:
    if method == "toppra" and not sys.platform.startswith("linux"):
        pytest.skip("toppra is for Linux")
    rng = np.random.default_rng(seed)
    path = random_path(rng, 3, "curves")
    machine = arm(pairs(rng, 3, 2.0), pairs(rng, 3, 9.0))
    best, plan = feedplan.plan(path, machine), feedplan.plan(path, machine, method)
    assert plan.audit().ok, plan.audit().failures
    assert best.time <= plan.time * (1.0 + 1e-9)
    assert plan.time == pytest.approx(best.time, rel=1e-3)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="toppra is for Linux")
def test_toppra_itself_comes_to_the_same_time() -> None:
    """toppra's own constraints by direction, on a fine grid."""
    import toppra
    from toppra import algorithm, constraint

    from feedplan.curves.composite import CompositeCurve

    toppra.setup_logging("CRITICAL")
    rng = np.random.default_rng(3)
    velocity, acceleration = pairs(rng, 4, 2.0), pairs(rng, 4, 9.0)
    points = rng.standard_normal((5, 4))
    given = toppra.SplineInterpolator(np.linspace(0.0, 1.0, 5), points)
    pieces = []
    for i in range(4):
        h = 0.25
        _, c2, c1, c0 = given.cspl.c[:, i]
        control = [c0, c0 + c1 * h / 3, c0 + 2 * c1 * h / 3 + c2 * h**2 / 3, given.cspl(h * (i + 1))]
        pieces.append(CompositeCurve.from_bezier(np.array(control)).with_width(np.array([h])))
    path = Path.from_curve(CompositeCurve.joined(pieces, 1e-9), axes=names_of(4))
    plan = feedplan.plan(path, arm(velocity, acceleration))
    limits = [
        constraint.JointVelocityConstraint(np.array(velocity)),
        constraint.JointAccelerationConstraint(
            np.array(acceleration), discretization_scheme=constraint.DiscretizationType.Interpolation
        ),
    ]
    solver = algorithm.TOPPRA(
        limits, given, gridpoints=np.linspace(0.0, 1.0, 3001), parametrizer="ParametrizeConstAccel"
    )
    time = solver.compute_trajectory().duration
    assert plan.time <= time
    assert time == pytest.approx(plan.time, rel=3e-3)


def test_a_program_with_arcs_on_an_axis_that_lifts_slower_than_it_falls(tmp_path: FilePath) -> None:
    axes = (
        Axis("X", 200.0, 2000.0),
        Axis("Y", (-150.0, 200.0), 2000.0),
        Axis("Z", (-80.0, 40.0), (-900.0, 400.0)),
    )
    program = (
        "G21 G90 G64 P0.01 F9000\nG1 X30 Z10\nG2 X50 Y20 I0 J20\nG1 Z0\nG3 X30 Y40 Z5 I-20 J0\nG0 X0 Y0 Z0\n"
    )
    plan = feedplan.plan(program, Machine("router", axes))
    audit = plan.audit()
    assert audit.ok
    assert plan.gap < 1e-4
    assert audit.check("velocity", "Z").ratio == pytest.approx(1.0, abs=1e-6)
    feedplan.write_plan(plan, tmp_path)
    assert check(tmp_path).ok


def test_the_audit_judges_each_direction(tmp_path: FilePath) -> None:
    """A plan that keeps the limits of one direction breaks those of the other."""
    even = Machine("one", (Axis("X", 2.0, 4.0),))
    feedplan.write_plan(feedplan.plan(Path.from_bezier([[0.0], [10.0]]), even), tmp_path)
    setpoints = tmp_path / "setpoints.npz"
    assert check(setpoints, Machine("own", (Axis("X", (-1.0, 2.0), 4.0),))).ok
    slow = check(setpoints, Machine("own", (Axis("X", (-2.0, 1.0), 4.0),)))
    assert slow.check("velocity", "X").limit == 1.0
    assert slow.check("velocity", "X").ratio == pytest.approx(2.0)
    for limits in ((-3.0, 4.0), (-4.0, 3.0)):
        weak = check(setpoints, Machine("own", (Axis("X", 2.0, limits),)))
        assert weak.check("acceleration", "X").ratio == pytest.approx(4.0 / 3.0, rel=1e-6)


# Methods with a limit of jerk keep all limits on every path, those of controllers keep them on lines.
SMOOTH = ("jerk-limited", "s-curve", "ruckig")
CONTROLLERS = ("tangential", "junction-deviation", "arc-transition", "constant-velocity-transition")
KINDS = ("curves", "lines", "rounded", "rational")
CASES = [(method, kind) for method in SMOOTH for kind in KINDS] + [
    (method, "lines") for method in CONTROLLERS
]
# Allowed relative difference of two times: jerk-limited is accurate to 1e-4 only.
CLOSE = {"jerk-limited": 3e-4}


def random_case(seed: int, kind: str) -> tuple[Path, Machine]:
    rng = np.random.default_rng([seed, len(kind)])
    count = int(rng.integers(1, 6))
    return random_path(rng, count, kind), arm(pairs(rng, count, 2.0), pairs(rng, count, 9.0))


@pytest.mark.parametrize(("method", "kind"), CASES)
@pytest.mark.parametrize("seed", range(seeds(1)))
def test_every_method_keeps_each_side_and_gains_by_the_wider_ones(method: Any, kind: str, seed: int) -> None:
    path, machine = random_case(seed, kind)
    plan = feedplan.plan(path, machine, method)
    assert plan.audit().ok, plan.audit().failures
    assert exceeded(plan.setpoints().all(), machine, machine.period, method in SMOOTH) == []
    assert plan.lower_bound <= plan.time * (1.0 + 1e-9)
    if method == "jerk-limited":
        assert plan.gap < 1e-3
    assert plan.time <= feedplan.plan(path, even(machine), method).time * (1.0 + CLOSE.get(method, 1e-9))


@pytest.mark.parametrize(("method", "kind"), CASES)
def test_mirrored_with_its_sides_swapped_a_path_takes_the_same_time(method: Any, kind: str) -> None:
    path, machine = random_case(3, kind)
    curve = path.curve
    mirrored = replace(path, curve=replace(curve, control_points=-curve.control_points))
    time, other = (
        feedplan.plan(*case, method).time for case in ((path, machine), (mirrored, swapped(machine)))
    )
    assert other == pytest.approx(time, rel=CLOSE.get(method, 1e-9))


@pytest.mark.parametrize(("method", "kind"), CASES)
def test_sides_that_differ_by_nearly_nothing_give_the_same_plan(method: Any, kind: str) -> None:
    """Equal up to rounding; lines of jerk-limited have a closed form only if both sides are equal."""
    path, machine = random_case(1, kind)
    one = even(machine)
    axes = (
        replace(
            axis,
            max_velocity=(-float(axis.max_velocity), float(axis.max_velocity) * (1.0 + 1e-14)),
            max_acceleration=(-float(axis.max_acceleration) * (1.0 + 1e-14), float(axis.max_acceleration)),
        )
        for axis in one.axes
    )
    nearly = feedplan.plan(path, replace(one, axes=tuple(axes)), method)
    rounding = 2e-5 if method == "jerk-limited" else 1e-9
    assert nearly.time == pytest.approx(feedplan.plan(path, one, method).time, rel=rounding)


@pytest.mark.parametrize("method", CONTROLLERS)
@pytest.mark.parametrize(("start", "end", "time"), BY_HAND)
def test_controllers_run_one_axis_by_hand(method: Any, start: float, end: float, time: float) -> None:
    assert feedplan.plan(Path.from_bezier([[start], [end]]), ONE, method).time == pytest.approx(
        time, rel=1e-12
    )


@pytest.mark.parametrize(("up", "down", "end"), [(1.0, 4.0, 10.0), (4.0, 1.0, -10.0)])
def test_jerk_limited_runs_one_axis_by_hand(up: float, down: float, end: float) -> None:
    """From 0 to V and back to 0 takes V/A + A/J at each end, at half of V on average; the rest is at V."""
    speed, jerk = (2.0 if end > 0.0 else 1.0), 20.0
    machine = Machine("one", (Axis("X", (-1.0, 2.0), (-4.0, 1.0), jerk),))
    ramps = sum(
        speed / a + a / jerk if speed * jerk >= a * a else 2.0 * math.sqrt(speed / jerk) for a in (up, down)
    )
    plan = feedplan.plan(Path.from_bezier([[0.0], [end]]), machine, "jerk-limited")
    assert plan.time == pytest.approx(ramps + (abs(end) - 0.5 * speed * ramps) / speed, rel=1e-4)
    assert plan.gap < 1e-3
    assert plan.audit().ok


@pytest.mark.parametrize(
    "method", ["jerk-limited", "s-curve", "arc-transition", "constant-velocity-transition"]
)
def test_programs_of_an_axis_that_lifts_slower_than_it_falls(method: Any) -> None:
    axes = (
        Axis("X", (-150.0, 200.0), 2000.0, 40000.0),
        Axis("Y", 200.0, (-700.0, 2000.0), 40000.0),
        Axis("Z", (-80.0, 40.0), (-900.0, 400.0), 9000.0),
    )
    corners = [(30, 0, 10), (50, 20, 10), (50, 20, 0), (30, 45, 5), (-10, 40, 8), (0, 0, 0)]
    lines = "\n".join("G1 X{} Y{} Z{}".format(*place) for place in corners)
    machine = Machine("router", axes)
    plan = feedplan.plan(f"G21 G90 G64 P0.01 F9000\n{lines}\n", machine, method)
    assert plan.audit().ok, plan.audit().failures
    assert exceeded(plan.setpoints().all(), machine, machine.period, method in SMOOTH) == []
    assert plan.time <= feedplan.plan(plan.path, even(machine), method).time * (1.0 + CLOSE.get(method, 1e-9))


@pytest.mark.parametrize(
    "limit",
    [(1.0, 2.0), (-1.0, 0.0), (-1.0,), (-1.0, math.inf), (-1.0, 1.0, 2.0), ("a", 1.0), [], (math.nan, 1.0)],
)
def test_limits_that_are_none_are_refused(limit: Any) -> None:
    for key in ("max_velocity", "max_acceleration"):
        given = {"max_velocity": 1.0, "max_acceleration": 1.0, key: limit}
        remedy = r"give a number from \S+ to \S+ \[mm/s²?\], or a negative and a positive one"
        with pytest.raises(MachineError, match=rf"axis X: {key} is .*: {remedy}"):
            Axis("X", **given)


def test_a_machine_file_has_both_directions() -> None:
    text = ONE.to_toml()
    assert "max_velocity = [-1.0, 2.0]" in text
    assert Machine.from_toml(text, "one.toml") == ONE
    assert Axis("X", [-2, 2], 1.0) == Axis("X", 2.0, 1.0)  # type: ignore[arg-type]

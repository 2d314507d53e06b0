"""Limits that differ by direction: exact in the planners that take them, refused by name in the others."""

from __future__ import annotations

import math
import sys
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.checking import check
from feedplan.errors import MachineError, SolverError
from feedplan.geometry.path import Path
from feedplan.machine.file import parse
from feedplan.machine.machine import Axis, Machine
from tests.campaign import seeds

Pair = tuple[float, float]
KNOTS = [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4]
ONE = Machine("one", (Axis("X", (-1.0, 2.0), (-4.0, 1.0)),))


def names_of(count: int) -> tuple[str, ...]:
    return tuple(f"j{k + 1}" for k in range(count))


def arm(velocity: list[Pair], acceleration: list[Pair]) -> Machine:
    rows = zip(names_of(len(velocity)), velocity, acceleration, strict=True)
    return Machine("arm", tuple(Axis(*row) for row in rows), period=0.002)


def pairs(rng: np.random.Generator, count: int, most: float) -> list[Pair]:
    """Limits of which some differ by direction, by up to ten times."""
    sides = most * 10.0 ** rng.uniform(-1.0, 0.0, (count, 2))
    even = rng.random(count) < 0.2
    return [(-float(a), float(a if same else b)) for (a, b), same in zip(sides, even, strict=True)]


def random_path(rng: np.random.Generator, count: int, kind: str) -> Path:
    points = rng.standard_normal((7, count))
    if kind == "lines":
        return Path.from_points(points, 0.0, axes=names_of(count))
    if kind == "rounded":
        return Path.from_points(points, 0.05, axes=names_of(count))
    if kind == "rational":
        weights = rng.uniform(0.4, 2.0, 7)
        return Path.from_nurbs(points, KNOTS, 3, weights, axes=names_of(count))
    return Path.from_bspline(points, KNOTS, 3, axes=names_of(count))


@pytest.mark.parametrize(
    ("start", "end", "time"),
    [
        # Forward 2 s to 2 mm/s over 2 mm, 0.5 s from it over 0.5 mm, 7.5 mm at 2 mm/s.
        (0.0, 10.0, 2.0 + 0.5 + 3.75),
        # Backward 0.25 s to 1 mm/s over 0.125 mm, 1 s from it over 0.5 mm, 9.375 mm at 1 mm/s.
        (10.0, 0.0, 0.25 + 1.0 + 9.375),
        # A triangle: 0.8 mm up at 1 mm/s² to √1.6 mm/s, 0.2 mm down at 4 mm/s².
        (0.0, 1.0, 1.25 * math.sqrt(1.6)),
    ],
)
def test_one_axis_by_hand(start: float, end: float, time: float) -> None:
    plan = feedplan.plan(Path.from_bezier([[start], [end]]), ONE)
    assert plan.time == pytest.approx(time, rel=1e-12)
    assert plan.lower_bound == pytest.approx(time, rel=1e-9)
    assert plan.audit().ok
    assert plan.audit().check("velocity", "X").ratio <= 1.0 + 1e-9


def test_there_and_back_by_hand() -> None:
    """Straight, turning back at rest: both ways with their own limits."""
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
    """q → −q negates all limits; q(t) → q(T − t) those of the velocity alone."""
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
    """Its constraints by direction, on a fine grid of its own."""
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
    """What keeps the limits of one direction breaks those of the other."""
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


@pytest.mark.parametrize("method", ["jerk-limited", "s-curve", "ruckig", "tangential", "junction-deviation"])
def test_other_methods_refuse_by_name(method: Any) -> None:
    machine = Machine("one", (Axis("X", (-1.0, 2.0), 4.0, 50.0), Axis("Y", 1.0, 4.0, 50.0)))
    sentence = f"the limits of axis X differ by direction, which {method} knows nothing of: .* bang-bang"
    with pytest.raises(SolverError, match=sentence):
        feedplan.plan(Path.from_bezier([[0.0, 0.0], [10.0, 1.0]]), machine, method)


def test_joints_of_a_kinematics_are_refused() -> None:
    axes = (Axis("U", (-1.0, 2.0), 9.0), Axis("V", 1.0, 9.0))
    with pytest.raises(MachineError, match="the limits of axis U of machine own differ by direction"):
        feedplan.plan("G21 F60\nG1 X5\n", Machine("own", axes, kinematics="corexy"))


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
    assert parse(text, "one.toml") == ONE
    assert Axis("X", [-2, 2], 1.0) == Axis("X", 2.0, 1.0)  # type: ignore[arg-type]

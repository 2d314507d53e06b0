"""Joint motion: known times, limits of the exact joints, and messages where joints cannot follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.machine.axis import Axis
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.planners import planner
from tests.along import path_along
from tests.campaign import seeds
from tests.planners.excess import worst_excess
from tests.turns import circle

plan = planner("bang-bang")
NOT_PLAIN = [name for name in bundled_machines() if not Machine.load(name).is_plain]
DEGREE = float(np.degrees(1.0))
CYLINDER = Machine(
    "cylinder",
    (Axis("C", 3 * DEGREE, 20 * DEGREE, kind="rotary"), Axis("X", 250.0, 2000.0), Axis("Z", 200.0, 1000.0)),
    kinematics="cylindrical",
)


def without_travel(machine: Machine) -> Machine:
    axes = tuple(replace(axis, travel=(-np.inf, np.inf)) for axis in machine.axes)
    return replace(machine, axes=axes, chord_tolerance=np.inf)


@pytest.mark.parametrize(
    ("distance", "time"), [(10.0, 1.835307436752), (1.0, 2.221472585005), (0.05, 2.436528749075)]
)
def test_the_cylindrical_machine_passes_its_axis_in_the_known_time(distance: float, time: float) -> None:
    # Times of an independent implementation with closed forms of the kinematics, to 1e-12 s.
    line = CompositeCurve.from_bezier([[-100.0, distance, -30.0], [130.0, distance, 39.0]], width=230.0)
    problem = build_problem(path_along(line.elevated(2), feed=200.0), CYLINDER)
    profile = plan(problem)
    assert profile.time == pytest.approx(time, rel=1e-11)
    excess, use = worst_excess(problem, profile)
    assert excess <= 1e-9
    assert use >= 1 - 1e-6
    # The same line with another parameter speed, cut unevenly.
    uneven = line.elevated(3).split([0, 0], [1.0, 97.0]).with_width([0.3, 20.0, 1.0])
    assert plan(build_problem(path_along(uneven, feed=200.0), CYLINDER)).time == pytest.approx(time, rel=1e-9)


def test_a_circle_about_the_column_is_one_joint_alone() -> None:
    # r = 50 mm: the column turns 360° with A = 20 rad/s²; at V = 3 rad/s the tool moves at 150 mm/s.
    problem = build_problem(path_along(circle([0.0, 0.0, 5.0], 50.0), feed=1e6), CYLINDER)
    v, a, way = 3.0, 20.0, 2 * np.pi
    assert plan(problem).time == pytest.approx(way / v + v / a, rel=1e-8)
    assert plan(build_problem(path_along(circle([0.0, 0.0, 5.0], 50.0), feed=100.0), CYLINDER)).time == (
        pytest.approx(way / 2.0 + 2.0 / a, rel=1e-8)
    )


def random_problem(name: str, seed: int) -> Problem:
    """A random NURBS curve of the tool; about half are rational, and some have tool directions."""
    rng = np.random.default_rng(seed)
    machine = without_travel(Machine.load(name))
    axes, coordinate_mode = machine.inverse.tip_names, None
    if not machine.inverse.always:
        coordinate_mode = CoordinateMode.TIP
        if len(machine.axes) == 5 and rng.random() < 0.4:
            axes, coordinate_mode = ("X", "Y", "Z", "I", "J", "K"), CoordinateMode.VECTOR
    degree = int(rng.integers(2, 6))
    count = degree + 1 + int(rng.integers(0, 6))
    size = 10 ** rng.uniform(-0.5, 1)
    ranges = {"X": (30, 120), "A": (-60, 60), "I": (0.3, 1)}
    group = {**dict.fromkeys("XYZUVW", "X"), **dict.fromkeys("ABC", "A"), **dict.fromkeys("IJK", "I")}
    start = np.array([rng.uniform(*ranges[group[letter]]) for letter in axes])
    scale = np.array([0.02 * size if letter in "IJK" else size for letter in axes])
    points = start + np.cumsum(rng.normal(size=(count, len(axes))) * scale * 0.7, axis=0)
    if rng.random() < 0.15:
        # Nearly a cusp: two neighbouring control points nearly coincide.
        first = int(rng.integers(0, count - 1))
        points[first + 1] = points[first] + 10 ** rng.uniform(-9, -3) * scale * rng.normal(size=len(axes))
    inner = np.sort(rng.uniform(0, 1, count - degree - 1))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    weights = None if rng.random() < 0.5 else 10 ** rng.uniform(-1, 1, count)
    curve = CompositeCurve.from_nurbs(points, knots, degree, weights)
    path = path_along(
        curve.with_width(curve.width * size * count),
        axes,
        feed=10 ** rng.uniform(0.5, 3),
        coordinate_mode=None if coordinate_mode is None else np.array([coordinate_mode]),
    )
    return build_problem(path, machine)


@pytest.mark.parametrize("name", NOT_PLAIN)
def test_random_curves_keep_every_limit_of_the_true_joints(name: str) -> None:
    faults = []
    for seed in range(seeds(4)):
        problem = random_problem(name, seed)
        excess, use = worst_excess(problem, plan(problem))
        if not (excess <= 1e-8 and use >= 1 - 1e-6):
            faults.append((seed, excess, use))
    assert faults == []


@pytest.mark.parametrize(("name", "seed"), [("corexy", 1200), ("cylindrical", 1195)])
def test_pieces_some_micrometres_long_keep_the_digits_of_their_derivatives(name: str, seed: int) -> None:
    # Computed from control points 100 mm away from the origin, these accelerations would be uncertain by 1e-7
    # of their limits.
    problem = random_problem(name, seed)
    excess, use = worst_excess(problem, plan(problem))
    assert excess <= 1e-9
    assert use >= 1 - 1e-6


def test_a_singular_place_and_a_travel_end_are_told_with_their_lines() -> None:
    through = CompositeCurve.joined(
        [
            CompositeCurve.from_bezier([[-100.0, 0.0, 0.0], [-50.0, 0.0, 0.0]]),
            CompositeCurve.from_bezier([[-50.0, 0.0, 0.0], [50.0, 0.0, 0.0]]),
        ]
    ).elevated(2)
    with pytest.raises(InputError, match="line 20: the tool is at the axis of the column, where C cannot"):
        build_problem(path_along(through, feed=200.0), CYLINDER)
    far = CompositeCurve.from_bezier([[100.0, 0.0, 0.0], [2000.0, 0.0, 0.0]]).elevated(2)
    with pytest.raises(InputError, match="line 10: X would go to 2000 mm, its travel ends at 900 mm"):
        build_problem(path_along(far, feed=200.0), Machine.load("cylindrical"))
    near = CompositeCurve.from_bezier([[100.0, 0.0, 0.0], [10.0, 0.0, 0.0]]).elevated(2)
    with pytest.raises(InputError, match="X would go to 10 mm, its travel begins at 20 mm: place"):
        build_problem(path_along(near, feed=200.0), Machine.load("cylindrical"))
    belts = Machine.load("corexy")
    short = replace(belts, axes=(replace(belts.axes[0], travel=(-10.0, 300.0)), *belts.axes[1:]))
    with pytest.raises(InputError, match=r"line 10: \w would go to 2000 mm, its travel ends at 300 mm"):
        build_problem(path_along(far, feed=200.0), short)


def test_crossed_belts_plan_as_the_same_limits_in_their_own_directions() -> None:
    # Along x = y one motor stands still and the other moves twice as far.
    belts = without_travel(Machine.load("corexy"))
    line = CompositeCurve.from_bezier([[0.0, 0.0, 0.0], [100.0, 100.0, 0.0]], width=100.0).elevated(2)
    motor = belts.axes[0]
    v, a, way = motor.max_velocity, motor.max_acceleration, 200.0
    time = plan(build_problem(path_along(line, feed=np.inf), belts)).time
    assert time == pytest.approx(way / v + v / a if way > v * v / a else 2 * np.sqrt(way / a), rel=1e-9)


def test_turning_on_the_spot_counts_in_degrees() -> None:
    machine = without_travel(Machine.load("trunnion-ac"))
    points = [[10.0, 0.0, 0.0, 0.0, 0.0], [10.0, 0.0, 0.0, 0.0, 90.0]]
    turn = CompositeCurve.from_bezier(points, width=90.0).elevated(2)
    path = path_along(turn, "XYZAC", feed=30.0, coordinate_mode=np.array([CoordinateMode.TIP]))
    problem = build_problem(path, machine)
    profile = plan(problem)
    assert profile.time == pytest.approx(90 / 30 + 30 / machine.axis("C").max_acceleration, rel=1e-6)

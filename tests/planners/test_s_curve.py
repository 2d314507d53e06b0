"""The profiles of s-curve (two passes) and ruckig (state to state): limits, and which one is faster."""

from __future__ import annotations

from pathlib import Path as FilePath

import numpy as np
import pytest
from ruckig import InputParameter, Result, Ruckig, Trajectory

from benchmarks.jerk_excess import jerk_excess
from benchmarks.named import FREE, lemniscate
from feedplan import plan
from feedplan.constraints.problem import build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import planner
from tests.campaign import seeds
from tests.planners.random_paths import random_problem
from tests.planners.test_jerk_limited import CURVES

SEEDS = seeds(12)
HELD = 1e-9


def test_the_two_pass_profile_keeps_every_limit_on_random_curves() -> None:
    faults = []
    for seed in range(SEEDS):
        problem = random_problem(seed)
        excess = jerk_excess(problem, planner("s-curve")(problem))
        if not (excess.worst <= 1e-6 and excess.gaps <= 1e-9):
            faults.append((seed, excess))
    assert faults == []


def test_states_between_segments_make_profiles_faster_and_keep_every_limit() -> None:
    faults = []
    for seed in range(max(SEEDS // 4, 1)):
        problem = random_problem(seed)
        slow, fast = planner("s-curve")(problem), planner("ruckig")(problem)
        excess = jerk_excess(problem, fast)
        if not (fast.time <= slow.time and excess.worst <= 1e-6 and excess.gaps <= 1e-9):
            faults.append((seed, slow.time, fast.time, excess))
    assert faults == []


# Its spline ends in a piece of 3e-5 mm, on which sections at constant speed are as short as rounding.
SLIVER = """
G21 G90 G64
G0 X28.24815 Y6.04278 Z5.80670
G1 F293.1
G1 X20.65007 Y6.80437 Z3.82098
G1 X18.69306 Y4.65491 Z3.58741
G1 X14.39114 Y1.96914 Z3.70870
G5 I2.81426 J-4.67883 P5.75366 Q-8.37044 X-30.98675 Y-20.16791
G1 F518 X-36.71051 Y-23.22159 Z4.16506
G1 X-36.98411 Y-28.96802 Z4.49596
G1 X-45.44216 Y-24.77432 Z5.43666
G1 X-47.61769 Y-22.48774 Z5.18249
G1 X-51.63884 Y-8.95594 Z6.71489
M2
"""


def test_a_section_as_short_as_rounding_keeps_its_time(tmp_path: FilePath) -> None:
    program = tmp_path / "sliver.ngc"
    program.write_text(SLIVER)
    limits = [("X", 86, 3744, 29755), ("Y", 152, 1738, 112819), ("Z", 94, 2569, 48154)]
    machine = Machine("sliver", tuple(Axis(*row) for row in limits), period=0.002)
    assert plan(program, machine, method="s-curve").audit().failures == ()


def own_time(limits: list[float], length: float, speeds: tuple[float, float]) -> float:
    """The time of the package ruckig for a line with these limits of velocity, acceleration and jerk [s]."""
    given, trajectory = InputParameter(1), Trajectory(1)
    given.current_position, given.target_position = [0.0], [length]
    given.current_velocity, given.target_velocity = [speeds[0]], [speeds[1]]
    given.max_velocity, given.max_acceleration, given.max_jerk = ([limit] for limit in limits)
    assert Ruckig(1).calculate(given, trajectory) == Result.Working
    return float(trajectory.duration)


@pytest.mark.parametrize("method", ["s-curve", "ruckig"])
def test_lines_take_ruckigs_own_time(method: str) -> None:
    random = np.random.default_rng(1)
    for case in range(60):
        rows = 10.0 ** random.uniform([1, 2, 3.5], [3, 4, 6], (3, 3))
        machine = Machine("line", tuple(Axis("XYZ"[k], *rows[k, :2], max_jerk=rows[k, 2]) for k in range(3)))
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        length, feed = 10.0 ** random.uniform([-3, 0.5], [3.5, 3])
        # One line, or several lines in the same direction.
        cuts = np.sort(random.uniform(0.0, length, case % 4))
        ends = direction * np.concatenate([[0.0], cuts, [length]])[:, None]
        lines = [CompositeCurve.from_bezier(ends[i : i + 2]) for i in range(len(ends) - 1)]
        path = Path.from_curve(CompositeCurve.joined(lines), feed=feed)
        limits = (rows / np.abs(direction)[:, None]).min(axis=0).tolist()
        limits[0] = min(limits[0], feed)
        # Reachable speeds: shares of the speed that is reached from rest on a part of the line.
        most = min(limits[0], (length / 8 * limits[1]) ** (1 / 2), (length**2 / 64 * limits[2]) ** (1 / 3))
        for start, end in ((0.0, 0.0), (0.5, 0.0), (0.3, 0.9)):
            problem = build_problem(path, machine, start_speed=start * most, end_speed=end * most)
            expected = own_time(limits, length, (start * most, end * most))
            assert planner(method)(problem).time == pytest.approx(expected, rel=HELD), (case, start, end)


def test_the_lemniscate_orders_the_methods() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    best, states, passes = (planner(name)(problem).time for name in ("jerk-limited", "ruckig", "s-curve"))
    assert best < states < 0.99 * passes < 1.5 * best


def test_a_time_limit_gives_the_first_states() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    at_once = planner("ruckig", time_limit=0.0)(problem)
    assert at_once.time == pytest.approx(planner("s-curve")(problem).time, rel=1e-6)

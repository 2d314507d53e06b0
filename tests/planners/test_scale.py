"""No planner contains a length or a time: a path that is scaled with its machine takes the same time."""

from __future__ import annotations

import numpy as np
import pytest

from feedplan import plan
from feedplan.constraints.problem import Problem, build_problem
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import methods, planner
from feedplan.planners.junction_deviation import GRBL_DEVIATION
from tests.campaign import seeds
from tests.planners.random_paths import random_case

CLOSE = 1e-6
# Velocity, acceleration and jerk of the axes X, Y, Z [mm/s, mm/s², mm/s³].
LIMITS = [(200.0, 2500.0, 60_000.0), (250.0, 3000.0, 50_000.0), (180.0, 3500.0, 70_000.0)]
FEED, CHORD = 150.0, 0.002
SPLINE = np.random.default_rng(7).uniform(-20.0, 20.0, (6, 3))
KNOTS = np.concatenate([np.zeros(4), [0.3, 0.45], np.ones(4)])
LINES = {"long": [1000.0, 0.0, 0.0], "oblique": [30.0, -10.0, 5.0], "short": [0.02, 0.01, 0.0]}
PATHS = ("spline", *LINES)


def problem_of(name: str, scale: float) -> Problem:
    """A path and its machine, with all lengths times `scale`."""
    if name == "spline":
        path = Path.from_nurbs(scale * SPLINE, KNOTS, 3, feed=scale * FEED)
    else:
        path = Path.from_bezier(scale * np.array([[0.0] * 3, LINES[name]]), feed=scale * FEED)
    rows = zip("XYZ", scale * np.array(LIMITS), strict=True)
    axes = tuple(Axis(axis, *row[:2], max_jerk=row[2]) for axis, row in rows)
    return build_problem(path, Machine("scaled", axes, chord_tolerance=scale * CHORD))


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("method", methods())
def test_scaling_all_lengths_changes_no_time(method: str, name: str) -> None:
    def time(scale: float) -> float:
        lengths = {"deviation": scale * GRBL_DEVIATION} if method == "junction-deviation" else {}
        return planner(method, **lengths)(problem_of(name, scale)).time

    assert [time(1e-3), time(1e3)] == pytest.approx([time(1.0)] * 2, rel=CLOSE)


@pytest.mark.parametrize("method", ["bang-bang", "s-curve", "ruckig"])
def test_scaling_all_lengths_changes_no_time_of_random_curves(method: str) -> None:
    found = {}
    for seed in range(seeds(8)):
        times = [planner(method)(random_case(seed, scale)[0]).time for scale in (1.0, 1e-3, 1e3)]
        if max(times) > (1 + CLOSE) * min(times):
            found[seed] = times
    assert found == {}


@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited", "ruckig", "s-curve"])
def test_the_servo_period_shapes_no_profile_of_a_smooth_path(method: str) -> None:
    if method == "ruckig":
        pytest.importorskip("ruckig")
    path = Path.from_nurbs(SPLINE, KNOTS, 3, feed=FEED)
    axes = tuple(Axis(axis, *row[:2], max_jerk=row[2]) for axis, row in zip("XYZ", LIMITS, strict=True))
    machine = Machine("of any period", axes)
    times = [plan(path, machine.with_period(period), method).time for period in (1e-3, 1e-5, 0.024, 10.0)]
    assert times == pytest.approx(times[:1] * 4, rel=CLOSE)

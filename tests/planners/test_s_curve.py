"""The profiles of segments, two-pass and state to state: limits kept, and which is the faster."""

from __future__ import annotations

import os

import numpy as np
import pytest

from benchmarks.jerk_excess import jerk_excess
from benchmarks.named import FREE, lemniscate
from feedplan.constraints.problem import build_problem
from feedplan.geometry.path import Path
from feedplan.planners import planner
from feedplan.planners.ruckig import repaired
from tests.planners.random_paths import random_problem
from tests.planners.test_jerk_limited import CURVES

SEEDS = int(os.environ.get("FEEDPLAN_SEEDS", "12"))
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
        slow, fast = planner("s-curve")(problem), planner("ruckig", time_limit=1.0)(problem)
        excess = jerk_excess(problem, fast)
        if not (fast.time <= slow.time * (1 + HELD) and excess.worst <= 1e-6 and excess.gaps <= 1e-9):
            faults.append((seed, slow.time, fast.time, excess))
    assert faults == []


def test_the_lemniscate_orders_the_methods() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    best, states, passes = (planner(name)(problem).time for name in ("jerk-limited", "ruckig", "s-curve"))
    assert best < states < 0.95 * passes


def test_a_bang_bang_profile_is_repaired() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    guide = planner("bang-bang")(problem)
    profile = repaired(problem, guide)
    assert jerk_excess(problem, profile).worst <= HELD
    assert guide.time < profile.time < planner("s-curve")(problem).time
    # No faster than the guide where segments meet: nowhere much.
    assert np.isfinite(profile.duration).all()


def test_a_time_limit_gives_the_first_states() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    at_once = planner("ruckig", time_limit=0.0)(problem)
    assert at_once.time == pytest.approx(planner("s-curve")(problem).time, rel=1e-6)

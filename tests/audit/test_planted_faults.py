"""Faults of a thousandth at random places of plans that keep all limits: the audit finds each of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import feedplan
from feedplan.audit import Audit, audit
from feedplan.constraints.problem import Problem
from feedplan.machine.machine import Machine
from feedplan.planning import Plan
from feedplan.profile import SpeedProfile
from feedplan.setpoints import SetpointChunk
from tests.campaign import seeds

FAULT = 1e-3

# Long lines and wide bends, where the tool runs at the feed, and short lines, where it does not.
POINTS = "60,0 61,0.4 62,1.2 100,40 100,41 99,42 70,60 55,62 40,60 39,60 38.5,59 37,57 0,20 0,0"
LINES = "".join("G1 X{} Y{}\n".format(*point.split(",")) for point in POINTS.split())
MILL = f"G21 G90 G94 G64 P0.02\nG0 X0 Y0 Z0\nF2400\n{LINES}M2\n"
TIPS = (
    "G21 G90 G94 G64 P0.02\nG43.4\nG0 X10 Y0 Z20 A0 C0\nF1500\nG1 X40 A10 C20\nX60 Y10 A15 C25\n"
    "Y40 A-5\nX20 Y50 A-10 C0\nG49\nM2\n"
)


@pytest.fixture(
    scope="module",
    params=[
        ("mill", "bang-bang"),
        ("mill", "jerk-limited"),
        ("trunnion-ac", "bang-bang"),
        ("trunnion-ac", "jerk-limited"),
    ],
    ids=lambda param: "-".join(param),
)
def plan(request: pytest.FixtureRequest) -> Plan:
    machine, method = request.param
    made = feedplan.plan(MILL if machine == "mill" else TIPS, machine, method=method)
    assert made.audit().ok
    return made


def verdict(
    plan: Plan, profile: SpeedProfile | None = None, problem: Problem | None = None, setpoints: Any = None
) -> Audit:
    jerk = plan.method == "jerk-limited"
    machine: Machine = plan.machine
    return audit(
        problem or plan.problem, profile or plan.profile, machine, plan.program, setpoints, jerk=jerk
    )


def names(result: Audit) -> set[str]:
    return {check.name for check in result.broken}


def some_phases(plan: Plan, seed: int, count: int = 6) -> NDArray[np.intp]:
    """Phases long enough for a fault of a thousandth to matter; half of them, if possible, at constant p."""
    rng = np.random.default_rng(seed)
    profile = plan.profile
    long = profile.duration > 1e-3
    flat = np.flatnonzero(long & (np.abs(profile.p1 - profile.p0) <= 1e-6 * profile.p0))
    own = rng.choice(flat, min(count // 2, len(flat)), replace=False)
    others = np.setdiff1d(np.flatnonzero(long), own)
    return np.concatenate([own, rng.choice(others, min(count - len(own), len(others)), replace=False)])


@pytest.mark.parametrize("seed", range(seeds(2)))
@pytest.mark.parametrize("column", ["p0", "p1", "duration", "value", "u0", "u1"])
def test_a_number_of_one_phase_that_is_off(plan: Plan, column: str, seed: int) -> None:
    """a0 and a1 are left out: accelerations may jump by the limit of jerk times a period."""
    for i in some_phases(plan, seed):
        values = getattr(plan.profile, column).copy()
        values[i] *= 1.0 + FAULT
        if values[i] != getattr(plan.profile, column)[i]:
            assert not verdict(plan, replace(plan.profile, **{column: values})).ok, (column, i)


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_a_limit_of_an_axis_below_its_greatest_use(plan: Plan, quantity: str) -> None:
    """The greatest use is taken from states inside all phases, evaluated by the plan's own sampler."""
    if quantity == "jerk" and plan.method != "jerk-limited":
        return
    profile, problem = plan.profile, plan.problem
    moving = np.flatnonzero(profile.duration > 1e-9)
    share = (np.arange(12) + 0.5) / 12
    u = profile.u0[moving, None] + (profile.u1 - profile.u0)[moving, None] * share
    states = profile.sampler(problem).along(np.repeat(profile.piece[moving], 12), u.ravel())
    most = np.abs(states[{"velocity": 2, "acceleration": 3, "jerk": 4}[quantity]]).max(axis=0)
    for k, axis in enumerate(problem.axes):
        if most[k] == 0.0:
            continue
        limit = getattr(problem, f"max_{quantity}").copy()
        limit[k] = most[k] / (1.0 + FAULT)
        lower = {f"max_{quantity}": limit}
        if quantity != "jerk":
            least = getattr(problem, f"min_{quantity}").copy()
            least[k] = -limit[k]
            lower[f"least_{quantity}"] = least
        broken = verdict(plan, problem=replace(problem, **lower)).broken
        assert (quantity, axis) in {(check.name, check.axis) for check in broken}


@pytest.mark.parametrize("seed", range(seeds(3)))
def test_a_feed_below_the_speed_of_one_phase(plan: Plan, seed: int) -> None:
    problem, profile = plan.problem, plan.profile
    for i in some_phases(plan, seed):
        piece = int(profile.piece[i])
        least = np.inf
        feed = problem.feed.copy()
        own = problem.path.curve if problem.joints is not None else problem.curve
        u = np.linspace(profile.u0[i], profile.u1[i], 40)
        rows = np.full(40, piece, np.uint32)
        slope = np.linalg.norm(own.evaluate(rows, u, 1)[1], axis=1)
        p = profile.sampler(problem).along(rows, u)
        speed = np.linalg.norm(p[2], axis=1)
        if problem.joints is None:
            least = float(speed.max()) / (1.0 + FAULT)
        else:
            # p belongs to the joints: the tip's speed follows only if the tip moves in X, Y and Z alone.
            rate = np.linalg.norm(problem.curve.evaluate(rows, u, 1)[1], axis=1)
            least = float((speed / rate * slope).max()) / (1.0 + FAULT)
            if (problem.path.curve.evaluate(rows, u, 1)[1][:, 3:] != 0.0).any():
                continue
        feed[piece] = least
        assert "feed" in names(verdict(plan, problem=replace(problem, feed=feed))), i


@pytest.mark.parametrize("seed", range(seeds(3)))
def test_one_setpoint_beside_its_place(plan: Plan, seed: int) -> None:
    """The step is a thousandth of the acceleration limit times period², but at least 2 nm."""
    rng = np.random.default_rng(seed)
    whole = plan.setpoints().all()
    for _ in range(4):
        n, k = int(rng.integers(2, len(whole) - 2)), int(rng.integers(len(whole.axes)))
        position = whole.position.copy()
        step = FAULT * float(plan.problem.max_acceleration[k]) * plan.problem.period**2
        position[n, k] += max(step, 2e-6) * rng.choice([-1.0, 1.0])
        if (whole.position[n - 1 : n + 2] == whole.position[n]).all():
            continue
        chunk: SetpointChunk = replace(whole, position=position)
        found = names(verdict(plan, setpoints=[chunk]))
        assert found & {"place", "acceleration", "jerk", "recorded_velocity"}, (n, k)


@pytest.mark.parametrize("seed", range(seeds(3)))
def test_setpoints_that_run_late_by_a_thousandth_of_a_period(plan: Plan, seed: int) -> None:
    rng = np.random.default_rng(seed)
    whole = plan.setpoints().all()
    speed = np.linalg.norm(whole.velocity, axis=1)
    fast = np.flatnonzero(speed > 0.5 * speed.max())
    for n in rng.choice(fast, 4, replace=False):
        late = FAULT * plan.problem.period
        position = whole.position.copy()
        position[n] += whole.velocity[n] * late
        found = names(verdict(plan, setpoints=[replace(whole, position=position)]))
        assert "place" in found or {"acceleration", "jerk"} & found, n

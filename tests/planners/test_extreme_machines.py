"""Every accepted machine gives a plan that the audit accepts, or a refusal in one sentence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from feedplan import Axis, Machine, plan
from feedplan.audit import audit
from feedplan.errors import FeedplanError, InputError
from feedplan.planners import limits_jerk
from tests.campaign import seeds
from tests.planners.extreme_machines import PROGRAMS, extreme_machine

SEEDS = seeds(1)
MOST = 20_000
# Time for which ruckig may improve the states between its segments [s]; its first states are a plan already.
TIME_LIMITS = {"ruckig": 0.2}


def faults(machine: Machine, text: str, method: str) -> tuple[str, ...]:
    """A sentence for everything that is wrong with a plan; empty if it is refused."""
    try:
        planned = plan(text, machine, method, max_setpoints=MOST, time_limit=TIME_LIMITS.get(method))
    except FeedplanError:
        return ()
    if not math.isfinite(planned.lower_bound) or planned.time < planned.lower_bound * (1.0 - 1e-9):
        return (f"the time is {planned.time} s, its bound {planned.lower_bound} s",)
    try:
        points = planned.setpoints()
    except InputError:
        points = None
    jerk = limits_jerk(method)
    with np.errstate(all="raise"):
        return audit(planned.problem, planned.profile, machine, planned.program, points, jerk=jerk).failures


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited", "ruckig", "s-curve"])
def test_machines_at_the_ends_of_their_ranges(method: str, name: str) -> None:
    found = []
    for seed in range(SEEDS):
        broken = faults(extreme_machine(seed), PROGRAMS[name], method)
        found += [f"{seed}: {sentence}" for sentence in broken]
    assert found == []


@pytest.mark.parametrize(("seed", "name"), [(13, "arcs"), (25, "short")])
def test_accelerations_recorded_along_arcs_of_many_periods_have_the_digits_of_their_time(
    seed: int, name: str
) -> None:
    assert faults(extreme_machine(seed), PROGRAMS[name], "s-curve") == ()


# The last setpoint before a stop is some nanometres short of it; the next run begins a period later.
@pytest.mark.parametrize(
    ("velocity", "acceleration", "period"), [(1e7, 1e10, 0.05), (250.0, 2.5e6, 0.01), (0.01, 1e3, 10.0)]
)
def test_setpoints_wait_for_their_next_period_at_a_stop(
    velocity: float, acceleration: float, period: float
) -> None:
    machine = Machine("abrupt", tuple(Axis(name, velocity, acceleration) for name in "XYZ"), period=period)
    assert faults(machine, PROGRAMS["arcs"], "bang-bang") == ()


def test_sections_of_less_than_a_period_keep_their_time() -> None:
    mill = Machine.load("mill").with_period(10.0)
    for method in ("s-curve", "ruckig"):
        assert faults(mill, PROGRAMS["short"], method) == ()


def test_a_jump_of_velocity_keeps_the_chord_tolerance() -> None:
    axes = tuple(Axis(name, 250.0, 2500.0, max_velocity_jump=50.0) for name in "XYZ")
    machine = Machine("jerky", axes, period=0.024, chord_tolerance=0.01)
    for text in PROGRAMS.values():
        assert faults(machine, text, "bang-bang") == ()

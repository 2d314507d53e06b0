"""Limits of joints that differ by direction, where the joints are not the axes of the program."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from feedplan import Axis, InputError, Machine, ProgramError, plan
from feedplan.audit import audit
from feedplan.machine.machine import bundled_machines
from feedplan.planners import limits_jerk
from tests.campaign import seeds
from tests.planners.differences import exceeded
from tests.planners.sided import even, with_sides
from tests.planners.test_tip_programs import REASONS
from tests.planners.tip_programs import random_tip_program

V, A, J = (-1.0, 2.0), (-4.0, 1.0), 20.0
BELT = Machine("belt", (Axis("U", V, A, J), Axis("V", V, A, J)), kinematics="corexy")
# The first seeds of random tip programs that each machine can follow.
FIRST = {"head-head": 5, "head-table": 1, "rotary-table": 1, "trunnion-ac": 3, "trunnion-bc": 2}
PLANE = "G21 G90 G64 P0.01 F6000\nG1 X40 Y5 Z3\nG1 X60 Y40\nG3 X20 Y60 I-30 J-10\nG1 X10 Y30 Z0\nG0 X40 Y5\n"
NOT_PLAIN = [name for name in bundled_machines() if not Machine.load(name).is_plain]
CASES = [("bang-bang", name) for name in NOT_PLAIN] + [
    ("jerk-limited", "corexy"),
    ("jerk-limited", "polar"),
    ("s-curve", "cylindrical"),
    ("s-curve", "rotary-table"),
    ("ruckig", "trunnion-ac"),
]


@pytest.mark.parametrize(
    ("program", "time"),
    [
        # Both joints forward: 2 s and 2 mm up to 2 mm/s, 0.5 s and 0.5 mm down from it, 7.5 mm at 2 mm/s.
        ("G1 X10", 2.0 + 0.5 + 3.75),
        # Both back: 0.25 s and 0.125 mm up to 1 mm/s, 1 s and 0.5 mm down from it, 9.375 mm at 1 mm/s.
        ("G1 X-10", 0.25 + 1.0 + 9.375),
        # One forward and one back, at the lower speed; for each change of speed one of them has 1 mm/s².
        ("G1 Y10", 1.0 + 1.0 + 9.0),
        ("G1 Y-10", 1.0 + 1.0 + 9.0),
    ],
)
def test_two_belts_by_hand(program: str, time: float) -> None:
    made = plan(f"G21 G90 F60000\n{program}\n", BELT)
    assert made.time == pytest.approx(time, rel=1e-9)
    assert made.lower_bound == pytest.approx(time, rel=1e-6)
    assert made.audit().ok
    # Jerk adds A/(2 J) to each change of speed.
    smooth = plan(f"G21 G90 F60000\n{program}\n", BELT, "jerk-limited")
    changes = {"G1 X10": (1.0, 4.0), "G1 X-10": (4.0, 1.0)}.get(program, (1.0, 1.0))
    assert smooth.time == pytest.approx(time + sum(0.5 * a / J for a in changes), rel=1e-4)
    assert smooth.audit().ok


@pytest.mark.parametrize(("method", "name"), CASES)
@pytest.mark.parametrize("seed", range(seeds(1)))
def test_every_joint_keeps_each_side_and_gains_by_the_wider_ones(method: Any, name: str, seed: int) -> None:
    whole = Machine.load(name)
    machine = with_sides(whole, np.random.default_rng([seed, *name.encode()]))
    text = random_tip_program(seed + FIRST[name], whole) if name in FIRST else PLANE
    try:
        made = plan(text, machine, method)
    except (InputError, ProgramError) as refused:
        sentence = str(refused)
    else:
        sentence = None
    if sentence is not None:
        assert any(re.search(reason, sentence) for reason in REASONS)
        return
    assert seed > 0 or made.problem.joints is not None
    assert made.audit().ok, made.audit().failures
    assert exceeded(made.setpoints().all(), machine, machine.period, limits_jerk(method)) == []
    assert made.lower_bound <= made.time * (1.0 + 1e-9)
    rounding = 3e-4 if method == "jerk-limited" else 1e-8
    assert made.time <= plan(text, even(machine), method).time * (1.0 + rounding)


@pytest.mark.parametrize("name", ["polar", "trunnion-ac"])
def test_sides_that_differ_by_nearly_nothing_give_the_same_plan(name: str) -> None:
    machine = even(with_sides(Machine.load(name), np.random.default_rng(5)))
    text = random_tip_program(FIRST[name], machine) if name in FIRST else PLANE
    apart = [replace(axis, max_velocity=_apart(axis.max_velocity)) for axis in machine.axes]
    for method in ("bang-bang", "jerk-limited"):
        one, nearly = (plan(text, own, method) for own in (machine, replace(machine, axes=tuple(apart))))
        assert nearly.time == pytest.approx(one.time, rel=2e-5 if method == "jerk-limited" else 1e-9)


def _apart(limit: Any) -> tuple[float, float]:
    return -limit, limit * (1.0 + 1e-14)


@pytest.mark.parametrize("jerk", [False, True])
def test_the_audit_judges_each_direction_of_a_joint(jerk: bool) -> None:
    """X moves both joints forward and back: a plan for limits of one direction breaks those of the other."""
    both = Machine("even", (Axis("U", 2.0, 4.0, J), Axis("V", 2.0, 4.0, J)), kinematics="corexy")
    made = plan("G21 G90 F60000\nG1 X10\nG1 X0\n", both, "jerk-limited" if jerk else "bang-bang")
    limits = made.problem.max_velocity, made.problem.max_acceleration
    for least, ratios in (
        ({"least_velocity": np.array([-1.0, -2.0])}, {("velocity", "U"): 2.0}),
        ({"max_velocity": np.array([2.0, 1.6]), "least_velocity": -limits[0]}, {("velocity", "V"): 1.25}),
        ({"least_acceleration": np.array([-2.5, -4.0])}, {("acceleration", "U"): 1.6}),
        (
            {"max_acceleration": np.array([4.0, 3.2]), "least_acceleration": -limits[1]},
            {("acceleration", "V"): 1.25},
        ),
    ):
        verdict = audit(replace(made.problem, **least), made.profile, both, jerk=jerk)
        broken = {(check.name, check.axis): check.ratio for check in verdict.broken}
        assert broken == pytest.approx(ratios, rel=1e-4)

"""Five-axis programs: G43.4, G43.5 and G49 in any order are planned within the limits, or refused."""

from __future__ import annotations

import re

import numpy as np
import pytest

from feedplan import InputError, Machine, Plan, ProgramError, SolverError, plan
from feedplan.planners import limits_jerk
from feedplan.program.gcode import read_gcode
from tests.campaign import seeds
from tests.planners.audited import audited
from tests.planners.tip_programs import random_tip_program

SEEDS = seeds(1)
MACHINES = ["trunnion-ac", "trunnion-bc", "head-table", "head-head", "rotary-table"]
METHODS = ["bang-bang", "jerk-limited", "s-curve", "ruckig"]
# Time for which ruckig may improve the states between its segments [s]; its first states are a plan already.
TIME_LIMITS = {"ruckig": 0.2}
# Allowed reasons to refuse a program that a machinist would accept.
REASONS = (
    r"its travel (begins|ends) at",
    r"the tool is at a tool axis parallel to",
    r"the tool passes so near a singular position",
    r"the tool turns over by 180 degrees",
    r"rounded corners pass a singular position on another side than the blocks do",
    r"goes to machine positions and G43\.[45] is in force: cancel it by G49 before",
)

# Common sequences, most of them with a tool of 120 mm on a BC trunnion after a retract; each has its
# difficulty as its name.
UP = "G21 G90 G94\nG0 Z400\n"
PROGRAMS = {
    "the first block changes the meaning": (
        "trunnion-ac",
        "G21 G90\nG43.4 H1\nG0 X10 Y0 Z50 A0 C0\nG1 X20 A-10 C10 F600",
    ),
    "a rapid that only turns": ("trunnion-bc", UP + "G0 B0 C0\nG43.4 H1\nG0 X40 Y2 Z5\nG0 C64"),
    "turns there and back": (
        "trunnion-bc",
        UP + "G0 B0 C0\nG43.4 H1\nG0 X40 Y2 Z5\nG0 B-5 C64\nG0 B0\nG0 Z10",
    ),
    "joints after the tip": (
        "trunnion-bc",
        UP + "G0 B-5 C64\nG43.4 H1\nG0 X40 Y2 Z5\nG49\nG0 Z400\nG0 Y0 B0 C0",
    ),
    "a direction that only turns": (
        "trunnion-bc",
        UP + "G0 B9 C5\nG43.5 H1\nG1 I0.3 J0.1 K0.9 F500\nG49\nG0 Z450\nG28",
    ),
    "a stop between runs that rounding moves": (
        "trunnion-ac",
        "G21 G90\nG53 G0 Z421.682\nG1 A-47.850 F517\nG43.4 H1\nG0 Y48.269 Z68 A9\nG0 A-28\n"
        "G91 G0 Z12.970\nG90",
    ),
    "words that change there and back": (
        "trunnion-ac",
        "G21 G90\nG0 X14 Y-31 Z384 A-50\nG43.5 H1\nG1 I-0.68 J0.004 K0.73 F520\nG43.4\nG43.5 H1\n"
        "G91 G0 Z45\nG90",
    ),
    "a turn within some nanometres of a metre": (
        "head-head",
        "G21 G90 G94  F517\nG53 G0 Z1147.561\nG0 X-44 Y-58.136 Z868 A-58.872 C15\nG91 G30 Z0 C0\nG90\n"
        "G0 X-59.790 Z1296 A-39\nG1 X11.704 Z1077.342\nG0 C124.033\nG91 G1 Z0.0070\nG90\nG0 X-12.069 Z880\n"
        "G43.4 H1\nG0 Y-2.836",
    ),
    "a feed before a turn": (
        "head-head",
        "G21 G90 G64 P0.5\nG0 Z900\nG1 C40 F800\nG43.4 H1\nG1 A-20\nG1 X9 A-22\nG49\nG0 Z1000",
    ),
}


def excess(planned: Plan, jerk: bool) -> list[str]:
    """Joint limits that plain differences of the setpoints exceed."""
    machine = planned.machine
    chunk = planned.setpoints().all()
    axes = [machine.axis(name) for name in chunk.axes]
    period = machine.period
    found = []
    for order, limit, share in (
        (1, "max_velocity", 1e-6),
        (2, "max_acceleration", 1e-5),
        (3, "max_jerk", 1e-4),
    ):
        if len(chunk) <= order or (order == 3 and not jerk):
            continue
        most = np.abs(np.diff(chunk.position, order, axis=0)).max(axis=0) / period**order
        for axis, value in zip(axes, most.tolist(), strict=True):
            if value > getattr(axis, limit) * (1 + share):
                found.append(f"{axis.name} {limit} {value / getattr(axis, limit):.6g} times")
    low, high = np.array([axis.travel for axis in axes]).T
    if ((chunk.position < low - 1e-6) | (chunk.position > high + 1e-6)).any():
        found.append("travel")
    return found


def broken(text: str, machine: Machine, method: str, refuses: bool = True) -> list[str]:
    """Failures by audit and differences; none if `refuses` and the reason of the refusal is allowed."""
    try:
        program = read_gcode(text, machine, name="part.ngc")
        if len(program) == 0:
            return []
        planned = plan(program, machine, method=method, time_limit=TIME_LIMITS.get(method))
    except (InputError, ProgramError) as refused:
        sentence = str(refused)
        return [] if refuses and any(re.search(reason, sentence) for reason in REASONS) else [sentence]
    jerk = limits_jerk(method)
    found = [*audited(planned.problem, planned.profile, machine, program, jerk), *excess(planned, jerk)]
    if not planned.lower_bound <= planned.time * (1 + 1e-9):
        found.append(f"the time {planned.time} s is below its bound {planned.lower_bound} s")
    return found


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", list(PROGRAMS))
def test_everyday_sequences_keep_every_limit(name: str, method: str) -> None:
    machine, text = PROGRAMS[name]
    assert broken(f"{text}\nM30\n", Machine.load(machine), method, refuses=False) == []


@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited"])
@pytest.mark.parametrize("name", MACHINES)
def test_random_sequences_keep_every_limit(name: str, method: str) -> None:
    machine = Machine.load(name)
    found = {seed: broken(random_tip_program(seed, machine), machine, method) for seed in range(SEEDS)}
    assert {seed: sentences for seed, sentences in found.items() if sentences} == {}


# The path turns most at the end of a piece; a piece cut 1e-5 mm beside it has too few digits of length.
@pytest.mark.parametrize(("name", "seed"), [("head-head", 38), ("head-head", 637), ("rotary-table", 45)])
def test_programs_that_broke_a_limit_of_jerk(name: str, seed: int) -> None:
    machine = Machine.load(name)
    assert broken(random_tip_program(seed, machine), machine, "jerk-limited") == []


def test_a_corner_rounded_past_the_pole_on_the_other_side_is_refused() -> None:
    program = (
        "G21 G90 G64 P0.05 F15384\nG0 A-39.889 C179\nG0 C-149\nG43.5 H1\nG0 I-0.076517 J0.171635 K0.982185\n"
        "G0 I0.306540 J0.409663 K0.859191\nG49\nG53 G0 Z495.564\nM30\n"
    )
    machine = Machine.load("trunnion-ac")
    moves = read_gcode(program, machine, name="part.ngc")
    with pytest.raises(InputError, match="line 8: C is to begin at -36"):
        plan(moves, machine, method="jerk-limited")
    assert plan(moves, machine, tolerance=0.001).audit().ok


@pytest.mark.parametrize("method", ["junction-deviation", "tangential", "arc-transition"])
def test_methods_of_the_programs_axes_say_so(method: str) -> None:
    machine, text = PROGRAMS["a rapid that only turns"]
    with pytest.raises(
        SolverError, match=r"takes the program's axes as the machine's: .* plan with bang-bang"
    ):
        plan(read_gcode(f"{text}\nM30\n", Machine.load(machine)), machine, method=method)

"""Programs with planned feeds, planned again: exact methods need the plan's time, others keep their plan."""

from __future__ import annotations

import math

import pytest

import feedplan
from tests.planned_feeds.programs import again, planned
from tests.planners import controller_programs

# Allowed relative differences of the time. Feeds are rounded down by less than 1e-4, and plans with limits of
# jerk are exact to 1e-4. The path of bang-bang is fitted again, with the new feeds.
SAME = {"bang-bang": 0.01, "jerk-limited": 3e-4}


def fast(text: str) -> str:
    """The program with feeds that are never reached, so that nearly every block has another planned feed."""
    return text.replace("F3600", "F60000").replace("F4800", "F60000").replace("F3000", "F60000")


@pytest.mark.parametrize("name", ["trochoid", "zigzag", "slots"])
@pytest.mark.parametrize("method", SAME)
def test_exact_methods_take_the_plans_time_again(name: str, method: str) -> None:
    plan = planned(fast(getattr(controller_programs, name)()), method=method)
    result = feedplan.planned_program(plan)
    assert result.changed > 20
    time = feedplan.plan(again(result), "mill", method).time
    assert time == pytest.approx(plan.time, rel=SAME[method])


@pytest.mark.parametrize("method", ["s-curve", "ruckig"])
def test_a_program_of_another_method_holds_its_plan(method: str) -> None:
    # These methods lose time where the greatest speed changes between blocks; the best plan loses none.
    if method == "ruckig":
        pytest.importorskip("ruckig")
    plan = planned(fast(controller_programs.trochoid()), method=method)
    program = again(feedplan.planned_program(plan))
    assert feedplan.plan(program, "mill", "jerk-limited").time < plan.time
    assert feedplan.plan(program, "mill", method).time < 1.05 * plan.time


@pytest.mark.parametrize("offset", [100.0, 1000.0])
def test_feeds_that_differ_by_rounding_cost_nothing(offset: float) -> None:
    # The path is cut where the feed changes, but no part may be so short that rounding bends it.
    def wave(more: float) -> str:
        lines = ["G21 G90 G17 G64 P0.05", f"G0 X{offset:g} Y{offset:g}"]
        for i in range(1, 1001):
            x, y = offset + 0.29 * i, offset + 8.0 * math.sin(0.058 * i)
            lines.append(f"G1 X{x:.4f} Y{y:.4f} F{30000 + i % 2 * more:.1f}")
        return "\n".join([*lines, "M2"]) + "\n"

    same, others = (planned(wave(more), method="jerk-limited") for more in (0.0, 0.1))
    assert others.time == pytest.approx(same.time, rel=SAME["jerk-limited"])
    assert others.gap < 1e-3


def test_moves_that_turn_back_within_the_tolerance_hold_nothing_up() -> None:
    # One piece follows the first line and the two short steps back at its end, which have no own place on it.
    text = (
        "G21 G90 G17 G64 P0.02\nG1 X1.001 Y0 Z0 F12000\nX0.998 Z-0.002\nX0.9979 Z0\n"
        "G2 X8.998 Y0 I4 J0 P3\nG1 X11.214\nM2\n"
    )
    plan = planned(text)
    assert (plan.path.move[0] == [0, 2]).all()
    time = feedplan.plan(again(feedplan.planned_program(plan)), "mill").time
    assert time == pytest.approx(plan.time, rel=SAME["bang-bang"])

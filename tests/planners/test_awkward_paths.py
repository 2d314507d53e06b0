"""Curves that are difficult for planners: plans keep every limit, or the curve is refused in a sentence."""

from __future__ import annotations

import numpy as np
import pytest

import feedplan
from feedplan.errors import FeedplanError
from feedplan.planners import limits_jerk
from tests.campaign import seeds
from tests.planners.audited import LONGEST, audited
from tests.planners.differences import exceeded
from tests.planners.random_paths import awkward_case

METHODS = ("bang-bang", "jerk-limited", "s-curve")
# They keep accelerations on lines; on curves they check places, and the audit reports what they miss.
CONTROLLERS = ("arc-transition", "constant-velocity-transition", "junction-deviation", "tangential")
COUNT = seeds(6)
# The seeds are divided into this many tests, which can run in parallel.
PARTS = 3


def faults(seed: int, method: str) -> list[str]:
    """What is wrong with the plan of a seed's curve by a method that keeps its limits on every curve."""
    path, machine = awkward_case(seed)
    made = feedplan.plan(path, machine, method=method)
    jerk = limits_jerk(method)
    found = list(audited(made.problem, made.profile, machine, jerk=jerk))
    if made.time < made.lower_bound:
        found.append(f"{made.time} s is below the bound, {made.lower_bound} s")
    if not np.isfinite([made.profile.p0, made.profile.p1]).all():
        found.append("p is infinite")
    if made.time <= LONGEST:
        points = made.setpoints().all()
        found += exceeded(points, machine, machine.period, jerk)
        end = path.curve.control_points[-1]
        if np.abs(points.position[-1] - end).max() > 1e-12 * np.abs(path.curve.control_points).max():
            found.append(f"the last setpoint is not the end of the path, {end}")
    return [f"{seed}: {sentence}" for sentence in found]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("part", range(PARTS))
def test_random_awkward_curves_keep_every_limit(part: int, method: str) -> None:
    found = []
    for seed in range(part, COUNT, PARTS):
        found += faults(seed, method)
    assert found == []


# Turns within 1e-20 mm between pieces with C' ≠ 0 (439, 652, 824); the duration of an arc that begins at a
# very low speed (473); a direction that changes within a millisecond at the feed (711); a stop in a cusp of
# order 4 (1056).
@pytest.mark.parametrize("seed", [439, 473, 652, 711, 824, 1056])
def test_curves_that_broke_the_exact_planner_or_its_audit(seed: int) -> None:
    assert faults(seed, "bang-bang") == []


# Turns finer than any grid: a single one (71), one in a piece that is straight to 3e-12 mm (255), some where
# |C'| is a thousandth to a millionth of its value elsewhere on the piece (82, 83, 1181, 2093). A stop at the
# same rounded place as the motion to it (194, 744); durations of arcs that begin at rest (21, 275); segments
# that are short and far from the origin (440, 465).
@pytest.mark.parametrize("method", ["jerk-limited", "s-curve"])
@pytest.mark.parametrize("seed", [21, 71, 82, 83, 194, 255, 275, 440, 465, 744, 1181, 2093])
def test_curves_that_broke_planners_with_a_limit_of_jerk_or_their_audit(seed: int, method: str) -> None:
    assert faults(seed, method) == []


def test_segments_are_as_short_as_the_turns_between_them() -> None:
    # With segments of 1/32 of a piece this took 1000 s, because a whole segment around the turn was slow.
    path, machine = awkward_case(236)
    assert feedplan.plan(path, machine, method="s-curve").time < 0.4


@pytest.mark.parametrize("method", CONTROLLERS)
def test_random_awkward_curves_do_not_look_fine_where_controllers_break_a_limit(method: str) -> None:
    refused = []
    for seed in range(COUNT):
        path, machine = awkward_case(seed)
        try:
            made = feedplan.plan(path, machine, method=method)
        except FeedplanError as error:
            refused.append(str(error))
            continue
        assert np.isfinite(made.time), seed
        if made.time <= LONGEST and made.audit().ok:
            assert exceeded(made.setpoints().all(), machine, machine.period, jerk=False) == [], seed
            assert made.time >= made.lower_bound, seed
    assert not any("line 0" in sentence for sentence in refused), refused

"""Straight curves of every degree, also rational ones, against the closed forms for lines."""

from __future__ import annotations

from pathlib import Path as FilePath

import numpy as np
import pytest

import feedplan
from feedplan import _solvers
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from tests.campaign import seeds
from tests.planners.lines import seven_sections, straight_case, trapezoid, ways


def test_the_closed_forms_by_hand() -> None:
    assert trapezoid(1.0, 1e9, 1.0) == 2.0
    assert trapezoid(1.0, 0.5, 1.0) == 2.5
    # In turn: jerk 1 up, down, down and up for half a second each; with constant acceleration between; with
    # constant speed between.
    assert seven_sections(2 * 0.5**3, 1e9, 1e9, 1.0) == pytest.approx(2.0, rel=1e-15)
    assert seven_sections(6.0, 1e9, 1.0, 1.0) == pytest.approx(6.0, rel=1e-15)
    assert seven_sections(10.0, 2.0, 1.0, 1.0) == pytest.approx(8.0, rel=1e-15)
    # C' = 8 (t − 1/4)(t − 3/4) on [0, 1]: 1/6 forward, back and forward.
    places, knots = np.array([0.0, 0.5, -1 / 3, 1 / 6]), np.repeat([0.0, 1.0], 4)
    np.testing.assert_allclose(ways(places, knots, 3, None), [1 / 6, 1 / 6, 1 / 6], rtol=1e-14)


@pytest.mark.parametrize("part", range(5))
def test_random_straight_curves_take_the_time_of_their_lines(part: int) -> None:
    for seed in range(part, seeds(150), 5):
        case = straight_case(seed)
        plan = feedplan.plan(case.path, case.machine)
        assert plan.time == pytest.approx(case.time, rel=1e-9), seed
        # The bound equals that time; up to rounding no plan is below it.
        bound = _solvers.lower_bound(plan.problem, plan.profile)
        assert -1e-12 < 1.0 - bound / plan.time < 1e-9, seed
        assert plan.lower_bound <= plan.time
        assert np.isfinite([plan.profile.p0, plan.profile.p1]).all()
        audit = plan.audit()
        assert audit.ok, (seed, audit)


# The curve turns so near to a knot that only rounding separates both.
@pytest.mark.parametrize("seed", [21692, 26825, 29391])
def test_curves_that_turn_beside_a_knot_take_the_time_of_their_lines(seed: int) -> None:
    case = straight_case(seed)
    assert feedplan.plan(case.path, case.machine).time == pytest.approx(case.time, rel=1e-9)


def test_with_a_limit_of_jerk_they_take_the_time_of_seven_sections() -> None:
    for seed in range(seeds(150) // 10):
        case = straight_case(seed)
        plan = feedplan.plan(case.path, case.machine, method="jerk-limited")
        # The planner uses a grid and stops at a finite accuracy.
        assert 1 - 1e-9 < plan.time / case.smooth_time < 1 + 1e-3, seed
        assert plan.audit().ok, seed


def test_a_nearly_straight_curve_of_degree_8_keeps_its_limits() -> None:
    # By the first rows of a triangular system alone, the distances on this curve would be wrong by 1e-3.
    x = [0, 2.644493, 2.954229, 3.528299, 3.665004, 4.182987, 5.398824, 5.957132, 6.506717]
    y = [0, -0.237082, -0.26485, -0.316316, -0.328572, -0.37501, -0.484011, -0.534064, -0.583335]
    weights = [9.059503, 6.113606, 2.886845, 0.520373, 3.588859, 0.115375, 9.26802, 7.639332, 0.136602]
    machine = Machine("plane", (Axis("X", 50, 500), Axis("Y", 50, 500)))
    plan = feedplan.plan(Path.from_bezier(np.stack([x, y], axis=1), weights), machine)
    # X alone limits the motion.
    assert plan.time == pytest.approx(trapezoid(6.506717, 50, 500), rel=1e-9)
    assert plan.gap < 1e-9
    assert plan.audit().ok


def test_a_line_that_turns_within_a_short_span_has_setpoints() -> None:
    places = [0.66338067, 0.66678883, 2.01878776, 0.36754625, 1.47468264, 1.85072007, 3.07797203]
    knots = [0, 0, 0, *[4.26602052e-4] * 2, 0.406685258, 1.19539194, *[1.19544144] * 3]
    path = Path.from_bspline(np.array(places)[:, None], knots, 2)
    plan = feedplan.plan(path, Machine("X", (Axis("X", 31.6, 1491.6),)))
    assert len(path.runs) == 4
    assert plan.setpoints().all().position[-1, 0] == pytest.approx(places[-1], abs=1e-12)
    assert plan.audit().ok


def test_lines_of_different_feeds_have_a_bound_that_is_their_time(tmp_path: FilePath) -> None:
    program = tmp_path / "feeds.ngc"
    program.write_text(
        "G21 G90 G94 G61\nG1 X10 F3000\nX25 F1200\nX60 F6000\nX20 F600\nX21 F3000\nX40 F2000\nM30\n"
    )
    plan = feedplan.plan(program, Machine.load("mill"))
    bound = _solvers.lower_bound(plan.problem, plan.profile)
    assert -1e-13 < 1.0 - bound / plan.time < 1e-9

"""Profiles of limited jerk: known times, limits between the grid's stations, other solvers, messages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest

from benchmarks.jerk_excess import jerk_excess
from benchmarks.named import FREE, butterfly, lemniscate, trefoil
from benchmarks.third_order import by_clarabel, by_ipopt, grid_of
from feedplan import plan as plan_program
from feedplan.audit import audit
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InfeasibleError, InputError, SolverError
from feedplan.geometry.path import Path
from feedplan.lower_bound import lower_bound
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import planner
from feedplan.profile import PhaseLaw
from tests.campaign import SEEDS, seeds
from tests.constraints.test_joints import NOT_PLAIN
from tests.constraints.test_joints import random_problem as random_joints
from tests.planners.audited import audited
from tests.planners.random_paths import random_case, random_problem

plan = planner("jerk-limited")
COUNT = seeds(12)
# The seeds are divided into this many tests, which can run in parallel.
PARTS = 12
# Allowed relative excess of a limit.
EXCESS = 1e-6
# The default accuracy of the planner.
ACCURACY = 1e-4
# Time limits after which plans are stopped [s]. Only a campaign uses other moments than 0, because the result
# then depends on the computer's speed.
MOMENTS = [0.0, 0.003, 0.03] if SEEDS else [0.0]


def curves_machine(velocity: float, acceleration: float, jerk: float) -> Machine:
    axes = tuple(Axis(name, velocity, acceleration, max_jerk=jerk) for name in "XYZ")
    return Machine("jerk", axes, chord_tolerance=np.inf)


CURVES = curves_machine(250.0, 3000.0, 50_000.0)


def assert_held(problem: Problem, method: str = "jerk-limited", **options: float) -> float:
    profile = planner(method, **options)(problem)
    excess = jerk_excess(problem, profile)
    assert excess.worst <= EXCESS, excess
    assert excess.gaps <= 1e-9, excess
    return profile.time


def test_nobody_changes_the_bound_of_a_plan() -> None:
    text = "G21 G90 F600\nG1 X10\nG61.1 G1 Y10\nM2\n"
    profile = plan_program(text, "mill", "jerk-limited").profile
    assert len(profile.run_bounds) == 2
    bound = profile.lower_bound
    for own in (profile, replace(profile), profile.with_others(run_bounds=np.array([1.0, 1.0]))):
        with pytest.raises(ValueError, match="read-only"):
            own.run_bounds[:] = 0.0
    assert replace(profile).lower_bound == bound


@pytest.mark.parametrize("method", ["jerk-limited", "s-curve", "ruckig"])
def test_a_square_with_stops_takes_as_long_as_by_hand(method: str) -> None:
    # Each side: 0.21 s and 10.5 mm up to 100 mm/s, 79 mm at 100 mm/s, 0.21 s down: 1.21 s.
    corners = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0], [0.0, 0.0]]
    problem = build_problem(Path.from_points(corners, 0.0), curves_machine(100.0, 500.0, 50_000.0))
    profile = planner(method)(problem)
    assert profile.time == pytest.approx(4.84, rel=1e-8)
    assert len(profile.runs) == 5
    assert (profile.kind == PhaseLaw.PATH_JERK).all()


@pytest.mark.parametrize(
    ("curve", "time"),
    [(lemniscate, 1.3170), (trefoil, 2.0352), (butterfly, 3.376)],
    ids=["lemniscate", "trefoil", "butterfly"],
)
def test_published_curves_take_no_longer_than_known(curve: object, time: float) -> None:
    problem = build_problem(Path.from_curve(curve(), feed=FREE), CURVES)  # type: ignore[operator]
    assert assert_held(problem) <= time


def test_a_feed_far_below_the_limits_is_held_in_few_arcs() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=10.0), CURVES)
    profile = plan(problem)
    # The start and the end lose √(v/J) each against the feed, with the jerk along the direction of the ends.
    way = problem.derivatives(np.zeros(1, np.uint32), np.zeros(1), 1)[1][0]
    jerk = 50_000.0 * np.linalg.norm(way) / np.abs(way).max()
    assert profile.time == pytest.approx(problem.path.length / 10.0 + 2 * np.sqrt(10.0 / jerk), rel=1e-6)
    held = profile.kind == PhaseLaw.FEED
    assert held.sum() < 20
    assert len(profile) < 1000
    assert profile.duration[held].sum() > 0.99 * profile.time
    assert_held(problem)


def test_the_relaxation_proves_the_lemniscate_and_more_than_the_second_order_bound() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    profile = plan(problem)
    assert lower_bound(problem, profile) < profile.lower_bound <= profile.time
    assert profile.lower_bound >= 0.9995 * profile.time


def test_other_solvers_find_the_same_time_on_the_same_grid() -> None:
    problem = build_problem(Path.from_curve(lemniscate(), feed=FREE), CURVES)
    profile = planner("jerk-limited", accuracy=1e-2)(problem)
    grid = grid_of(problem, profile)
    assert grid.time(grid.x / grid.reference) == pytest.approx(profile.time, rel=1e-6)
    assert by_ipopt(grid) == pytest.approx(profile.time, rel=3e-4)
    assert by_clarabel(grid) == pytest.approx(profile.time, rel=3e-4)


def faults_of(seed: int, **options: float) -> list[str]:
    """What is wrong with the plan of a random curve: by exact derivatives, and by the audit."""
    problem, machine = random_case(seed)
    profile = planner("jerk-limited", **options)(problem)
    excess = jerk_excess(problem, profile)
    found = [] if excess.worst <= EXCESS and excess.gaps <= 1e-9 else [f"{seed}: {excess}"]
    return found + [f"{seed}: {sentence}" for sentence in audited(problem, profile, machine)]


@pytest.mark.parametrize("part", range(PARTS))
def test_random_curves_keep_every_limit_whenever_they_are_stopped(part: int) -> None:
    found = []
    for seed in range(part, COUNT, PARTS):
        seconds = 10 ** np.random.default_rng(seed).uniform(-4.0, -1.0)
        found += faults_of(seed) + faults_of(seed, time_limit=seconds if SEEDS else 0.0)
    assert found == []


def test_a_piece_is_not_cut_where_its_speed_hardly_changes() -> None:
    # A corner of degree 7 continues its lines in three derivatives: its parameter speed is flat there.
    control = np.array(
        [
            [0.6171706581843494, 0.03421859924724033],
            [0.6170636123549124, 0.03484948504537392],
            [0.6169565665254754, 0.03548037084350739],
            [0.6168495206960384, 0.03611125664164097],
            [0.6168373216090614, 0.0381514976571373],
            [0.6169368156227507, 0.03878361820193011],
            [0.6170363096364401, 0.03941573874672281],
            [0.6171358036501294, 0.04004785929151564],
        ]
    )
    before, after = 2 * control[0] - control[1], 50 * control[-1] - 49 * control[-2]
    points = [[before, control[0]], control, [control[-1], after]]
    curve = CompositeCurve.joined([CompositeCurve.from_bezier(own) for own in points])
    problem = build_problem(Path.from_curve(curve, axes=("X", "Y"), feed=3.0), CURVES)
    assert plan(problem).duration.min() > 1e-7


def test_the_chord_speed_is_kept_where_the_radius_comes_to_be_the_tolerance() -> None:
    # A parabola whose radius at its tip is 2/3 of the chord tolerance: smaller radii allow no less speed.
    curve = CompositeCurve.from_bezier([[-0.1, 1.5], [0.0, -1.5], [0.1, 1.5]]).elevated(5)
    machine = replace(curves_machine(500.0, 50_000.0, 5e7), chord_tolerance=0.01, period=0.004)
    assert_held(build_problem(Path.from_curve(curve, axes=("X", "Y"), feed=FREE), machine))


def test_a_piece_of_a_nanometre_keeps_the_limit_of_jerk() -> None:
    ends = np.array([[0.0, 0.0], [1.0, 0.5], [1.0 + 8e-7, 0.5 + 4e-7], [10.0, 5.0]])
    curve = CompositeCurve.joined([CompositeCurve.from_bezier(ends[i : i + 2]) for i in range(3)])
    path = replace(Path.from_curve(curve, axes=("X", "Y"), feed=90.0), feed=np.array([90.0, 91.0, 92.0]))
    problem = build_problem(path, CURVES)
    profile = plan(problem)
    # One ramp at each end, and the short piece.
    by_jerk = profile.piece[profile.kind == PhaseLaw.PATH_JERK]
    assert set(by_jerk.tolist()) == {0, 1, 2}
    assert (profile.kind[profile.piece == 1] == PhaseLaw.PATH_JERK).all()
    assert jerk_excess(problem, profile).worst <= EXCESS
    assert audit(problem, profile, CURVES, jerk=True).ok


def test_turns_after_a_long_way_keep_the_limit_of_jerk(tmp_path: FilePath) -> None:
    # The length from the start, 1.2 km, has a rounding error of 2e-10 mm; phases may be as short as 1e-4 mm.
    turns = """\
X4.5705 Y58.4434 Z1.4321
X4.5903 Y58.4430 Z1.4320
X4.6004 Y58.1009 Z1.5442
X4.6116 Y57.7857 Z1.6607
X4.6240 Y57.4939 Z1.7817
X4.6373 Y57.2233 Z1.9078
X4.6515 Y56.9683 Z2.0411
X4.6665 Y56.7251 Z2.1839
"""
    file = tmp_path / "far.ngc"
    file.write_text(f"G64 P0.01\nG0 X4.57 Y58.44 Z1.43\nG1 F30000 Y-600000\nF4000\n{turns}M2\n")
    made = plan_program(file, "mill", method="jerk-limited")
    assert audited(made.problem, made.profile, made.machine) == ()


# Turns so sharp that the tool rests in them or nearly, stops next to turns, cusps on lines and on curves of
# degree 2 and more, ends next to rest, two axes that reach their greatest speeds alternately, a ramp of 0.3
# nm at the end of 721 mm, a bend of 1e-7 mm on 4 mm.
@pytest.mark.parametrize("seed", [53, 83, 115, 339, 538, 724, 2512, 3328, 4010, 4213, 4930, 6726, 6955, 7840])
def test_curves_that_all_but_stop_keep_every_limit(seed: int) -> None:
    assert faults_of(seed) == []


# The acceleration is built up within 5e-9 mm of a path of 559 mm, and within 5e-12 mm of one of 6 mm.
@pytest.mark.parametrize(("size", "feed", "acceleration"), [(100.0, 100.0, 3000.0), (1.0, 1.0, 300.0)])
def test_a_jerk_limit_too_high_to_matter_is_kept_next_to_rest(
    size: float, feed: float, acceleration: float
) -> None:
    points = size * np.array([[0.0, 0.0], [1.0, 0.2], [2.5, -1.0], [4.0, 3.0]])
    path = Path.from_curve(CompositeCurve.from_bezier(points), feed=feed)
    assert_held(build_problem(path, curves_machine(250.0, acceleration, 1e9)))


@pytest.mark.parametrize("name", NOT_PLAIN)
def test_random_curves_keep_every_limit_of_the_true_joints(name: str) -> None:
    problem = random_joints(name, 6)
    jerk = np.where(np.isfinite(problem.max_jerk), problem.max_jerk, 30 * problem.max_acceleration)
    assert_held(replace(problem, max_jerk=jerk))


@pytest.mark.parametrize("seconds", MOMENTS)
def test_a_time_limit_at_any_moment_gives_a_plan_that_keeps_the_limits(seconds: float) -> None:
    problem = random_problem(5)
    # Without a stop a plan is within its accuracy of the least time; a stopped one may be slower.
    assert assert_held(problem, time_limit=seconds) >= plan(problem).time * (1 - ACCURACY)
    assert faults_of(0, time_limit=seconds) == []


def test_setpoints_of_a_plan_that_creeps_are_where_it_is() -> None:
    # A setpoint 1e-8 mm before the turn is just as near to the path behind it, which is 1 ms later.
    assert faults_of(1734, time_limit=0.0) == []
    # In its first period the tool moves by 1e-10 mm: it does not wait.
    assert faults_of(3576, time_limit=0.0) == []


def test_speeds_at_the_ends_are_met_or_refused_with_the_speed_that_can_be_had() -> None:
    path = Path.from_curve(lemniscate(), feed=FREE)
    rest = plan(build_problem(path, CURVES)).time
    problem = build_problem(path, CURVES, start_speed=50.0, end_speed=120.0)
    profile = plan(problem)
    excess = jerk_excess(problem, profile)
    assert excess.worst <= EXCESS
    assert profile.time < rest
    assert (profile.a0[0], profile.a1[-1]) == (0.0, 0.0)
    # Both axes at 250 mm/s, at 45 degrees.
    with pytest.raises(InfeasibleError, match=r"no profile ends at 400 mm/s: at most 353\.") as fault:
        plan(build_problem(path, CURVES, end_speed=400.0))
    assert fault.value.reachable == pytest.approx(250 * np.sqrt(2), rel=1e-2)


def _round_corner() -> Path:
    """A line, a quarter turn of radius 10 mm, a line."""
    piece = CompositeCurve.from_bezier
    turn = piece([[30.0, 0.0], [40.0, 0.0], [40.0, 10.0]], [1.0, np.sqrt(0.5), 1.0])
    lines = piece([[0.0, 0.0], [30.0, 0.0]]), piece([[40.0, 10.0], [40.0, 40.0]])
    return Path.from_curve(CompositeCurve.joined([lines[0], turn, lines[1]]))


def test_jumps_of_curvature_hold_the_speed_and_are_told() -> None:
    made = plan_program(_round_corner(), CURVES, "jerk-limited")
    # The acceleration jumps by v²/10 mm; three quarters of the jump in a period may use 65 % of 50 000 mm/s³.
    allowed = np.sqrt(0.65 / 0.75 * 10.0 * 50_000.0 * CURVES.period)
    problem, profile = made.problem, made.profile
    assert jerk_excess(problem, profile).worst <= EXCESS
    assert profile.kinked.tolist() == [1, 2]
    first = np.searchsorted(profile.piece, profile.kinked)
    tangent = problem.curve.evaluate(profile.kinked, np.zeros(2), 1)[1]
    speed = np.linalg.norm(tangent, axis=1) * np.sqrt(profile.p0[first])
    assert speed == pytest.approx(allowed, rel=2e-3)
    (sentence,) = made.warnings
    assert sentence.startswith("the tool slows to 20.8 mm/s where the curvature jumps, as it does at 2 ")
    joints = replace(CURVES, axes=tuple(replace(axis, unit="rad") for axis in CURVES.axes))
    (sentence,) = plan_program(_round_corner(), joints, "jerk-limited").warnings
    assert sentence.startswith("the tool slows to 20.8 rad/s where")


def test_an_axis_without_a_limit_of_jerk_is_named_unless_it_rests() -> None:
    free = replace(CURVES.axes[2], max_jerk=np.inf)
    machine = replace(CURVES, axes=(*CURVES.axes[:2], free))
    problem = build_problem(Path.from_curve(trefoil(), feed=FREE), machine)
    for method in ("jerk-limited", "s-curve", "ruckig"):
        with pytest.raises(SolverError, match="axis Z has no limit of jerk: give it max_jerk in the machine"):
            planner(method)(problem)
    flat = CompositeCurve.from_bezier([[0.0, 0.0, 1.0], [10.0, 0.0, 1.0], [10.0, 10.0, 1.0]])
    assert_held(build_problem(Path.from_curve(flat), machine))


def test_options_out_of_range_are_refused() -> None:
    problem = build_problem(_round_corner(), CURVES)
    with pytest.raises(InputError, match=r"the accuracy is 1e-09: give 1e-05 to 0\.1"):
        planner("jerk-limited", accuracy=1e-9)(problem)
    with pytest.raises(InputError, match="the time limit is -1 s"):
        planner("jerk-limited", time_limit=-1.0)(problem)

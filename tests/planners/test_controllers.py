"""What controllers do instead of the optimum: by hand, by their source code, and against the optimum."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan import Axis, InfeasibleError, InputError, Machine, Plan, SolverError, plan
from feedplan.audit import audit
from feedplan.cli import main
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.geometry.path import Path
from feedplan.planners import corners, junction_deviation, methods, planner
from feedplan.planners._junctions import Junctions
from feedplan.planners._segments import is_line
from feedplan.planners.junction_deviation import corner_speed
from feedplan.profile import PhaseLaw
from feedplan.program.read import read_program
from feedplan.setpoints import Setpoints
from tests.turns import arc

Array = NDArray[np.float64]

CVT, ARCS, JUNCTION, TANGENTIAL = METHODS = (
    "constant-velocity-transition",
    "arc-transition",
    "junction-deviation",
    "tangential",
)
A, F, T = 3000.0, 100.0, 0.001
PLANE = Machine("plane", tuple(Axis(name, 500.0, A) for name in "XYZ"), period=T)
SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]

Write = Callable[..., FilePath]


@pytest.fixture
def write(tmp_path: FilePath) -> Write:
    def to_file(points: list[list[float]], feed: float = F, tolerance: float = 0.01) -> FilePath:
        lines = ["G21 G90 G17 G94", f"G64 P{tolerance:g}", f"G1 F{60.0 * feed:.9g}"]
        names = "XYZ"[: len(points[0])]
        words = (zip(names, point, strict=True) for point in (points if any(points[0]) else points[1:]))
        lines += [" ".join(f"{name}{value:.9f}" for name, value in pairs) for pairs in words]
        file = tmp_path / "part.ngc"
        file.write_text("\n".join([*lines, "M2"]) + "\n")
        return file

    return to_file


def side(length: float, before: float, after: float, held: float = 0.0) -> float:
    """Time of one line at the feed between ramps with acceleration A [s]; over the length `held` the speeds
    of its ends are constant."""
    ramps = (2.0 * F**2 - before**2 - after**2) / (2.0 * A)
    return (2.0 * F - before - after) / A + ((length - ramps - held) / F)


@pytest.mark.parametrize("method", METHODS)
def test_one_line_is_a_trapezoid_or_a_triangle(method: str, write: Write) -> None:
    assert plan(write([[0, 0], [10, 0]]), PLANE, method).time == pytest.approx(10.0 / F + F / A, rel=1e-12)
    short = plan(write([[0, 0], [1, 0]]), PLANE, method)
    assert short.time == pytest.approx(2.0 * math.sqrt(1.0 / A), rel=1e-12)
    # Along a diagonal both axes contribute.
    diagonal = plan(write([[0, 0], [1, 1]]), PLANE, method)
    assert diagonal.time == pytest.approx(2.0 * math.sqrt(1.0 / A), rel=1e-12)
    assert short.audit().ok
    assert diagonal.audit().ok


def test_constant_velocity_transition_turns_a_square_by_what_a_period_allows(write: Write) -> None:
    square = plan(write(SQUARE), PLANE, CVT)
    v = A * T
    way = v * T
    # A corner is passed at speed v, for one period before and one period after it.
    time = 2.0 * (side(10, 0, v, way) + T) + 2.0 * (side(10, v, v, 2 * way) + 2.0 * T)
    assert square.time == pytest.approx(time, rel=1e-12)
    assert square.path.corners is Corners.PROGRAMMED
    assert square.audit().ok


def test_junction_deviation_turns_a_square_by_the_formula_of_grbl_and_breaks_the_axes(write: Write) -> None:
    square = plan(write(SQUARE), PLANE, JUNCTION)
    # The velocity jumps along a diagonal, where √2 A is available; sin 45° / (1 − sin 45°) = 1 + √2.
    v = math.sqrt(math.sqrt(2.0) * A * 0.01 * (1.0 + math.sqrt(2.0)))
    assert square.time == pytest.approx(2.0 * side(10, 0, v) + 2.0 * side(10, v, v), rel=1e-12)
    verdict = square.audit()
    assert not verdict.ok
    for axis in "XY":
        jump, acceleration = verdict.check("jump", axis), verdict.check("acceleration", axis)
        assert jump.worst == pytest.approx(v, rel=1e-6)
        assert jump.limit == pytest.approx(A * T, rel=1e-5)
        assert {jump.line, acceleration.line} <= {4, 5, 6, 7}
        assert acceleration.ratio > 2.0


def test_arc_transition_turns_a_square_on_quarters_of_circles(write: Write) -> None:
    square = plan(write(SQUARE), PLANE, ARCS)
    radius = 0.01 / (math.sqrt(2.0) - 1.0)
    v = math.sqrt(0.5 * math.sqrt(3.0) * A * radius)
    lines = 2.0 * side(10 - radius, 0, v) + 2.0 * side(10 - 2.0 * radius, v, v)
    assert square.time == pytest.approx(lines + 3.0 * 0.5 * math.pi * radius / v, rel=1e-9)
    assert square.path.fit.deviation == pytest.approx(0.01, rel=1e-9)
    assert len(square.path) == 7
    assert square.audit().ok


def test_a_corner_of_short_lines_takes_half_of_each(write: Write) -> None:
    points = [[0, 0], [1, 0], [1.02, 0.02], [1.02, 1]]
    path = plan(write(points), PLANE, ARCS).path
    # Two arcs that meet in the middle of the short line: each takes half of it.
    assert len(path) == 4
    meeting = path.curve.control_points[path.curve.offsets[2]]
    np.testing.assert_allclose(meeting, [1.01, 0.01, 0.0], atol=1e-12)


def test_nothing_is_left_between_corners_of_nearly_equal_lines(write: Write) -> None:
    # Each corner takes 0.14 mm of the middle line; the remaining 2e-8 mm are too short to have a direction.
    a, b, c = 0.28, 0.28 + 2e-8, 0.28
    points = [[0, 0], [a, 0], [a + 0.8 * b, 0.6 * b], [a + 0.8 * b + c, 0.6 * b]]
    made = plan(write(points, tolerance=0.1), PLANE, ARCS)
    assert len(made.path) == 4
    assert made.audit().ok


def test_the_speed_of_transition_is_that_of_the_axis_that_turns_least_willingly(write: Write) -> None:
    machine = Machine("three", (Axis("X", 500.0, 4000.0), Axis("Y", 500.0, 2000.0), Axis("Z", 500.0, 900.0)))
    file = write([[0, 0, 0], [10, 0, 0], [10 + 12, 9, 8]])
    problem = _problem(file, machine, CVT)
    jump = np.array([1.0 - 12 / 17, 9 / 17, 8 / 17])
    expected = np.min(np.array([4.0, 2.0, 0.9]) / jump)
    assert problem.junction_speed[1] == pytest.approx(expected, rel=1e-12)
    profile = planner(CVT)(problem)
    ends = profile.p1[np.flatnonzero(np.diff(profile.piece))]
    assert np.sqrt(ends) == pytest.approx([expected], rel=1e-12)


@pytest.mark.parametrize("turn", [1e-4, 0.3, math.pi / 2, 2.5])
def test_corner_speeds_follow_grbl_and_klipper(turn: float, write: Write) -> None:
    # The velocity jumps along Y: the direction is −turn/2 before the corner and +turn/2 after it.
    way = 10.0 * np.array([math.cos(turn / 2), math.sin(turn / 2)])
    file = write([[0.0, 0.0], [way[0], -way[1]], [2 * way[0], 0.0]])
    problem = _problem(file, PLANE, JUNCTION)
    sine = math.sin(0.5 * (math.pi - turn))
    grbl = math.sqrt(A * 0.02 * sine / (1.0 - sine))
    assert corner_speed(problem, Junctions(0.02))[1] == pytest.approx(grbl, rel=1e-5)
    # Klipper's junction deviation is v₉₀² (√2 − 1)/a, so that the speed at a right angle is v₉₀.
    deviation = 5.0**2 * (math.sqrt(2.0) - 1.0) / A
    klipper = corner_speed(problem, Junctions(0.02, 5.0))[1]
    assert klipper == pytest.approx(corner_speed(problem, Junctions(deviation))[1], rel=1e-9)
    if turn == math.pi / 2:
        assert klipper == pytest.approx(5.0, rel=1e-9)
    by_speed = junction_deviation.plan(problem, square_corner_velocity=5.0)
    assert by_speed.time == pytest.approx(junction_deviation.plan(problem, deviation).time, rel=1e-9)


def test_a_reversal_is_a_stop_for_junction_deviation_and_a_crawl_for_the_period(write: Write) -> None:
    there_and_back = write([[0, 0], [10, 0], [0, 0]])
    assert plan(there_and_back, PLANE, JUNCTION).time == pytest.approx(2.0 * side(10, 0, 0), rel=1e-12)
    crawl = plan(there_and_back, PLANE, CVT)
    v = 0.5 * A * T
    assert crawl.time == pytest.approx(2.0 * (side(10, 0, v, v * T) + T), rel=1e-12)
    assert crawl.audit().ok


def test_on_a_circle_each_method_has_the_speed_of_its_rule() -> None:
    # Half a circle of radius 10 mm from rest to rest, at a feed that limits nothing.
    path = Path.from_curve(arc([10.0, 0.0], (0.0, 0.0), math.pi).with_width([15.0, 15.0]), feed=400.0)
    problem = build_problem(path, PLANE)
    top = {method: _top_speed(problem, method) for method in METHODS}
    # Along a diagonal √2 A is available; limits are checked at places only, so the top may be somewhat lower.
    assert 0.95 * math.sqrt(math.sqrt(2.0) * A * 10.0) < top[JUNCTION] < math.sqrt(math.sqrt(2.0) * A * 10.0)
    assert top[ARCS] == top[CVT] == pytest.approx(math.sqrt(0.5 * math.sqrt(3.0) * A * 10.0), rel=1e-9)
    assert top[TANGENTIAL] > 250.0
    optimum = planner("bang-bang")(problem).time
    for method in METHODS:
        profile = planner(method)(problem)
        stream = Setpoints(problem, profile, T)
        verdict = audit(problem, profile, PLANE, setpoints=stream)
        assert verdict.ok == (method in (ARCS, CVT)), (method, verdict.failures)
        assert not verdict.ok or profile.time > optimum
        # Only limits of the axes may be exceeded.
        assert {check.name for check in verdict.broken} <= {
            "acceleration",
            "recorded_acceleration",
            "recorded_velocity",
        }


def test_setpoints_from_and_to_rest_follow_a_speed_whose_square_is_linear() -> None:
    curve = arc([10.0, 0.0], (0.0, 0.0), 0.5).with_width([5.0])
    problem = build_problem(Path.from_curve(curve, feed=1e3), PLANE)
    profile = planner(TANGENTIAL)(problem)
    assert (profile.kind == PhaseLaw.SPEED_LINE).sum() > 2
    chunk = Setpoints(problem, profile, T).all()
    # Times by the midpoint rule in the square root of the distance, in which the integrand is smooth.
    for i in np.flatnonzero(profile.kind == PhaseLaw.SPEED_LINE):
        u0, u1 = profile.u0[i], profile.u1[i]
        ends = np.linalg.norm(curve.evaluate([0, 0], [u0, u1], 1)[1], axis=1) ** 2 * [
            profile.p0[i],
            profile.p1[i],
        ]
        share = (np.arange(20_000) + 0.5) / 20_000
        x = share**2 if ends[0] < ends[1] else 1.0 - share**2
        rate = np.linalg.norm(curve.evaluate(np.zeros(len(x), int), u0 + x * (u1 - u0), 1)[1], axis=1)
        time = rate * (u1 - u0) * 2.0 * share / np.sqrt(ends[0] + (ends[1] - ends[0]) * x) / len(x)
        assert time.sum() == pytest.approx(profile.duration[i], rel=1e-8)
        before = profile.duration[:i].sum()
        inside = (chunk.t > before) & (chunk.t < before + profile.duration[i])
        passed = np.cumsum(time) if ends[0] < ends[1] else np.cumsum(time[::-1])
        places = u0 + (x if ends[0] < ends[1] else x[::-1]) * (u1 - u0)
        np.testing.assert_allclose(
            chunk.u[inside], np.interp(chunk.t[inside] - before, passed, places), atol=2e-4
        )


@pytest.mark.parametrize("method", [CVT, ARCS, "linuxcnc"])
def test_a_curve_that_slows_beside_a_place_of_its_survey_keeps_all_limits(method: str) -> None:
    # |C'| falls to 2 % of its greatest value between two of nine places.
    curve = CompositeCurve.from_bezier([[0, 0], [4, 4], [-0.18, 3.59], [4.2, 0]])
    speed = np.linalg.norm(curve.evaluate(np.zeros(1001, int), np.linspace(0.0, 1.0, 1001), 1)[1], axis=1)
    assert speed.min() < 0.03 * speed.max()
    found = plan(Path.from_curve(curve, feed=20.0), PLANE, method).audit()
    assert found.ok, found.failures


@pytest.mark.parametrize("method", [CVT, ARCS, "linuxcnc"])
def test_an_axis_keeps_its_velocity_between_the_places_of_a_curve(method: str) -> None:
    limits = zip("XYZ", (300.0, 200.0, 100.0), (2000.0, 3000.0, 1000.0), strict=True)
    machine = Machine("uneven", [Axis(*own) for own in limits], period=T)
    for seed in range(4):
        random = np.random.default_rng(seed)
        points, weights = 60.0 * random.normal(size=(9, 3)), random.uniform(0.5, 2.0, 9)
        knots = [0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 6, 6, 6]
        made = plan(Path.from_nurbs(points, knots, 3, weights), machine, method)
        checks = [check for check in made.audit().checks if check.name == "velocity"]
        assert all(check.ok for check in checks), checks
        assert max(check.ratio for check in checks) > 0.9999


def test_lines_are_told_from_curves_and_from_uneven_parametrisations() -> None:
    straight = [[0.0, 0.0], [1.0, 2.0]]
    pieces = [
        CompositeCurve.from_bezier(straight),
        CompositeCurve.from_bezier([[1, 2], [2.5, 3], [4, 4]]),
        CompositeCurve.from_bezier([[4, 4], [5, 5], [8, 8]]),
        CompositeCurve.from_bezier([[8, 8], [9, 8], [9, 9]]),
        CompositeCurve.from_bezier([[9, 9], [10, 9], [11, 9]], [1.0, 2.0, 1.0]),
        arc([11, 9], (12, 9), 1.0),
    ]
    np.testing.assert_array_equal(is_line(CompositeCurve.joined(pieces)), [1, 1, 0, 0, 0, 0])


@pytest.mark.parametrize("seed", range(12))
def test_what_beats_the_optimum_breaks_a_limit_and_the_audit_says_so(seed: int, write: Write) -> None:
    points = _random_polyline(np.random.default_rng(seed))
    machine = Machine(
        "random", (Axis("X", 300.0, 2000.0), Axis("Y", 250.0, 3000.0), Axis("Z", 200.0, 1000.0))
    )
    file = write(points, feed=80.0, tolerance=0.05)
    for method in METHODS:
        made = plan(file, machine, method)
        optimum = planner("bang-bang")(made.problem)
        verdict = made.audit()
        if method in (CVT, ARCS):
            assert verdict.ok, verdict.failures
        if verdict.ok:
            assert made.profile.time >= optimum.time * (1.0 - 1e-9), method
        elif method == JUNCTION:
            assert any(check.name in ("jump", "acceleration") for check in verdict.broken)


@pytest.mark.parametrize("seed", range(4))
def test_second_differences_of_constant_velocity_transition_keep_every_axis(seed: int, write: Write) -> None:
    points = _random_polyline(np.random.default_rng(seed + 100))
    made = plan(write(points, feed=80.0), Machine.load("mill"), CVT)
    limit = made.problem.max_acceleration * (1.0 + 1e-6)
    assert (_second_differences(made) <= limit).all()
    # Under the same jumps the optimum brakes into the corner while it turns: both differences add up.
    optimum = replace(made, profile=planner("bang-bang")(made.problem))
    assert (_second_differences(optimum) > limit).any()
    assert not optimum.audit().ok


def test_programs_with_arcs_are_planned_and_audited(tmp_path: FilePath) -> None:
    file = tmp_path / "slot.ngc"
    file.write_text(
        "G21 G90 G17 G94 G64 P0.02\nG1 X20 F6000\nG3 X20 Y8 I0 J4\nG1 X0 Y8.5\nG2 X0 Y0 I0 J-4.25\nM2\n"
    )
    for method in METHODS:
        made = plan(file, PLANE, method)
        broken = {check.name for check in made.audit().broken}
        assert (not broken) == (method in (CVT, ARCS)), (method, made.audit().failures)
    # Where a line meets a curve, this method stops.
    made = plan(file, PLANE, CVT)
    assert made.profile.p1[np.flatnonzero(np.diff(made.profile.piece))].min() == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_the_command_plans_audits_and_reports_by_every_method(
    method: str, write: Write, tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    code = main(["plan", str(write(SQUARE)), "--machine", "mill", "--method", method, "-o", str(out)])
    verdict = json.loads((out / "plan.json").read_text())["audit"]
    assert (out / "report.html").exists()
    assert len(np.load(out / "setpoints.npz")["t"]) > 400
    assert code == (0 if verdict["ok"] else 1)
    assert verdict["ok"] == (method in (CVT, ARCS))
    error = capsys.readouterr().err
    assert ("the audit failed: line " in error) == (code == 1)


def test_start_and_end_speeds_are_met_or_refused(write: Write) -> None:
    file = write([[0, 0], [1, 0]])
    moving = plan(file, PLANE, JUNCTION, start_speed=50.0, end_speed=80.0)
    speeds = np.sqrt(moving.profile.p0[0]), np.sqrt(moving.profile.p1[-1])
    assert speeds == pytest.approx((50.0, 80.0), rel=1e-12)
    assert moving.audit().ok
    with pytest.raises(InfeasibleError, match=r"starts at 90 mm/s: at most 77\.459666"):
        plan(file, PLANE, JUNCTION, start_speed=90.0)
    with pytest.raises(InfeasibleError, match=r"ends at 90 mm/s: at most 77\.459666"):
        plan(file, PLANE, JUNCTION, end_speed=90.0)


def test_corners_have_one_rule(write: Write) -> None:
    with pytest.raises(
        InputError, match="square_corner_velocity and axis_jumps are rules for the same corners"
    ):
        plan(write(SQUARE), PLANE, JUNCTION, square_corner_velocity=5.0, axis_jumps=[1.0, 1.0, 1.0])


def test_what_cannot_be_planned_is_refused_in_a_sentence(write: Write, tmp_path: FilePath) -> None:
    cusp = Path.from_curve(CompositeCurve.from_bezier([[0, 0], [0, 0], [3, 0], [4, 4]]))
    with pytest.raises(SolverError, match=r"cusp.*bang-bang"):
        planner(TANGENTIAL)(build_problem(cusp, PLANE))
    with pytest.raises(SolverError, match=r"joints move in another way"):
        plan(write([[10, 10], [20, 10], [20, 30]]), "polar", CVT)
    with pytest.raises(InputError, match="junction deviation is -1"):
        junction_deviation.plan(_problem(write(SQUARE), PLANE, JUNCTION), -1.0)


def test_methods_are_the_modules_without_an_underscore() -> None:
    assert set(METHODS) < set(methods())
    assert not any(name.startswith(("_", "-")) for name in methods())
    assert corners("bang-bang") is corners(TANGENTIAL) is Corners.ROUNDED


def _problem(file: FilePath, machine: Machine, method: str) -> Problem:
    path = build_path(read_program(file, machine), machine, corners=corners(method))
    return build_problem(path, machine)


def _top_speed(problem: Problem, method: str) -> float:
    profile = planner(method)(problem)
    tangent = problem.curve.evaluate(profile.piece, profile.u1, 1)[1]
    return float(np.sqrt((tangent**2).sum(axis=1) * profile.p1).max())


def _random_polyline(rng: np.random.Generator) -> list[list[float]]:
    """Forty edges of 0.05 to 5 mm with slight turns, sharp turns, or none."""
    length = np.exp(rng.uniform(np.log(0.05), np.log(5.0), 40))
    direction = rng.normal(size=(40, 3)) * rng.choice([0.0, 0.05, 0.5, 5.0], size=(40, 1))
    direction[0] += 1.0
    direction = np.cumsum(direction, axis=0)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return [[0.0] * 3, *np.round(np.cumsum(length[:, None] * direction, axis=0), 6).tolist()]


def _second_differences(made: Plan) -> Array:
    position = made.setpoints().all().position
    return np.asarray(np.abs(np.diff(position, 2, axis=0)).max(axis=0) / made.machine.period**2)


@pytest.mark.parametrize("method", [CVT, JUNCTION, TANGENTIAL])
def test_the_parameter_of_a_line_does_not_matter(method: str) -> None:
    lines = [CompositeCurve.from_bezier(SQUARE[i : i + 2]) for i in range(2)]
    times = []
    for width in ([1.0, 1.0], [10.0, 10.0], [0.3, 70.0]):
        curve = CompositeCurve.joined(lines, 1e-9).with_width(np.array(width))
        path = Path.from_curve(curve, feed=F)
        # A corner that is passed, not a stop.
        path = replace(path, runs=np.array([0, 2]), dwell=np.zeros(1), corners=corners(method))
        times.append(planner(method)(build_problem(path, PLANE)).time)
    assert times == pytest.approx([times[0]] * 3, rel=1e-12)
    assert times[0] < 2.0 * (10.0 / F + F / A) * (1.0 + 1e-12)


def test_a_circle_little_greater_than_the_chord_error_is_passed_by_its_formula() -> None:
    # (T v/2)² = 2 ρ δ − δ² = 0.0016 mm² with ρ = 0.05 mm, δ = 0.02 mm and T = 0.01 s: 8 mm/s.
    machine = Machine("chord", tuple(Axis(name, 500.0, 1e6) for name in "XY"), 0.01, 0.02)
    circle = arc([0.05, 0.0], [0.0, 0.0], 2.0 * math.pi)
    profile = planner(TANGENTIAL)(build_problem(Path.from_curve(circle, feed=1e3), machine))
    cruise = profile.kind == PhaseLaw.FEED
    assert cruise.any()
    assert profile.value[cruise] == pytest.approx(64.0, rel=1e-9)

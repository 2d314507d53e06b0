"""The audit of machines whose joints are not the path's axes: it computes the joints by their kinematics."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from feedplan import plan
from feedplan.audit import Audit, audit
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.machine.path_derivatives import derivatives
from feedplan.planners import bang_bang
from feedplan.profile import OF_PHASES, PhaseLaw, SpeedProfile
from feedplan.setpoints import SetpointChunk
from tests.audit.curves import places_at, sampled
from tests.audit.faults import broken, changed, faster, rubbish
from tests.audit.joints import joint_problem, steady

Array = NDArray[np.float64]


def past_the_column(distance: float = 40.0) -> CompositeCurve:
    """A line from X −100 to 130 that passes the column of the cylindrical machine at this distance [mm]."""
    return CompositeCurve.from_pieces(np.array([[[-100.0, distance, 0.0], [130.0, distance, 30.0]]]), [232.0])


def wavy(seed: int = 1) -> CompositeCurve:
    """A smooth random path in five axes."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(7, 5)), axis=0) * 3
    return CompositeCurve.from_nurbs(points, [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4], 3).with_width(6.0)


def wide(name: str) -> Machine:
    """A bundled machine without limits of travel."""
    machine = Machine.load(name)
    anywhere = (-math.inf, math.inf)
    return replace(machine, axes=tuple(replace(axis, travel=anywhere) for axis in machine.axes))


CASES = {
    "cylindrical": ("cylindrical", "XYZ", past_the_column, {}),
    "trunnion-ac": ("trunnion-ac", "XYZAC", wavy, {"coordinate_mode": CoordinateMode.TIP}),
    "head-head": ("head-head", None, wavy, {"coordinate_mode": CoordinateMode.TIP}),
}


class Case:
    """A machine and the fastest plan along a tip path."""

    def __init__(self, machine: Machine, problem: Problem) -> None:
        self.machine, self.problem = machine, problem
        self.profile = bang_bang.plan(problem)
        self.points = sampled(problem, self.profile)

    def audit(self, chunks: Any = None, profile: SpeedProfile | None = None, **changes: Any) -> Audit:
        problem = replace(self.problem, **changes)
        return audit(problem, profile or self.profile, self.machine, None, chunks)


@pytest.fixture(scope="module", params=list(CASES))
def case(request: pytest.FixtureRequest) -> Case:
    name, letters, curve, changes = CASES[request.param]
    machine = wide(name)
    problem = joint_problem(machine, letters or "".join(machine.axis_names), curve(), **changes)
    return Case(machine, problem)


def limits_of(problem: Problem, p: float) -> tuple[Array, Array, Array]:
    """Greatest velocity and acceleration (joints,) at constant p by exact derivatives, and the piece of the
    greatest acceleration (joints,)."""
    (words,) = problem.words
    points, width = problem.path.curve.by_piece, problem.path.width
    shares = np.linspace(0.0, 1.0, 65)
    q = np.stack(
        [derivatives(words.kinematics, words.tip(points), width, np.full(len(width), t), 2) for t in shares],
        axis=1,
    )
    velocity, acceleration = np.abs(q[1]) * math.sqrt(p), np.abs(q[2]) * p
    worst = acceleration.max(axis=0)
    return velocity.max(axis=(0, 1)), worst.max(axis=0), worst.argmax(axis=0)


def test_a_steady_profile_is_measured_as_the_derivatives_say(case: Case) -> None:
    problem = case.problem
    velocity, acceleration, pieces = limits_of(problem, 1.0)
    # The greatest p that all joints allow.
    by_velocity = (problem.max_velocity / velocity) ** 2
    by_acceleration = problem.max_acceleration / np.maximum(acceleration, 1e-9)
    p = float(min(by_velocity.min(), by_acceleration.min()))
    speed = math.sqrt(p)
    count = len(problem.path)
    ends = np.array([0, count - 1]), np.array([0.0, problem.path.width[-1]])
    linear = [name in ("X", "Y", "Z") for name in problem.path.axes]
    start, end = np.linalg.norm(problem.path.curve.evaluate(*ends, 1)[1][:, linear], axis=1) * speed
    flat = replace(problem, start_speed=float(start), end_speed=float(end))
    good = audit(flat, steady(flat, 0.999 * p), case.machine)
    at_ends = {("junction", None)}
    assert broken(good) <= at_ends
    for k, name in enumerate(problem.axes):
        assert good.check("velocity", name).worst == pytest.approx(
            velocity[k] * math.sqrt(0.999) * speed, rel=1e-3
        )
        assert good.check("acceleration", name).worst == pytest.approx(
            acceleration[k] * 0.999 * p, rel=0.02, abs=1e-4
        )
    # Two percent too fast: the audit names the joint, line and value of the greatest use.
    result = audit(flat, steady(flat, 1.02 * p), case.machine)
    k = int(np.argmin(np.minimum(by_velocity, by_acceleration)))
    kind = "velocity" if by_velocity.min() < by_acceleration.min() else "acceleration"
    assert broken(result) - at_ends == {(kind, problem.axes[k])}
    check = result.check(kind, problem.axes[k])
    exact = velocity[k] * math.sqrt(1.02 * p) if kind == "velocity" else acceleration[k] * 1.02 * p
    assert check.worst == pytest.approx(exact, rel=0.02)
    if kind == "acceleration":
        line = problem.path.line[pieces[k]]
        assert abs(check.line - line) <= 10
        sooner = problem.path.width[: pieces[k]].sum() / math.sqrt(1.02 * p)
        later = problem.path.width[: pieces[k] + 1].sum() / math.sqrt(1.02 * p)
        slack = 0.1 * (later - sooner)
        assert sooner - slack <= check.time <= later + slack


def test_the_fastest_plan_passes_and_uses_its_limits(case: Case) -> None:
    result = case.audit([case.points])
    assert result.failures == ()
    used = [
        result.check(kind, name).ratio for kind in ("velocity", "acceleration") for name in case.problem.axes
    ]
    assert max(used) == pytest.approx(1.0, abs=1e-6)
    assert {"feed", "order", "duration", "junction", "continuity", "place", "grid", "gap"} <= {
        check.name for check in result.checks
    }
    assert {check.axis for check in result.checks} == {None, *case.problem.axes}


def test_a_thousandth_faster_fails(case: Case) -> None:
    profile = case.profile
    assert "acceleration" in {name for name, _ in broken(case.audit(profile=faster(profile)))}
    only_p = replace(profile, p0=profile.p0 * 1.001, p1=profile.p1 * 1.001)
    assert {"jump", "duration"} <= {name for name, _ in broken(case.audit(profile=only_p))}


def test_the_planners_stand_ins_are_never_asked(case: Case) -> None:
    joints = case.problem.joints
    assert joints is not None
    wrong = replace(joints, control_points=joints.control_points * 1.5)
    assert case.audit(joints=wrong).failures == ()


def test_every_way_of_breaking_a_profile_is_named(case: Case) -> None:
    profile = case.profile
    arc = len(profile) // 2
    line = case.problem.path.line[profile.piece[arc]]

    def names(**columns: Any) -> set[str]:
        return {name for name, _ in broken(case.audit(profile=replace(profile, **columns)))}

    assert names(duration=changed(profile.duration, arc, lambda t: 1.0001 * t)) == {"duration"}
    assert "order" in names(u0=changed(profile.u0, arc, lambda u: u + 1e-6))
    assert "jump" in names(p1=changed(profile.p1, arc, lambda p: 1.001 * p))
    for column in ("value", "u0", "p0", "p1", "duration"):
        bad = replace(profile, **{column: changed(getattr(profile, column), arc, math.nan)})
        result = case.audit(profile=bad)
        assert ("numbers", None) in broken(result)
        assert result.check("numbers").line == line
    assert names(kind=changed(profile.kind, arc, PhaseLaw.PARAMETER_ACCELERATION)) >= {"jump"}
    assert "order" in names(runs=np.array([0, len(profile) - 1]))
    without = {name: np.delete(getattr(profile, name), arc) for name in OF_PHASES}
    assert "order" in names(**without, runs=np.array([0, len(profile) - 1]))


def test_limits_of_feed_and_junctions_are_those_of_the_tip(case: Case) -> None:
    result = case.audit()
    feed = result.check("feed").worst
    assert broken(case.audit(feed=np.full(len(case.problem.path), feed * 0.999))) == {("feed", None)}
    assert case.audit(feed=np.full(len(case.problem.path), feed * 1.0001)).ok
    # The problem allows speed 0 at one junction.
    speed = changed(case.problem.junction_speed, len(case.problem.path) // 2, 0.0)
    result = case.audit(junction_speed=speed)
    assert broken(result) == {("junction", None)}
    assert result.check("junction").line == case.problem.path.line[len(case.problem.path) // 2]


def test_every_lowered_limit_is_the_one_that_is_named(case: Case) -> None:
    base = case.audit()
    for kind, field in (("velocity", "max_velocity"), ("acceleration", "max_acceleration")):
        for k, name in enumerate(case.problem.axes):
            worst = base.check(kind, name)
            if worst.worst > 1e-6:
                limit = changed(getattr(case.problem, field), k, worst.worst * (1 - 1e-4))
                result = case.audit(**{field: limit})
                assert broken(result) <= {(kind, name), ("jump", name)}
                assert (kind, name) in broken(result)


@pytest.mark.parametrize("seed", range(4))
def test_a_profile_of_rubbish_ends_in_a_verdict(case: Case, seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns = rubbish(rng, case.profile, (0.1, 1.0)[seed % 2])
    columns["piece"] = rng.integers(0, 2**32, len(case.profile), dtype=np.uint32)
    kept = {**columns, "piece": case.profile.piece}
    for some in (columns, kept):
        assert not case.audit([case.points], profile=replace(case.profile, **some)).ok


def shifted(points: SetpointChunk, row: int, shift: Array) -> SetpointChunk:
    return replace(points, position=changed(points.position, row, lambda q: q + shift))


def test_a_setpoint_off_its_place_is_found(case: Case) -> None:
    points = case.points
    row = len(points.t) // 2
    for k in range(len(case.problem.axes)):
        shift = np.zeros(len(case.problem.axes))
        shift[k] = 3e-5
        result = case.audit([shifted(points, row, shift)])
        assert ("place", None) in broken(result)
        assert result.check("place").time == pytest.approx(points.t[row])
        assert result.check("place").worst <= 4e-5
    late = shifted(points, row, -1e-6 * points.velocity[row])
    result = case.audit([late])
    assert ("place", None) in broken(result)
    assert result.check("place").worst == pytest.approx(1e-6 * np.linalg.norm(points.velocity[row]), rel=0.05)


def test_a_turn_more_is_the_same_angle_and_half_a_turn_is_not(case: Case) -> None:
    (words,) = case.problem.words
    turning = np.array(words.kinematics.turning)
    turned = replace(case.points, position=case.points.position + 360.0 * turning)
    assert case.audit([turned]).failures == ()
    if turning.any():
        half = replace(case.points, position=case.points.position + 180.0 * turning)
        assert ("place", None) in broken(case.audit([half]))


def test_recorded_velocities_and_times_are_compared(case: Case) -> None:
    points = case.points
    row = int(np.argmax(np.abs(points.velocity).max(axis=1)))
    wrong = replace(points, velocity=changed(points.velocity, row, lambda v: 1.02 * v))
    assert "recorded_velocity" in {name for name, _ in broken(case.audit([wrong]))}
    assert ("place", None) in broken(case.audit([replace(points, t=points.t * 1.0001)]))
    assert ("place", None) in broken(case.audit([rows(points, slice(0, -2))]))
    assert ("place", None) in broken(case.audit([rows(points, slice(3, None))]))
    nothing = replace(points, position=changed(points.position, row, math.nan))
    assert ("numbers", None) in broken(case.audit([nothing]))


def test_recorded_accelerations_are_compared_where_jerk_is_limited() -> None:
    text = "G21 G90 G43.4 H0\nG1 X10 Y5 A20 C30 F2000\nX25 Y0 A-10 C60\nM2\n"
    planned = plan(text, Machine.load("trunnion-ac"), "jerk-limited")
    points = planned.setpoints(1e-3).all()
    row, k = np.unravel_index(np.abs(points.acceleration).argmax(), points.acceleration.shape)
    wrong = changed(points.acceleration, row, lambda a: np.where(np.arange(5) == k, -a, a))
    for acceleration, name in ((points.acceleration, None), (wrong, "recorded_acceleration")):
        given = replace(points, acceleration=acceleration)
        result = audit(planned.problem, planned.profile, planned.machine, planned.program, [given])
        assert broken(result) == ({(name, points.axes[k])} if name else set())


def rows(points: SetpointChunk, part: slice) -> SetpointChunk:
    names = ("t", "position", "velocity", "acceleration", "jerk", "line")
    return SetpointChunk(**{name: getattr(points, name)[part] for name in names}, axes=points.axes)


def test_the_size_of_the_chunks_changes_nothing(case: Case) -> None:
    whole = case.audit([case.points]).to_json()
    for size in (7, 100):
        parts = [rows(case.points, slice(i, i + size)) for i in range(0, len(case.points.t), size)]
        assert case.audit(parts).to_json() == whole


def test_a_stop_with_a_pause_may_wait_for_the_next_period() -> None:
    machine = wide("cylindrical")
    there = past_the_column()
    back = there.reversed()
    way = joint_problem(machine, "XYZ", CompositeCurve.joined([there, back]))
    count = len(way.path)
    half = count // 2
    stop = way.junction_speed.copy()
    stop[half] = 0.0
    path = replace(
        way.path, runs=np.array([0, half, count]), dwell=np.array([0.0203, 0.0]), start_dwell=0.005
    )
    problem = replace(way, path=path, words=way.words * 2, junction_speed=stop)
    profile = bang_bang.plan(problem)
    time = profile.run_times
    first = int(np.ceil((time[0] + 0.0203) / 1e-3 - 1e-9))
    second = int(np.ceil(time[1] / 1e-3 - 1e-9))
    t = np.arange(5 + first + second + 1) * 1e-3
    own = np.where(
        t < 0.005 + first * 1e-3 - 1e-9, np.clip(t - 0.005, 0, time[0]), time[0] + t - 0.005 - first * 1e-3
    )
    own = np.clip(own, 0.0, time.sum())
    fine = sampled_at(replace(problem, words=way.words), profile, own)
    points = replace(fine, t=t)
    assert audit(problem, profile, machine, None, [points]).failures == ()
    # The setpoints after the first stop come two periods too late.
    waits = np.insert(np.arange(len(t)), 5 + first, [5 + first] * 2)
    later = {n: getattr(points, n)[waits] for n in ("position", "velocity", "acceleration", "jerk", "line")}
    late = replace(points, t=np.arange(len(waits)) * 1e-3, **later)
    assert ("place", None) in broken(audit(problem, profile, machine, None, [late]))


def sampled_at(problem: Problem, profile: SpeedProfile, own: Array) -> SetpointChunk:
    """Setpoints at times in motion `own`; the tool rests where two successive times are equal."""
    arc, u, root_p = places_at(problem, profile, own)
    piece = profile.piece[arc].astype(np.int64)
    words = problem.words[0]
    curve = problem.path.curve
    control = np.stack([curve.control_points[slice(*curve.offsets[i : i + 2])] for i in piece])
    q = derivatives(
        words.kinematics, words.tip(control), curve.width[piece], np.minimum(u / curve.width[piece], 1), 1
    )
    velocity = np.nan_to_num(q[1] * root_p[:, None])
    waits = np.diff(own) == 0.0
    rests = [problem.start_speed == 0.0], [problem.end_speed == 0.0]
    stands = np.concatenate([rests[0], waits]) | np.concatenate([waits, rests[1]])
    velocity[stands] = 0.0
    zero = np.zeros_like(velocity)
    return SetpointChunk(own, q[0], velocity, zero, zero, problem.path.line[piece], problem.axes)


def test_a_speed_along_the_tip_is_constant_over_its_length() -> None:
    # √(230² + 30²) mm of line over a parameter of 232, at 40 mm/s.
    machine = wide("cylindrical")
    problem = joint_problem(machine, "XYZ", past_the_column())
    width, count = problem.path.width, len(problem.path)
    rate = math.hypot(230.0, 30.0) / 232.0
    flat = steady(problem, (40.0 / rate) ** 2)
    problem = replace(problem, start_speed=40.0, end_speed=40.0, feed=np.full(count, 40.0))
    kinds = {
        PhaseLaw.FEED: np.full(count, 1600.0),
        PhaseLaw.SPEED_LINE: np.zeros(count),
    }
    for kind, value in kinds.items():
        profile = replace(flat, kind=np.full(count, kind, np.uint8), value=value)
        result = audit(problem, profile, machine)
        assert result.failures == ()
        assert result.check("feed").worst == pytest.approx(40.0, rel=1e-9)
        slow = replace(profile, duration=changed(profile.duration, 3, lambda t: 1.0001 * t))
        assert broken(audit(problem, slow, machine)) == {("duration", None)}
    assert profile.time == pytest.approx(math.hypot(230.0, 30.0) / 40.0)
    faster = replace(problem, feed=changed(problem.feed, 4, 39.99))
    result = audit(faster, flat, machine)
    assert broken(result) == {("feed", None)}
    assert result.check("feed").line == problem.path.line[4]
    assert width.sum() == pytest.approx(232.0)


def test_where_only_rotary_words_move_the_feed_is_theirs() -> None:
    machine = wide("trunnion-ac")
    turn = np.array([[[5.0, 0.0, 0.0, 0.0, 0.0], [5.0, 0.0, 0.0, 0.0, 30.0]]])
    problem = joint_problem(
        machine, "XYZAC", CompositeCurve.from_pieces(turn, [30.0]), coordinate_mode=CoordinateMode.TIP
    )
    problem = replace(problem, start_speed=20.0, end_speed=20.0)
    result = audit(problem, steady(problem, 400.0), machine)
    assert result.failures == ()
    assert result.check("feed").worst == pytest.approx(20.0)
    assert result.check("velocity", "C").worst == pytest.approx(20.0)


def test_the_chord_error_is_that_of_the_tip() -> None:
    # y = 60 + x²/40: the radius is ρ = 20 mm at x = 0, half way in the parameter, at 60 mm/s and 1 ms.
    parabola = np.array([[[-20.0, 70.0, 0.0], [0.0, 50.0, 0.0], [20.0, 70.0, 0.0]]])
    machine = wide("cylindrical")
    problem = joint_problem(machine, "XYZ", CompositeCurve.from_pieces(parabola, [40.0]))
    profile = steady(problem, 3600.0)
    ends = 60.0 * math.sqrt(2.0)
    sagitta = 20.0 - math.sqrt(400.0 - 0.03**2)
    problem = replace(problem, start_speed=ends, end_speed=ends, chord_tolerance=sagitta * 1.001)
    t = np.append(np.arange(0.0, 0.6667, 1e-3), profile.time)
    points = sampled_at(problem, profile, t)
    result = audit(problem, profile, machine, None, [points])
    assert result.failures == ()
    tight = audit(replace(problem, chord_tolerance=sagitta * 0.99), profile, machine)
    assert broken(tight) == {("chord", None)}
    assert tight.check("chord").worst == pytest.approx(sagitta, rel=1e-3)
    by_points = audit(replace(problem, chord_tolerance=sagitta * 0.5), profile, machine, None, [points])
    assert by_points.check("chord").worst == pytest.approx(sagitta, rel=2e-2)
    coarse = rows(points, slice(None, None, 2))
    double = replace(problem, period=2e-3, chord_tolerance=2.0 * sagitta)
    assert ("chord", None) in broken(audit(double, profile, machine, None, [coarse]))


def test_the_travel_is_that_of_the_joints() -> None:
    machine = wide("cylindrical")
    problem = joint_problem(machine, "XYZ", past_the_column())
    profile = bang_bang.plan(problem)

    def limited(name: str, least: float, most: float) -> Machine:
        axes = tuple(replace(a, travel=(least, most)) if a.name == name else a for a in machine.axes)
        return replace(machine, axes=axes)

    # The arm comes as near as 40 mm to the column; the column turns from 158.2° to 17.1°.
    assert audit(problem, profile, limited("X", 39.9, 500.0)).ok
    result = audit(problem, profile, limited("X", 41.0, 500.0))
    assert broken(result) == {("travel", "X")}
    travel = result.check("travel", "X")
    assert travel.worst == pytest.approx(40.0, abs=0.05)
    # The tool passes the column after 100 of its 230 mm, still at a high speed.
    assert travel.time == pytest.approx(0.45 * profile.time, rel=0.02)
    piece = profile.piece[np.searchsorted(np.cumsum(profile.duration), travel.time)]
    assert travel.line == problem.path.line[piece]
    assert audit(problem, profile, limited("C", 0.0, 160.0)).ok
    assert audit(problem, profile, limited("C", 360.0, 520.0)).ok
    assert broken(audit(problem, profile, limited("C", 20.0, 158.0))) == {("travel", "C")}


def test_a_corner_of_the_joints_needs_the_jump_that_the_machine_allows() -> None:
    machine = wide("cylindrical")
    corner = np.array([[[50.0, 40.0, 0.0], [60.0, 40.0, 0.0]], [[60.0, 40.0, 0.0], [60.0, 50.0, 0.0]]])
    problem = joint_problem(machine, "XYZ", CompositeCurve.from_pieces(corner, [10.0, 10.0]))
    problem = replace(problem, start_speed=5.0, end_speed=5.0)
    profile = steady(problem, 25.0)
    result = audit(problem, profile, machine)
    assert broken(result) == {("jump", "C"), ("jump", "X")}
    # The direction changes from (1, 0) to (0, 1) at 5 mm/s: the arm's velocity jumps by 5 (y − x)/r, the
    # column's by 5 (x + y)/r².
    radius = math.hypot(60.0, 40.0)
    assert result.check("jump", "X").worst == pytest.approx(5.0 * 20.0 / radius, rel=1e-6)
    assert result.check("jump", "C").worst == pytest.approx(math.degrees(5.0 * 100.0 / radius**2), rel=1e-6)
    for jump, ok in ((6.0, True), (5.4, False)):
        axes = tuple(replace(axis, max_velocity_jump=jump) for axis in machine.axes)
        assert audit(problem, profile, replace(machine, axes=axes)).ok == ok


@given(st.integers(0, 2**32 - 1))
def test_random_paths_of_a_trunnion_pass_and_a_thousandth_faster_fail(seed: int) -> None:
    machine = wide("trunnion-ac")
    problem = joint_problem(machine, "XYZAC", wavy(seed), coordinate_mode=CoordinateMode.TIP)
    profile = bang_bang.plan(problem)
    assert audit(problem, profile, machine).failures == ()
    assert not audit(problem, faster(profile), machine).ok

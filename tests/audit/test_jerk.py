"""The audit of profiles with limited jerk: closed forms; planted faults are found, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.audit import Audit, audit
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.setpoints import Setpoints
from tests.along import path_along, problem_along
from tests.audit.curves import machine_of
from tests.audit.test_joints import past_the_column, wavy, wide
from tests.jerk_arcs import constant_jerk, cubic_speed, rest_to_rest
from tests.test_setpoints_jerk import profiles, random_curve
from tests.turns import arc

Array = NDArray[np.float64]
FREE = 1e6


def judged(problem: Problem, profile: SpeedProfile, with_setpoints: bool = True, **changes: Any) -> Audit:
    """The verdict on a profile whose method claims to limit jerk."""
    problem = replace(problem, **changes)
    stream = Setpoints(problem, profile, problem.period) if with_setpoints else None
    return audit(problem, profile, machine_of(problem), None, stream, jerk=True)


def broken(result: Audit) -> set[str]:
    return {check.name for check in result.broken}


def problem_on(curve: CompositeCurve, jerk: Any = FREE**2) -> Problem:
    """A problem along a curve with jerk limits and no other effective ones."""
    return problem_along(path_along(curve), FREE, FREE, max_jerk=np.broadcast_to(jerk, curve.axes))


def line() -> tuple[Problem, SpeedProfile]:
    """100 mm along (3, 4) from rest to rest at 3200 mm/s³: 1920 and 2560 mm/s³ of the axes."""
    curve = CompositeCurve.from_bezier(np.linspace(0.0, 100.0, 4)[:, None] * [0.6, 0.8], width=100.0)
    return problem_on(curve, [1920.0, 2560.0]), constant_jerk(curve, rest_to_rest(100.0, 3200.0))


def test_a_line_at_its_jerk_limit_passes_and_measures_the_limit() -> None:
    result = judged(*line())
    assert result.failures == ()
    for axis, limit in (("X", 1920.0), ("Y", 2560.0)):
        assert result.check("jerk", axis).worst == pytest.approx(limit, rel=1e-9)
        assert result.check("jerk", axis).judged
    assert result.check("velocity", "X").worst == pytest.approx(0.6 * 200.0, rel=1e-9)
    assert result.check("acceleration", "Y").worst == pytest.approx(0.8 * 800.0, rel=1e-3)


@pytest.mark.parametrize("with_setpoints", [False, True])
def test_a_jerk_two_millionths_above_its_limit_is_found(with_setpoints: bool) -> None:
    problem, profile = line()
    for excess, found in ((0.5e-6, set()), (2e-6, {"jerk"})):
        limits = problem.max_jerk / [1.0 + excess, 0.5]
        result = judged(problem, profile, with_setpoints, max_jerk=limits)
        assert broken(result) == found
        assert {check.axis for check in result.broken} <= {"X"}


def test_setpoints_alone_show_the_excess_too() -> None:
    problem, profile = line()
    stream = Setpoints(problem, profile, 0.001).all()
    # Rounding of third differences over 1 ms hides an excess of about 2e-6 of the limit.
    for excess, ok in ((0.5e-6, True), (1e-5, False)):
        tight = replace(problem, max_jerk=problem.max_jerk / (1.0 + excess))
        # The profile is not audited: only positions count.
        result = audit(tight, None, machine_of(tight), None, [stream], jerk=True)
        assert result.ok == ok, result.failures
        assert broken(result) <= {"jerk"}


def circle_case(radius: float = 10.0) -> tuple[Problem, SpeedProfile, list[tuple[float, float]]]:
    curve = arc([radius, 0.0], [0.0, 0.0], 1.9 * math.pi)
    sections = rest_to_rest(CurveLength(curve).total, 2000.0, 0.8)
    return problem_on(curve), constant_jerk(curve, sections), sections


def test_on_a_circle_jerk_is_what_the_closed_form_says() -> None:
    problem, profile, sections = circle_case()
    result = judged(problem, profile)
    assert result.failures == ()
    worst = np.zeros(2)
    s, v, a, radius = 0.0, 0.0, 0.0, 10.0
    for duration, jerk in sections:
        t = np.linspace(0.0, duration, 20_001)
        way, speed = s + t * (v + t * (a / 2 + t * jerk / 6)), v + t * (a + t * jerk / 2)
        pull, angle = a + t * jerk, way / radius
        along, across = jerk - speed**3 / radius**2, 3 * speed * pull / radius
        x = -np.sin(angle) * along - np.cos(angle) * across
        y = np.cos(angle) * along - np.sin(angle) * across
        worst = np.maximum(worst, [np.abs(x).max(), np.abs(y).max()])
        s, v, a = way[-1], speed[-1], pull[-1]
    for axis, value in zip("XY", worst, strict=True):
        assert result.check("jerk", axis).worst == pytest.approx(value, rel=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_random_curves_pass_at_their_own_jerk_and_fail_below_it(seed: int) -> None:
    curve = random_curve(seed)
    for profile in profiles(curve, seed):
        problem = problem_on(curve)
        places = np.array([0, len(curve) - 1]), np.array([0.0, curve.width[-1]])
        ends = np.linalg.norm(curve.evaluate(*places, 1)[1], axis=1)
        ends *= np.sqrt([profile.p0[0], profile.p1[-1]])
        problem = replace(problem, start_speed=float(ends[0]), end_speed=float(ends[1]))
        dense = Setpoints(problem, profile, 2e-5).all()
        most = np.abs(dense.jerk[1:-1]).max(axis=0)
        free = judged(problem, profile)
        assert free.failures == ()
        worst = np.array([free.check("jerk", axis).worst for axis in problem.axes])
        np.testing.assert_allclose(worst, most, rtol=2e-3)
        assert judged(problem, profile, max_jerk=worst).failures == ()
        alone = judged(problem, profile, with_setpoints=False)
        worst = np.array([alone.check("jerk", axis).worst for axis in problem.axes])
        k = seed % len(worst)
        tight = worst.copy()
        tight[k] /= 1.0 + 2e-6
        result = judged(problem, profile, False, max_jerk=tight)
        assert {(check.name, check.axis) for check in result.broken} == {("jerk", problem.axes[k])}


def changed(profile: SpeedProfile, place: int, **changes: float) -> SpeedProfile:
    columns = {name: getattr(profile, name).copy() for name in changes}
    for name, value in changes.items():
        columns[name][place] += value
    return replace(profile, **columns)


def names(problem: Problem, profile: SpeedProfile) -> set[str]:
    return broken(judged(problem, profile, with_setpoints=False))


def test_every_way_of_breaking_an_arc_is_named() -> None:
    problem, profile, _ = circle_case()
    problem = replace(problem, max_jerk=np.full(2, 1e5))
    assert names(problem, profile) == set()
    assert names(problem, changed(profile, 1, duration=1e-5 * profile.duration[1])) >= {"duration"}
    assert names(problem, changed(profile, 1, value=1.0)) >= {"duration", "acceleration_continuity"}
    assert names(problem, changed(profile, 1, a0=1.0)) >= {"duration", "acceleration_continuity"}
    assert names(problem, changed(profile, 1, a1=1.0)) == {"acceleration_continuity"}
    assert names(problem, changed(profile, 1, p1=1e-3 * profile.p1[1])) >= {"jump"}
    assert names(problem, changed(profile, 0, p0=1.0)) >= {"junction"}
    assert names(problem, changed(profile, 0, a0=math.nan)) == {"numbers"}
    assert names(problem, changed(profile, 0, kind=2)) >= {"numbers"}


def test_every_way_of_breaking_a_cubic_is_named() -> None:
    curve = random_curve(1)
    profile = cubic_speed(curve, lambda s: 900.0 + 4.0 * s, lambda s: 4.0, 3)
    problem = replace(problem_on(curve), start_speed=30.0, max_jerk=np.full(curve.axes, 1e7))
    last = math.sqrt(900.0 + 4.0 * CurveLength(curve).total)
    problem = replace(problem, end_speed=last)
    assert names(problem, profile) == set()
    assert names(problem, changed(profile, 4, duration=1e-5 * profile.duration[4])) == {"duration"}
    assert names(problem, changed(profile, 4, a0=0.2)) == {"duration", "acceleration_continuity"}
    assert names(problem, changed(profile, 4, p1=1e-3 * profile.p1[4])) >= {"jump", "duration"}
    # The speed falls to 0 inside the phase.
    assert "duration" in names(problem, changed(profile, 4, a0=-1e4))


def test_acceleration_that_steps_is_no_limited_jerk() -> None:
    # A trapezoid of speed: jerk is 0 inside the phases, but the acceleration jumps between them.
    curve = CompositeCurve.from_bezier([[0.0, 0.0], [50.0, 0.0], [100.0, 0.0]], width=100.0)
    problem = problem_on(curve, 1e6)
    up = constant_jerk(curve, [(0.5, 0.0), (0.5, 0.0)])
    half = {"value": np.zeros(2), "u0": np.array([0.0, 50.0]), "u1": np.array([50.0, 100.0])}
    top = 2 * 400.0 * 50.0
    profile = replace(
        up,
        **half,
        p0=np.array([0.0, top]),
        p1=np.array([top, 0.0]),
        duration=np.full(2, 0.5),
        a0=np.array([400.0, -400.0]),
        a1=np.array([400.0, -400.0]),
    )
    result = judged(problem, profile, with_setpoints=False)
    assert broken(result) == {"acceleration_continuity"}
    check = result.check("acceleration_continuity")
    assert check.worst == pytest.approx(800.0)
    assert check.time == pytest.approx(0.5)
    # The setpoints alone show it as well.
    assert "jerk" in broken(judged(problem, profile, max_jerk=np.full(2, 1e4)))


def test_arcs_of_other_kinds_claim_what_nothing_limits() -> None:
    problem, profile = line()
    arcs = replace(profile, kind=np.full(len(profile), PhaseLaw.AXIS_ACCELERATION, np.uint8))
    arcs = replace(arcs, axis=np.zeros(len(profile), np.uint8), a0=0 * profile.a0, a1=0 * profile.a1)
    result = judged(problem, arcs, with_setpoints=False)
    assert result.check("jerk", "X").ratio == math.inf


def straight_into_a_bend(speed: float, radius: float = 20.0) -> tuple[Problem, SpeedProfile]:
    """20 mm along X, then a quarter turn, at constant speed: the curvature jumps by 1/radius between them."""
    straight = CompositeCurve.from_bezier([[-20.0, 0.0], [-10.0, 0.0], [0.0, 0.0]], width=20.0)
    turn = arc([0.0, 0.0], [0.0, radius], 0.5 * math.pi)
    curve = CompositeCurve.joined([straight, turn])
    profile = constant_jerk(curve, [(CurveLength(curve).total / speed, 0.0)], start=(speed, 0.0))
    problem = replace(problem_on(curve, 1e5), start_speed=speed, end_speed=speed)
    return problem, profile


def test_a_step_of_the_acceleration_where_the_curvature_jumps_shows_as_a_jerk() -> None:
    # The acceleration jumps by v²/R = 45 mm/s². Third differences over 1 ms show 3/4 of this jump if it is
    # between two setpoints, and 1/2 if it is at a setpoint.
    for start, share in ((0.5, 0.75), (0.0, 0.5)):
        speed = 20.0 / ((666.0 + start) * 0.001)
        problem, profile = straight_into_a_bend(speed)
        step = speed**2 / 20.0
        shown = share * step / 0.001
        for jerk, ok in ((1.001 * shown, True), (0.999 * shown, False)):
            limit = np.full(2, jerk)
            result = judged(problem, profile, max_jerk=limit)
            assert result.check("jerk", "Y").worst == pytest.approx(shown, rel=1e-3)
            assert ("jerk" in broken(result)) == (not ok)
            # Without a path the setpoints alone show it.
            known = replace(problem, max_jerk=limit)
            alone = [Setpoints(problem, profile, 0.001).all()]
            result = audit(known, None, machine_of(problem), None, alone, jerk=True)
            assert result.ok == ok


def test_a_step_of_the_acceleration_that_no_difference_may_show_is_named() -> None:
    # A limit of 33 750 mm/s³ allows 33.75 mm/s² per period of 1 ms, and a jump of 4/3 of that: 45 mm/s².
    problem, profile = straight_into_a_bend(30.0)
    for jerk, ok in ((33_750.0, True), (33_700.0, False)):
        result = judged(problem, profile, max_jerk=np.full(2, jerk), with_setpoints=False)
        check = result.check("acceleration_jump", "Y")
        assert (check.worst, check.limit) == pytest.approx((45.0, jerk * 1e-3 / 0.75), rel=1e-9)
        assert broken(result) == (set() if ok else {"acceleration_jump"})


def test_what_is_not_claimed_is_not_measured() -> None:
    problem, profile = line()
    stream = Setpoints(problem, profile, 0.001)
    tight = replace(problem, max_jerk=problem.max_jerk / 2)
    result = audit(tight, profile, machine_of(tight), None, stream)
    assert result.ok
    assert not result.check("jerk", "X").judged
    assert not {"acceleration_jump", "acceleration_continuity"} & {check.name for check in result.checks}


def test_velocity_feed_acceleration_and_chord_are_measured_on_these_arcs() -> None:
    problem, profile, _ = circle_case()
    free = judged(problem, profile, with_setpoints=False)
    speed = free.check("feed").worst
    for change, name in (
        ({"max_velocity": np.full(2, 0.99 * free.check("velocity", "X").worst)}, "velocity"),
        ({"max_acceleration": np.full(2, 0.99 * free.check("acceleration", "X").worst)}, "acceleration"),
        ({"feed": np.full(len(problem.path), 0.99 * speed)}, "feed"),
        ({"chord_tolerance": 0.98 * (speed * 0.001) ** 2 / 80.0}, "chord"),
    ):
        assert broken(judged(problem, profile, with_setpoints=False, **change)) == {name}


JOINTS = {
    "cylindrical": ("cylindrical", "XYZ", past_the_column, None),
    "trunnion": ("trunnion-ac", "XYZAC", wavy, CoordinateMode.TIP),
}


@pytest.fixture(scope="module", params=list(JOINTS))
def joints(request: pytest.FixtureRequest) -> tuple[Problem, SpeedProfile, Machine]:
    name, letters, curve, coordinate_mode = JOINTS[request.param]
    machine = wide(name)
    free = tuple(
        replace(axis, max_velocity=FREE, max_acceleration=FREE, max_jerk=FREE**2) for axis in machine.axes
    )
    machine = replace(machine, axes=free, chord_tolerance=math.inf)
    means = None if coordinate_mode is None else np.array([coordinate_mode], np.uint8)
    problem = build_problem(path_along(curve(), letters, coordinate_mode=means), machine, feed=FREE)
    way = problem.way_curve
    assert way is not None
    profile = constant_jerk(way, rest_to_rest(CurveLength(way).total, 2000.0, 0.8))
    return problem, profile, machine


def test_the_jerk_of_joints_is_that_of_their_setpoints(joints: Any) -> None:
    problem, profile, machine = joints
    stream = Setpoints(problem, profile, machine.period)
    dense = Setpoints(problem, profile, 1e-4).all()
    most = np.abs(dense.jerk[1:-1]).max(axis=0)
    result = audit(problem, profile, machine, None, stream, jerk=True)
    assert result.failures == ()
    for k, name in enumerate(problem.axes):
        # Setpoints at the machine's period miss the peaks by up to a thousandth.
        assert result.check("jerk", name).worst == pytest.approx(most[k], rel=1e-2, abs=1e-3)
    assert audit(replace(problem, max_jerk=1.001 * most + 1.0), profile, machine, None, None, jerk=True).ok
    k = int(np.argmax(most))
    tight = 1.001 * most + 1.0
    tight[k] *= 0.98
    result = audit(replace(problem, max_jerk=tight), profile, machine, None, None, jerk=True)
    assert {(check.name, check.axis) for check in result.broken} == {("jerk", problem.axes[k])}


def test_every_way_of_breaking_an_arc_of_joints_is_named(joints: Any) -> None:
    problem, profile, machine = joints
    problem = replace(problem, max_jerk=np.full(len(problem.axes), 1e7))

    def found(other: SpeedProfile) -> set[str]:
        return broken(audit(problem, other, machine, None, None, jerk=True))

    assert found(profile) == set()
    assert found(changed(profile, 1, duration=1e-4 * profile.duration[1])) >= {"duration"}
    assert found(changed(profile, 1, a1=100.0)) >= {"acceleration_continuity"}
    assert found(changed(profile, 1, p1=1e-2 * profile.p1[1])) >= {"jump"}
    assert found(changed(profile, 0, a0=math.nan)) == {"numbers"}
    kinds = replace(profile, kind=np.full(len(profile), 1, np.uint8), a0=0 * profile.a0, a1=0 * profile.a1)
    assert "jerk" in found(kinds)

"""Setpoints on pieces of any degree and on joints: closed forms, quadratics, and numerical integration."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.curves.speed_polynomial import SpeedPolynomial
from feedplan.errors import InputError
from feedplan.planners.bang_bang import plan
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.setpoints import INTERPOLATORS, SetpointChunk, Setpoints
from tests.along import path_along, problem_along, profile_of
from tests.turns import circle

Array = NDArray[np.float64]
INTERPOLATOR = pytest.mark.parametrize("interpolator", INTERPOLATORS)
BUTTERFLY = FilePath(__file__).parents[1] / "benchmarks" / "curves" / "butterfly.json"
RATES = ("position", "velocity", "acceleration", "jerk")


def random_problem(seed: int, degree: int | None = None, rational: bool = True) -> Problem:
    """A random NURBS curve, every fourth one nearly with a cusp, with random limits of all kinds."""
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(2, 7)) if degree is None else degree
    axes, spans = int(rng.integers(2, 5)), int(rng.integers(1, 9))
    points = np.cumsum(rng.normal(size=(spans + degree, axes)), axis=0)
    if seed % 4 == 0:
        points[1 + spans // 2] = points[spans // 2] + 1e-3 * rng.normal(size=axes)
    inner = np.cumsum(rng.uniform(0.3, 3.0, spans))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree, inner[-1])])
    weights = np.exp(rng.uniform(np.log(0.2), np.log(5.0), len(points))) if rational else None
    curve = CompositeCurve.from_nurbs(points, knots, degree, weights)
    return replace(
        problem_along(path_along(curve), np.exp(rng.uniform(0.0, 3.0, axes))),
        max_acceleration=np.exp(rng.uniform(0.0, 5.0, axes)),
        feed=np.full(len(curve), np.exp(rng.uniform(0.0, 3.0))),
        chord_tolerance=1e-3 if seed % 2 and degree > 2 else np.inf,
        period=0.05,
    )


def feed_profile(curve: CompositeCurve, feed: float) -> SpeedProfile:
    """A profile with one arc per piece, all at one speed."""
    count = np.arange(len(curve))
    starts = np.append(CurveLength(curve).length(count, np.zeros(len(curve))), CurveLength(curve).total)
    speed = [np.linalg.norm(curve.evaluate(count, u, 1)[1], axis=1) for u in (0 * curve.width, curve.width)]
    with np.errstate(divide="ignore"):
        p0, p1 = ((feed / at) ** 2 for at in speed)
    rows = zip(count, curve.width, p0, p1, np.diff(starts) / feed, strict=True)
    return profile_of(*((int(i), PhaseLaw.FEED, 255, feed**2, 0.0, w, a, b, t) for i, w, a, b, t in rows))


def _out_and_ahead(angle: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Radial and tangential unit vectors on a circle."""
    x, y = np.cos(angle), np.sin(angle)
    return (x, y), (-y, x)


@INTERPOLATOR
@pytest.mark.parametrize("period", [0.0001, 0.003, 0.01])
def test_a_circle_at_constant_feed_turns_evenly(interpolator: str, period: float) -> None:
    radius, feed = 10.0, 80.0
    curve = circle([0.0, 0.0], radius)
    stream = Setpoints(problem_along(path_along(curve)), feed_profile(curve, feed), period, interpolator)
    chunk = stream.all()
    angle, step = feed * chunk.t / radius, feed * period
    out, ahead = (np.stack([x, y], axis=1) for x, y in _out_and_ahead(angle))
    assert np.abs(chunk.position - radius * out).max() <= 1e-6 * step
    for values, expected in (
        (chunk.velocity, feed * ahead),
        (chunk.acceleration, -(feed**2) / radius * out),
        (chunk.jerk, -(feed**3) / radius**2 * ahead),
    ):
        np.testing.assert_allclose(values, expected, atol=1e-9 * np.abs(expected).max())
    assert 0 < stream.stats.length_error < 1e-6
    assert stream.duration == pytest.approx(2 * math.pi * radius / feed, rel=1e-13)


@INTERPOLATOR
@pytest.mark.parametrize("speed", [0.5, 9.0])
def test_a_line_whose_parameter_speeds_up_is_the_school_formula(interpolator: str, speed: float) -> None:
    # Symmetric, with x'(0) = x'(1) = 3 speed; 30 mm from rest to rest at 1000 mm/s².
    curve = CompositeCurve.from_bezier([[0.0, 1.0], [speed, 1.0], [30 - speed, 1.0], [30.0, 1.0]])
    half = math.sqrt(30 / 1000)
    peak = float((1000 * half / curve.evaluate(0, 0.5, 1)[1, 0, 0]) ** 2)
    up = (0, PhaseLaw.AXIS_ACCELERATION, 0, 1000.0, 0.0, 0.5, 0.0, peak, half)
    down = (0, PhaseLaw.AXIS_ACCELERATION, 0, -1000.0, 0.5, 1.0, peak, 0.0, half)
    chunk = Setpoints(problem_along(path_along(curve)), profile_of(up, down), 0.001, interpolator).all()
    t = np.minimum(chunk.t, 2 * half)
    first, second = np.minimum(t, half), np.maximum(2 * half - t, 0.0)
    x = np.where(t <= half, 500 * first**2, 30 - 500 * second**2)
    np.testing.assert_allclose(chunk.position[:, 0], x, atol=1e-11)
    np.testing.assert_allclose(chunk.velocity[:, 0], 1000 * np.minimum(t, second), atol=1e-8)
    assert (chunk.position[:, 1] == 1.0).all()
    assert (chunk.velocity[:, 1] == 0.0).all()
    assert (chunk.jerk == 0.0).all()


@INTERPOLATOR
@pytest.mark.parametrize("rational", [True, False])
def test_an_axis_that_turns_round_keeps_its_acceleration(interpolator: str, rational: bool) -> None:
    # x = r − a t²/2 from the point (r, 0) of a circle; or a parabola x = −u²/2, y = u (1 + u/4) as a quintic.
    a = 500.0
    if rational:
        r = 10.0
        curve = CompositeCurve.from_bezier([[r, 0], [r, r], [0, r]], [1, math.sqrt(0.5), 1])
        pace = math.sqrt(a * r) / float(curve.evaluate(0, 0.0, 1)[1, 0, 1])
        duration = math.sqrt(2 * r / a)
    else:
        r = 0.0
        curve = CompositeCurve.from_bezier([[0, 0], [0, 1], [-2, 3]], width=2.0).elevated(5)
        pace, duration = math.sqrt(a), 2 / math.sqrt(a)
    end = float((a * duration / curve.evaluate(0, curve.width, 1)[1, 0, 0]) ** 2)
    arc = (0, PhaseLaw.AXIS_ACCELERATION, 0, -a, 0.0, float(curve.width[0]), pace**2, end, duration)
    chunk = Setpoints(problem_along(path_along(curve)), profile_of(arc), 1e-4, interpolator).all()
    t = chunk.t
    np.testing.assert_allclose(chunk.position[:, 0], r - 0.5 * a * t**2, atol=1e-11)
    np.testing.assert_allclose(chunk.velocity[:, 0], -a * t, atol=1e-8)
    if rational:
        # y² = r a t² − a² t⁴/4.
        b, w = math.sqrt(a * r), np.sqrt(1 - a * t**2 / (4 * r))
        y = b * t * w
        speed = b * (w - a * t**2 / (4 * r) / w)
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = (r * a - 1.5 * (a * t) ** 2 - speed**2) / y
        bend = np.where(t > 0, bend, 0.0)
        assert chunk.jerk[0, 1] == pytest.approx(-0.75 * b * a / r, rel=1e-4)
    else:
        u = math.sqrt(a) * t
        y, speed, bend = u * (1 + u / 4), math.sqrt(a) * (1 + u / 2), np.full(len(t), a / 2)
        assert np.abs(chunk.jerk).max() <= 1e-4 * a**1.5
    np.testing.assert_allclose(chunk.position[:, 1], y, atol=1e-10)
    np.testing.assert_allclose(chunk.velocity[:, 1], speed, atol=1e-8 * math.sqrt(a))
    np.testing.assert_allclose(chunk.acceleration[:, 1], bend, atol=1e-6 * a)


@INTERPOLATOR
@pytest.mark.parametrize("seed", range(8))
def test_a_higher_degree_changes_no_setpoint(interpolator: str, seed: int) -> None:
    problem = random_problem(seed, degree=2, rational=False)
    profile = plan(problem)
    period = profile.time / 397.3
    plain = Setpoints(problem, profile, period, interpolator).all()
    for degree in range(3, 10):
        raised = replace(problem, path=replace(problem.path, curve=problem.curve.elevated(degree)))
        chunk = Setpoints(raised, profile, period, interpolator).all()
        np.testing.assert_array_equal(chunk.piece, plain.piece)
        for name in ("u", "position"):
            np.testing.assert_allclose(getattr(chunk, name), getattr(plain, name), atol=1e-9, err_msg=name)
        for name in RATES[1:]:
            found, expected = getattr(chunk, name), getattr(plain, name)
            np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max(), err_msg=name)


def arcs_of(chunk: SetpointChunk, profile: SpeedProfile) -> NDArray[np.int64]:
    """The arc on which each setpoint is; −1 at the stops."""
    ends = np.cumsum(profile.duration)
    arc = np.searchsorted(ends, chunk.t, side="right")
    arc[0] = -1
    arc[arc == len(ends)] = -1
    return arc


@INTERPOLATOR
@given(seed=st.integers(0, 2**32 - 1), rational=st.booleans())
def test_planned_curves_are_sampled_within_their_limits(interpolator: str, seed: int, rational: bool) -> None:
    problem = random_problem(seed, rational=rational)
    profile = plan(problem)
    period = profile.time / 397.3
    stream = Setpoints(problem, profile, period, interpolator)
    chunk = stream.all()
    assert all(np.isfinite(getattr(chunk, name)).all() for name in RATES)
    assert (np.abs(chunk.velocity) <= problem.max_velocity * (1 + 1e-8)).all()
    assert (np.abs(chunk.acceleration) <= problem.max_acceleration * (1 + 1e-8)).all()
    assert np.linalg.norm(chunk.velocity, axis=1).max() <= problem.feed[0] * (1 + 1e-8)
    assert stream.stats.length_error < 1e-6
    # Every setpoint is on the curve, in order, and the last one is its end.
    curve = problem.curve
    np.testing.assert_allclose(
        chunk.position, curve.evaluate(chunk.piece, chunk.u)[0], atol=1e-12 * np.abs(chunk.position).max()
    )
    assert (np.diff(chunk.piece + chunk.u / curve.width[chunk.piece]) >= 0).all()
    assert chunk.position[-1].tolist() == curve.control_points[-1].tolist()
    # Hermite quadrature from both ends of a step (fourth order), on arcs of at least five periods.
    arc = arcs_of(chunk, profile)
    same = (arc[:-1] == arc[1:]) & (arc[1:] >= 0) & (profile.duration[arc[1:]] > 5 * period)
    h = np.diff(chunk.t)[:, None]
    for low, middle, high in zip(RATES, RATES[1:], RATES[2:], strict=False):
        x, v, a = (getattr(chunk, name) for name in (low, middle, high))
        off = np.diff(x, axis=0) - h / 2 * (v[1:] + v[:-1]) + h**2 / 12 * np.diff(a, axis=0)
        # Near a cusp all higher derivatives grow, so the median over the steps is tested.
        scale = np.abs(np.diff(x, axis=0)).max(axis=1) + h[:, 0] * np.abs(v).max() * 1e-3
        if same.any():
            assert np.median(np.abs(off).max(axis=1)[same] / scale[same]) <= 2e-6, low


def test_an_axis_that_has_all_but_turned_round_is_not_taken_for_one_at_rest() -> None:
    # x = r − a (t + t0)²/2 on a circle: within t0 of its turn x hardly moves, but y does.
    r, a = 10.0, 500.0
    curve = CompositeCurve.from_bezier([[r, 0], [r, r], [0, r]], [1, math.sqrt(0.5), 1])
    time, t0 = math.sqrt(2 * r / a), 2e-8
    slope = float(curve.evaluate(0, 0.0, 1)[1, 0, 1])
    pace = math.sqrt(a * r) / slope
    end = float((a * time / curve.evaluate(0, curve.width, 1)[1, 0, 0]) ** 2)
    arc = (0, PhaseLaw.AXIS_ACCELERATION, 0, -a, pace * t0, float(curve.width[0]), pace**2, end, time - t0)
    chunk = Setpoints(problem_along(path_along(curve)), profile_of(arc), 1e-3, "sarfraz").all()
    x = r - a * (chunk.t + t0) ** 2 / 2
    expected = np.sqrt((r - x) * (r + x))
    np.testing.assert_allclose(chunk.position[1:-1, 1], expected[1:-1], atol=1e-9)


@INTERPOLATOR
@pytest.mark.parametrize("degree", [3, 6, 9])
def test_a_curved_cusp_is_reached_and_left_at_rest(interpolator: str, degree: int) -> None:
    # (s², s³) with s = u − 1; x slows down to rest at s = 0 and speeds up again: x = a τ²/2, τ from there.
    curve = CompositeCurve.from_bezier([[1.0, -1], [-1 / 3, 1], [-1 / 3, -1], [1, 1]], width=2.0)
    a = 80.0
    time, pace = math.sqrt(2 / a), a / 2
    profile = profile_of(
        (0, PhaseLaw.AXIS_ACCELERATION, 0, a, 0.0, 1.0, pace, pace, time),
        (0, PhaseLaw.AXIS_ACCELERATION, 0, a, 1.0, 2.0, pace, pace, time),
    )
    problem = problem_along(path_along(curve.elevated(degree)))
    # The cusp is between setpoints, next to one, or on one.
    for period in (time / 100.5, time / (100 + 1e-7), time / 100):
        chunk = Setpoints(problem, profile, period, interpolator).all()
        moving = slice(0, int(np.searchsorted(chunk.t, 2 * time)))
        tau, b = chunk.t[moving] - time, (a / 2) ** 1.5
        expected = (
            [a * tau**2 / 2, b * tau**3],
            [a * tau, 3 * b * tau**2],
            [a + 0 * tau, 6 * b * tau],
            [0 * tau, 6 * b + 0 * tau],
        )
        for name, values, size in zip(RATES, expected, (1, a * time, a, b), strict=True):
            found = getattr(chunk, name)[moving]
            # Next to a standstill the length of a step determines the time badly.
            tolerance = {"jerk": 1e-3}.get(name, 1e-7 if interpolator == "sarfraz" else 1e-5) * size
            np.testing.assert_allclose(found, np.stack(values, axis=1), atol=tolerance, err_msg=name)


@given(seed=st.integers(0, 2**32 - 1))
def test_time_and_place_agree_with_integration(seed: int) -> None:
    problem = random_problem(seed)
    profile, curve = plan(problem), problem.curve
    chunk = Setpoints(problem, profile, profile.time / 97.3).all()
    arc = arcs_of(chunk, profile)
    starts = np.cumsum(profile.duration) - profile.duration

    for row in np.flatnonzero(arc >= 0)[:: max(1, len(chunk) // 12)]:
        i = int(arc[row])
        piece, kind, value = int(profile.piece[i]), profile.kind[i], float(profile.value[i])
        u0, u1, p0, p1 = (float(x[i]) for x in (profile.u0, profile.u1, profile.p0, profile.p1))
        axis = int(profile.axis[i])

        def tangent(u: float, piece: int = piece) -> Array:
            return np.asarray(curve.evaluate(piece, u, 1)[1, 0])

        if kind in (PhaseLaw.AXIS_ACCELERATION, PhaseLaw.AXIS_VELOCITY):
            # The position of the axis is a quadratic of time.
            t, rest = chunk.t[row] - starts[i], starts[i] + profile.duration[i] - chunk.t[row]
            a = value if kind == PhaseLaw.AXIS_ACCELERATION else 0.0
            ends = curve.evaluate([piece, piece], [u0, u1])[0][:, axis]
            v0 = (ends[1] - ends[0]) / profile.duration[i] - a * profile.duration[i] / 2
            v1 = v0 + a * profile.duration[i]
            at = chunk.position[row, axis]
            assert at - ends[0] == pytest.approx(v0 * t + a * t * t / 2, abs=2e-9)
            assert ends[1] - at == pytest.approx(v1 * rest - a * rest * rest / 2, abs=2e-9)
            continue
        ends = [(tangent(u) ** 2).sum() * p for u, p in ((u0, p0), (u1, p1))]
        if not np.isfinite(ends).all():
            continue

        def rate(
            u: float,
            flat: bool = kind == PhaseLaw.PARAMETER_ACCELERATION,
            p0: float = p0,
            ends: Any = ends,
            span: Any = (u0, u1),
        ) -> float:
            """1/√p."""
            speed_sq = np.interp(u, span, ends)
            return 1 / math.sqrt(p0) if flat else math.sqrt((tangent(u) ** 2).sum() / speed_sq)

        passed = quad(rate, u0, chunk.u[row], epsabs=1e-12, limit=200)[0]
        assert passed == pytest.approx(chunk.t[row] - starts[i], abs=1e-9 * profile.time)


@INTERPOLATOR
def test_the_butterfly_is_followed_to_its_end(interpolator: str) -> None:
    data = json.loads(BUTTERFLY.read_text(encoding="utf-8"))
    curve = CompositeCurve.from_nurbs(data["control_points"], data["knots"], data["degree"], data["weights"])
    problem = problem_along(path_along(curve), 250.0)
    problem = replace(problem, max_acceleration=np.full(2, 3000.0), feed=np.full(len(curve), 200.0))
    profile = plan(problem)
    for period in (1e-4, 1e-3, 1e-2):
        chunk = Setpoints(problem, profile, period, interpolator).all()
        assert np.abs(np.diff(chunk.position, 2, axis=0)).max() <= 3000 * period**2 * (1 + 1e-5)
        assert np.abs(np.diff(chunk.position, axis=0)).max() <= 200 * period * (1 + 1e-9)
        assert chunk.position[-1].tolist() == curve.control_points[-1].tolist()
        assert abs(chunk.t[-1] - profile.time) <= period


def joints_case(kind: PhaseLaw) -> tuple[Problem, SpeedProfile]:
    """The tip on x = u, y = u² at a constant speed, or with v² that grows linearly in u from 25 to 400
    mm²/s²; three joints of degree 9 move it."""
    tip = CompositeCurve.from_bezier([[0, 0], [1, 0], [2, 4]], width=2.0)
    rng = np.random.default_rng(5)
    joints = CompositeCurve.from_bezier(np.cumsum(rng.normal(size=(10, 3)), axis=0), width=2.0)
    # The squared tip speed per parameter is 1 + 4 u² on [0, 2].
    problem = replace(
        problem_along(path_along(tip)),
        joint_axes=("X", "Y", "B"),
        joints=joints,
        tip_speed=SpeedPolynomial(np.array([1.0, 1.0, 17.0]), np.array([0, 3])),
    )
    speed_sq = (400.0, 400.0) if kind == PhaseLaw.FEED else (25.0, 400.0)
    duration = tip_time(speed_sq, 2.0)
    value = 400.0 if kind == PhaseLaw.FEED else 0.0
    return problem, profile_of((0, kind, 255, value, 0.0, 2.0, speed_sq[0], speed_sq[1] / 17, duration))


def tip_time(speed_sq: tuple[float, float], u: float) -> float:
    low, high = speed_sq
    rate = lambda x: math.sqrt((1 + 4 * x * x) / (low + (high - low) * x / 2))  # noqa: E731
    return float(quad(rate, 0, u, epsabs=1e-14)[0])


@INTERPOLATOR
@pytest.mark.parametrize("kind", [PhaseLaw.FEED, PhaseLaw.SPEED_LINE])
def test_joints_follow_the_speed_of_the_tip(interpolator: str, kind: PhaseLaw) -> None:
    problem, profile = joints_case(kind)
    stream = Setpoints(problem, profile, 0.0005, interpolator)
    chunk = stream.all()
    assert stream.axes == chunk.axes == ("X", "Y", "B")
    assert problem.joints is not None
    speed_sq = (400.0, 400.0) if kind == PhaseLaw.FEED else (25.0, 400.0)
    for t, u in zip(chunk.t[::37], chunk.u[::37], strict=True):
        assert tip_time(speed_sq, float(u)) == pytest.approx(t, abs=1e-10)
    on = problem.joints.evaluate(0, chunk.u, 1)
    np.testing.assert_allclose(chunk.position, on[0], atol=1e-13)
    # The tip's velocity is (1, 2u) u̇ with the u̇ of the joints.
    pace = (chunk.velocity * on[1]).sum(axis=1) / (on[1] ** 2).sum(axis=1)
    wanted = speed_sq[0] + (speed_sq[1] - speed_sq[0]) * chunk.u / 2
    np.testing.assert_allclose(pace**2 * (1 + 4 * chunk.u**2), wanted, rtol=1e-10)
    h = 0.0005
    for low, high in pairwise(RATES):
        x, v = getattr(chunk, low), getattr(chunk, high)
        slope = (x[2:-1] - x[:-3]) / (2 * h)
        assert np.abs(slope - v[1:-2]).max() <= 1e-3 * np.abs(v).max(), low


def test_quadratic_and_higher_pieces_stand_in_one_path() -> None:
    quadratic = CompositeCurve.from_bezier([[0, 0], [1, 0], [2, 1]])
    cubic = CompositeCurve.from_bezier([[2.0, 1.0], [3.0, 2.0], [5.0, 2.0], [6.0, 1.0]])
    arc = CompositeCurve.from_bezier([[6, 1], [8, -1], [9, 2]], [1, 0.7, 1])
    curve = CompositeCurve.joined([quadratic, cubic, arc])
    length = CurveLength(curve)
    problem, profile = problem_along(path_along(curve)), feed_profile(curve, 30.0)
    for interpolator in INTERPOLATORS:
        chunk = Setpoints(problem, profile, 0.0011, interpolator).all()
        np.testing.assert_allclose(length.length(chunk.piece, chunk.u), 30 * chunk.t, atol=1e-9)
        assert np.unique(chunk.piece).tolist() == [0, 1, 2]


def test_what_general_pieces_cannot_do_is_refused_with_a_sentence() -> None:
    curve = CompositeCurve.from_bezier([[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [4.0, 0.0]])
    problem, profile = problem_along(path_along(curve)), feed_profile(curve, 10.0)
    for change, words in (
        (
            {"kind": np.array([1], np.uint8), "p0": np.array([np.inf])},
            "a speed that is negative or not finite",
        ),
        ({"kind": np.array([7], np.uint8)}, "unknown kind 7"),
    ):
        with pytest.raises((InputError, ValueError), match=words):
            Setpoints(problem, replace(profile, **change), 0.001)  # type: ignore[arg-type]
    for coefficients, offsets in (([1.0], [0, 2]), ([1.0, np.nan], [0, 2]), ([1.0], [0, 1, 1])):
        tip = SpeedPolynomial(np.array(coefficients), np.array(offsets))
        with pytest.raises(InputError, match="the tip speed does not fit the 1 pieces"):
            Setpoints(replace(problem, tip_speed=tip), profile, 0.001)

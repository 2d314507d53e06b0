"""Setpoints of profiles of limited jerk: closed forms on lines and circles, differences on random curves."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.curves.speed_polynomial import SpeedPolynomial
from feedplan.errors import InputError
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.setpoints import INTERPOLATORS, SetpointChunk, Setpoints
from tests.along import path_along, problem_along
from tests.jerk_arcs import constant_jerk, cubic_speed, rest_to_rest
from tests.turns import circle

Array = NDArray[np.float64]
INTERPOLATOR = pytest.mark.parametrize("interpolator", INTERPOLATORS)
RATES = ("position", "velocity", "acceleration", "jerk")
SEEDS = range(6)


def motion_at(sections: list[tuple[float, float]], t: Array) -> Array:
    """Distance, speed, acceleration and jerk (4, n) at times t, for sections that begin at rest."""
    state = np.zeros((4, len(t)))
    begin, at = 0.0, np.zeros(3)
    for duration, jerk in sections:
        x = np.minimum(t - begin, duration)
        s, v, a = at
        inside = t >= begin
        state[:, inside] = np.stack(
            [
                s + x * (v + x * (a / 2 + x * jerk / 6)),
                v + x * (a + x * jerk / 2),
                a + x * jerk,
                jerk + 0 * x,
            ]
        )[:, inside]
        x = duration
        at = np.array([s + x * (v + x * (a / 2 + x * jerk / 6)), v + x * (a + x * jerk / 2), a + x * jerk])
        begin += duration
    return state


@INTERPOLATOR
@pytest.mark.parametrize("degree", [1, 2, 4])
def test_a_hundred_millimetres_from_rest_to_rest_are_four_cubics(interpolator: str, degree: int) -> None:
    # 3200 mm/s³ up, down, down and up for 0.25 s each: 2 · 3200 · 0.25³ = 100 mm, in the direction (3, 4).
    points = np.linspace(0.0, 100.0, degree + 1)[:, None] * [0.6, 0.8]
    curve = CompositeCurve.from_bezier(points, width=7.0)
    sections = rest_to_rest(100.0, 3200.0)
    assert [time for time, _ in sections] == pytest.approx([0.25, 0.25, 0.0, 0.25, 0.25], abs=1e-15)
    profile = constant_jerk(curve, sections)
    stream = Setpoints(problem_along(path_along(curve)), profile, 0.001, interpolator)
    chunk = stream.all()
    assert stream.count == 1001
    expected = motion_at(sections, chunk.t)
    first = chunk.position[1, 0] / 0.6
    assert first == pytest.approx(3200.0 * 0.001**3 / 6, rel=1e-6)
    # At a switching point rounding may select the jerk of either arc.
    inside = ~switching(profile, chunk.t, 1e-9)
    for name, values, scale in zip(RATES, expected, (100.0, 200.0, 800.0, 3200.0), strict=True):
        away = np.abs(getattr(chunk, name) - values[:, None] * [0.6, 0.8])
        # Next to rest, a time that is found from a position has only a third of the digits.
        share = 1e-12 if interpolator == "sarfraz" else 1e-10
        assert away[inside if name == "jerk" else slice(None)].max() <= share * scale, name
    assert chunk.position[-1].tolist() == curve.control_points[-1].tolist()
    assert stream.stats.length_error < 1e-6


def switching(profile: SpeedProfile, t: Array, within: float) -> NDArray[np.bool_]:
    """Whether an arc begins or ends within the time `within` of each t (n,)."""
    ends = np.append(0.0, np.cumsum(profile.duration))
    return np.asarray(np.abs(t[:, None] - ends).min(axis=1) <= within)


@INTERPOLATOR
def test_a_circle_at_constant_tangential_jerk_is_exact(interpolator: str) -> None:
    radius = 10.0
    curve = circle([0.0, 0.0], radius)
    sections = rest_to_rest(CurveLength(curve).total, 2000.0, 0.7)
    profile = constant_jerk(curve, sections)
    assert set(profile.kind) == {PhaseLaw.PATH_JERK}
    assert len(profile) > len(curve)
    chunk = Setpoints(problem_along(path_along(curve)), profile, 0.0007, interpolator).all()
    keep = ~switching(profile, chunk.t, 1e-9)
    keep[[0, -1]] = False
    t = chunk.t[keep]
    s, v, a, j = motion_at(sections, t)[:, :, None]
    angle = s[:, 0] / radius
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ahead = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    for name, expected in (
        ("position", radius * out),
        ("velocity", v * ahead),
        ("acceleration", a * ahead - v**2 / radius * out),
        ("jerk", (j - v**3 / radius**2) * ahead - 3 * v * a / radius * out),
    ):
        away = np.abs(getattr(chunk, name)[keep] - expected).max()
        assert away <= 1e-10 * np.abs(expected).max(), name


def random_curve(seed: int) -> CompositeCurve:
    """A cubic B-spline or a rational one of degree 4 in two to six axes, far from any cusp."""
    rng = np.random.default_rng(seed)
    axes, spans = 2 + seed % 5, 4
    degree = 3 if seed % 2 else 4
    points = 12.0 * np.arange(spans + degree)[:, None] * rng.uniform(0.4, 1.0, axes)
    points += rng.normal(scale=4.0, size=points.shape)
    inner = np.cumsum(rng.uniform(0.6, 1.6, spans))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree, inner[-1])])
    weights = rng.uniform(0.5, 2.0, len(points)) if degree == 4 else None
    return CompositeCurve.from_nurbs(points, knots, degree, weights)


def profiles(curve: CompositeCurve, seed: int) -> list[SpeedProfile]:
    """One profile of each law of limited jerk along the curve."""
    length = CurveLength(curve).total
    wave = 2 * np.pi * (1 + seed % 3) / length
    cubic = cubic_speed(
        curve,
        lambda s: 900.0 * (1.5 + np.sin(wave * s + seed)),
        lambda s: 900.0 * wave * np.cos(wave * s + seed),
        5,
    )
    return [constant_jerk(curve, rest_to_rest(length, 3000.0, 0.8)), cubic]


def differences_agree(chunk: SetpointChunk, profile: SpeedProfile, period: float) -> None:
    """Asserts that each rate is the central difference of the lower one, and jerk the third of positions."""
    inside = ~switching(profile, chunk.t, 3.01 * period)
    inside[:3] = inside[-4:] = False
    at = np.flatnonzero(inside)
    assert len(at) > 20
    for low, high in pairwise(RATES):
        x, rate = getattr(chunk, low), getattr(chunk, high)
        slope = (x[at - 2] - 8 * x[at - 1] + 8 * x[at + 1] - x[at + 2]) / (12 * period)
        assert np.abs(slope - rate[at]).max() <= 5e-6 * np.abs(rate).max(), high
    ways = [chunk.position[at + n] - chunk.position[at - n] for n in (1, 2, 3)]
    third = (-13 * ways[0] + 8 * ways[1] - ways[2]) / (8 * period**3)
    assert np.abs(third - chunk.jerk[at]).max() <= 5e-6 * np.abs(chunk.jerk).max()


@INTERPOLATOR
@pytest.mark.parametrize("seed", SEEDS)
def test_rates_on_random_curves_are_the_differences_of_the_positions(interpolator: str, seed: int) -> None:
    curve = random_curve(seed)
    length = CurveLength(curve)
    for profile in profiles(curve, seed):
        period = 0.0005
        stream = Setpoints(problem_along(path_along(curve)), profile, period, interpolator)
        chunk = stream.all()
        differences_agree(chunk, profile, period)
        # Newton's error is relative to each step; the first step from rest is shorter than 1e-7 mm.
        assert stream.stats.length_error < (1e-6 if interpolator == "sarfraz" else 1e-5)
        assert stream.stats.iterations <= 30
        if (profile.kind == PhaseLaw.PATH_JERK).all():
            s = motion_at(rest_to_rest(length.total, 3000.0, 0.8), chunk.t)[0]
            np.testing.assert_allclose(length.length(chunk.piece, chunk.u), s, atol=1e-11)


@INTERPOLATOR
@pytest.mark.parametrize("seed", SEEDS)
def test_joints_follow_the_motion_of_the_tip(interpolator: str, seed: int) -> None:
    # The tip on x = u, y = u²: squared speed per parameter 1 + 4 u² on [0, 2]; joints of degree 3 to 9.
    tip = CompositeCurve.from_bezier([[0, 0], [1, 0], [2, 4]], width=2.0)
    rng = np.random.default_rng(seed)
    joints = CompositeCurve.from_bezier(
        np.cumsum(rng.normal(size=(4 + seed, 2 + seed % 5)), axis=0), width=2.0
    )
    problem = replace(
        problem_along(path_along(tip)),
        joint_axes=tuple("XYZABC"[: joints.axes]),
        joints=joints,
        tip_speed=SpeedPolynomial(np.array([1.0, 1.0, 17.0]), np.array([0, 3])),
    )
    length = CurveLength(tip)
    jerk = constant_jerk(tip, sections := rest_to_rest(length.total, 3000.0))
    cubic = cubic_speed(tip, lambda s: 25.0 + 60.0 * s, lambda s: 60.0, 3)
    for profile in (jerk, cubic):
        chunk = Setpoints(problem, profile, 0.0005, interpolator).all()
        np.testing.assert_allclose(chunk.position, joints.evaluate(0, chunk.u, 0)[0], atol=1e-12)
        differences_agree(chunk, profile, 0.0005)
        s = length.length(chunk.piece, chunk.u)
        if profile is jerk:
            np.testing.assert_allclose(s, motion_at(sections, chunk.t)[0], atol=1e-12)
        else:
            # From 5 mm/s with v² growing by 60 mm²/s² per mm: v = 5 + 30 t.
            np.testing.assert_allclose(s, 5.0 * chunk.t + 15.0 * chunk.t**2, atol=1e-12)


def test_both_interpolators_agree_in_chunks_of_any_size() -> None:
    curve = random_curve(1)
    problem = problem_along(path_along(curve))
    for profile in profiles(curve, 1):
        sarfraz, newton = (Setpoints(problem, profile, 0.0013, name) for name in INTERPOLATORS)
        whole = sarfraz.all()
        for stream in (sarfraz, newton):
            parts = [chunk.position for chunk in stream.chunks(37)]
            np.testing.assert_allclose(np.concatenate(parts), whole.position, atol=1e-10)


def test_a_profile_that_cannot_be_followed_is_refused_with_a_sentence() -> None:
    curve = CompositeCurve.from_bezier([[0.0, 0.0], [20.0, 10.0], [40.0, 10.0], [60.0, 0.0]])
    problem: Problem = problem_along(path_along(curve))
    jerk = constant_jerk(curve, rest_to_rest(CurveLength(curve).total, 3000.0))
    cubic = cubic_speed(curve, lambda s: 400.0, lambda s: 0.0, 1)
    for profile, change, words in (
        (jerk, {"a0": np.nan}, "an acceleration along the path that is not finite"),
        (cubic, {"a1": np.inf}, "an acceleration along the path that is not finite"),
        (cubic, {"kind": np.uint8(2), "a0": 1.0}, "an acceleration along the path .* not of its kind"),
        (jerk, {"value": np.inf}, "a speed that is negative or not finite"),
        (cubic, {"p1": np.inf}, "a speed that is negative or not finite"),
        (cubic, {"p0": 0.0}, "loses all its speed on the way"),
        (cubic, {"a0": -60.0}, "loses all its speed on the way"),
        (jerk, {"a0": -1.0}, "moves backwards"),
        (jerk, {"duration": 0.0}, "moves at constant jerk for no time"),
    ):
        columns = {name: getattr(profile, name).copy() for name in change}
        for name, value in change.items():
            columns[name][0] = value
        with pytest.raises(InputError, match=rf"^phase 0 of the profile .*{words}.*: plan this path again$"):
            Setpoints(problem, replace(profile, **columns), 0.001)
    with pytest.raises(InputError, match=f"{len(jerk)} phases, and `a0` has {len(jerk) - 1} entries"):
        replace(jerk, a0=jerk.a0[:-1])

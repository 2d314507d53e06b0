"""Cusps and places near one: known times, and every limit on random curves that are difficult."""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.planners.bang_bang import plan
from feedplan.planning import rounding_stops
from feedplan.profile import PhaseLaw
from feedplan.setpoints import Setpoints
from tests.along import problem_along
from tests.campaign import seeds
from tests.planners.excess import worst_excess, worst_excess_exactly

Array = NDArray[np.float64]


def bernstein(powers: Array) -> Array:
    """Bernstein coefficients on [0, 1] of a polynomial with these power coefficients, lowest power first."""
    n = len(powers) - 1
    return np.array([sum(comb(i, j) / comb(n, j) * powers[j] for j in range(i + 1)) for i in range(n + 1)])


def with_cusp(order: int, place: float, direction: Array, bend: Array | None = None) -> CompositeCurve:
    """The curve with C' = (t − place)^order (direction + bend (t − place))."""
    factor = np.polynomial.Polynomial([-place, 1.0])
    rates = [factor**order * x for x in direction]
    if bend is not None:
        rates = [rate + factor ** (order + 1) * y for rate, y in zip(rates, bend, strict=True)]
    degree = max(len(rate.coef) for rate in rates)
    columns = []
    for rate in rates:
        powers = np.zeros(degree + 1)
        powers[1 : len(rate.coef) + 1] = rate.coef / np.arange(1, len(rate.coef) + 1)
        columns.append(bernstein(powers))
    return CompositeCurve.from_bezier(np.array(columns).T)


def problem_of(curve: CompositeCurve, velocity: Array, acceleration: Array, feed: float) -> Problem:
    """From rest to rest along the path of the curve: straight pieces become lines, cusps end pieces."""
    return problem_along(Path.from_curve(curve, feed=feed), velocity, acceleration)


def time_of(curve: CompositeCurve, acceleration: float | Array = 100.0, feed: float = 1e9) -> float:
    axes = curve.axes
    limit = np.broadcast_to(np.asarray(acceleration, float), axes).copy()
    return plan(problem_of(curve, np.full(axes, 1e9), limit, feed)).time


@pytest.mark.parametrize("place", [0.0, 0.3, 0.5, 0.7123456789, 1.0])
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_a_line_with_a_cusp_is_passed_where_it_goes_on_and_turned_where_it_comes_back(
    order: int, place: float
) -> None:
    # The distances before and after the cusp; X is the slower of the two axes.
    before, after = place ** (order + 1) / (order + 1), (1 - place) ** (order + 1) / (order + 1)
    ways = [before + after] if order % 2 == 0 else [way for way in (before, after) if way > 0]
    time = sum(2 * np.sqrt(3.0 * way / 100.0) for way in ways)
    curve = with_cusp(order, place, np.array([3.0, -1.0]))
    assert time_of(curve) == pytest.approx(time, rel=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_curve_stops_in_its_cusp(order: int) -> None:
    # From rest to rest on both halves: X alone is at its limit, Y needs less.
    curve = with_cusp(order, 0.5, np.array([1.0, 0.0]), np.array([0.0, 0.3]))
    halves = [2 * np.sqrt(0.5 ** (order + 1) / (order + 1) / 100.0)] * 2
    assert time_of(curve, np.array([100.0, 1e4])) == pytest.approx(sum(halves), rel=1e-9)


def random_curve(seed: int) -> tuple[CompositeCurve, Array, Array, float]:
    """A piece with a cusp or nearly one, the limits of its axes, and a feed."""
    rng = np.random.default_rng(seed)
    axes, degree = int(rng.integers(1, 4)), int(rng.integers(2, 10))
    off = 0.0 if rng.random() < 0.3 else 10 ** rng.uniform(-17, -1)
    kind = int(rng.integers(0, 5))
    if kind <= 1:
        order = int(rng.integers(1, min(4, degree)))
        place = 0.5 if rng.random() < 0.3 else rng.uniform()
        factor = np.polynomial.Polynomial([-place, 1.0]) ** order
        rest = np.polynomial.Polynomial(rng.uniform(0.2, 2.0, degree - order))
        powers = np.zeros(degree)
        product = (factor * rest).coef
        powers[: len(product)] = product
        rates = np.outer(bernstein(powers), rng.normal(size=axes))
    elif kind == 2:
        rates = rng.normal(size=(degree, axes))
        rates[rng.integers(0, degree, 2)] = 0.0
    elif kind == 3:
        rates = np.outer(rng.normal(size=degree), rng.normal(size=axes))
    else:
        rates = rng.normal(size=(degree, axes)) * 10 ** rng.uniform(-12, 0, size=(degree, axes))
    rates = rates + off * rng.normal(size=rates.shape)
    if not rates.any():
        rates[0, 0] = 1.0
    points = np.concatenate([np.zeros((1, axes)), np.cumsum(rates, axis=0)]) / degree
    weights = 10 ** rng.uniform(-1, 1, degree + 1) if rng.random() < 0.25 else None
    curve = CompositeCurve.from_bezier(points, weights, width=10 ** rng.uniform(-1, 1))
    velocity, acceleration = 10 ** rng.uniform(0, 2, axes), 10 ** rng.uniform(0, 3, axes)
    return curve, velocity, acceleration, 1e9 if rng.random() < 0.5 else 10 ** rng.uniform(-1, 1)


def test_a_stop_for_rounding_is_told_with_its_line() -> None:
    problem = problem_of(with_cusp(2, 0.5, np.array([3.0, -1.0])), np.ones(2), np.ones(2), 1.0)
    profile = plan(problem)
    assert rounding_stops(problem, profile) == ()
    (sentence,) = rounding_stops(problem, replace(profile, slowed=np.zeros(2, dtype=np.uint32)))
    assert sentence.startswith("rounding hides how the path goes on next to a cusp: the plan stops there")


def test_a_curve_that_all_but_rests_inside_keeps_its_limits_there() -> None:
    # Both tangents fall to 1e-12 of their greatest value without changing their sign.
    problem = problem_of(*random_curve(3705))
    assert worst_excess(problem, plan(problem))[0] <= 1e-8


@pytest.mark.parametrize("seed", [3422, 5957, 10814, 11046])
def test_limits_that_floats_cannot_judge_next_to_a_cusp_are_kept(seed: int) -> None:
    # All tangents fall to 1e-10 of their greatest value or less: most digits of C' and C'' are rounding.
    problem = problem_of(*random_curve(seed))
    assert worst_excess_exactly(problem, plan(problem)) <= 1e-8


@pytest.mark.parametrize("seed", [3452, 4253, 7517, 8833, 11396])
def test_axes_that_turn_within_rounding_of_each_other_have_a_plan(seed: int) -> None:
    problem = problem_of(*random_curve(seed))
    assert worst_excess(problem, plan(problem))[0] <= 1e-8


def test_the_time_at_a_feed_next_to_a_cusp_is_found_in_a_moment() -> None:
    # A line through a cusp: v² is rounding there, and bisection of it gains no digits.
    problem = problem_of(*random_curve(12790))
    profile = plan(problem)
    feed = profile.kind == PhaseLaw.FEED
    start, end = (problem.path.curve.evaluate(profile.piece, u, 0)[0] for u in (profile.u0, profile.u1))
    ways = np.linalg.norm(end - start, axis=1)
    np.testing.assert_allclose(profile.duration[feed], ways[feed] / problem.feed[0], rtol=1e-9)


@pytest.mark.parametrize("seed", [29, 61, 70, 138, 187, 341])
def test_setpoints_through_turns_keep_every_limit(seed: int) -> None:
    problem = problem_of(*random_curve(seed))
    profile = plan(problem)
    chunk = Setpoints(problem, profile, profile.time / 200, "sarfraz").all()
    assert (np.abs(chunk.velocity) <= problem.max_velocity * (1 + 1e-9)).all()
    assert (np.abs(chunk.acceleration) <= problem.max_acceleration * (1 + 1e-6)).all()


@pytest.mark.parametrize("seed", [29, 61, 70, 138, 187, 341])
def test_no_arc_goes_on_where_its_axis_turns_round(seed: int) -> None:
    problem = problem_of(*random_curve(seed))
    profile = plan(problem)
    rows = zip(profile.piece, profile.kind, profile.axis, profile.u0, profile.u1, strict=True)
    for piece, kind, axis, u0, u1 in rows:
        if kind == PhaseLaw.AXIS_ACCELERATION:
            u = u0 + (u1 - u0) * np.linspace(0.01, 0.99, 99)
            rate = problem.path.curve.evaluate(np.full(99, piece), u, 1)[1, :, axis]
            assert (rate > 0).all() or (rate < 0).all()


def test_random_curves_next_to_cusps_keep_every_limit() -> None:
    slowed = 0
    count = seeds(400)
    for seed in range(count):
        problem = problem_of(*random_curve(seed))
        profile = plan(problem)
        assert np.isfinite(profile.time), seed
        excess = worst_excess(problem, profile)[0]
        if excess > 1e-8 and problem.curve.weights is None:
            # Next to a cusp floats are not accurate enough everywhere.
            excess = worst_excess_exactly(problem, profile)
        assert excess <= 1e-8, seed
        slowed += len(profile.slowed) > 0
    assert slowed <= 2 + count / 300

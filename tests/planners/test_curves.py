"""The exact planner on pieces of any degree: published times, changes without effect, limits at many places.

The times of the butterfly and the circle are those of an independent implementation of the same problem on
polynomial proxies of the curves, to 1e-12 s; the switching place of the circle also follows by hand.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.named import butterfly, lemniscate, trefoil
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.path import Path
from feedplan.planners.bang_bang import plan
from tests.along import FREE, path_along, problem_along
from tests.planners.excess import worst_excess
from tests.turns import circle

Array = NDArray[np.float64]


class Planned:
    """A curve with its limits and its exact profile, from rest to rest."""

    def __init__(
        self, curve: CompositeCurve, velocity: float | Array, acceleration: float | Array, feed: float = 1e9
    ) -> None:
        axes = curve.axes
        self.curve, self.feed = curve, feed
        self.velocity = np.broadcast_to(np.asarray(velocity, float), axes).copy()
        self.acceleration = np.broadcast_to(np.asarray(acceleration, float), axes).copy()
        self.problem = problem_along(path_along(curve, feed=feed), self.velocity, self.acceleration)
        self.profile = plan(self.problem)
        self.time = self.profile.time


def random_curve(seed: int, weights: bool = True) -> CompositeCurve:
    rng = np.random.default_rng(seed)
    degree, axes, count = int(rng.integers(2, 6)), int(rng.integers(2, 5)), int(rng.integers(1, 12))
    points = np.cumsum(rng.normal(size=(count + degree, axes)), axis=0)
    if seed % 3 == 0:
        # Nearly a cusp: two successive control points nearly coincide.
        points[1 + count // 2] = points[count // 2] + 1e-3 * rng.normal(size=axes)
    inner = np.cumsum(rng.uniform(0.3, 3.0, count))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree, inner[-1])])
    weight = np.exp(rng.uniform(np.log(0.1), np.log(10.0), len(points))) if weights else None
    return CompositeCurve.from_nurbs(points, knots, degree, weight)


@pytest.mark.parametrize(("feed", "time"), [(1e9, 2.573254566377), (250.0, 2.622026012553)])
def test_the_butterfly_takes_its_published_time(feed: float, time: float) -> None:
    planned = Planned(butterfly(), 250.0, 3000.0, feed)
    assert planned.time == pytest.approx(time, rel=1e-11)
    excess, use = worst_excess(planned.problem, planned.profile)
    assert excess <= 1e-8
    assert use >= 1 - 1e-6


def test_what_leaves_the_curve_alone_leaves_its_time() -> None:
    curve = butterfly()
    time = Planned(curve, 250.0, 3000.0).time
    for other in (
        curve.reversed(),
        curve.elevated(5),
        curve.with_width(np.linspace(0.1, 3.0, len(curve))),
        curve.split([7], [0.5 * curve.width[7]]),
    ):
        assert Planned(other, 250.0, 3000.0).time == pytest.approx(time, rel=1e-10)


def test_a_lap_of_a_circle_from_rest_to_rest() -> None:
    planned = Planned(circle([0.0, 0.0], 10.0), 1e9, 3000.0)
    assert planned.time == pytest.approx(0.412407376368, rel=1e-11)


@pytest.mark.parametrize("weights", [False, True])
def test_random_curves_keep_every_limit_and_use_one_everywhere(weights: bool) -> None:
    for seed in range(150):
        rng = np.random.default_rng(seed + 10_000)
        curve = random_curve(seed, weights)
        planned = Planned(
            curve,
            np.exp(rng.uniform(0.0, 3.0, curve.axes)),
            np.exp(rng.uniform(0.0, 5.0, curve.axes)),
            float(np.exp(rng.uniform(0.0, 3.0))),
        )
        excess, use = worst_excess(planned.problem, planned.profile)
        assert excess <= 1e-8, seed
        assert use >= 1 - 1e-6, seed


@pytest.mark.parametrize(
    ("velocity", "acceleration", "feed", "words"),
    [
        (np.nan, 1.0, 1.0, "the velocity limit of axis 0 is NaN mm/s: give a positive number"),
        (1.0, 0.0, 1.0, "the acceleration limit of axis 0 is 0 mm/s²: give a positive number"),
        (1.0, 1.0, -1.0, "the feed is -1 mm/s: give a positive finite number"),
    ],
)
def test_limits_that_are_no_limits_are_refused(
    velocity: float, acceleration: float, feed: float, words: str
) -> None:
    with pytest.raises(InputError, match=f"{words}$"):
        Planned(random_curve(0), velocity, acceleration, feed)


def test_runs_that_do_not_divide_the_path_are_refused() -> None:
    problem = problem_along(path_along(CompositeCurve.from_bezier([[0.0], [1.0], [2.0]]), feed=1.0), 1.0, 1.0)
    with pytest.raises(InputError, match="the runs do not divide the 1 pieces"):
        plan(replace(problem, path=replace(problem.path, runs=np.array([0]))))


@pytest.mark.parametrize("seed", range(8))
def test_quadratics_among_pieces_of_elevated_degree_take_the_same_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # A C1 quadratic spline; some of its pieces are elevated to degree 3 or 4.
    points = np.cumsum(rng.normal(size=(40, 3)), axis=0)
    knots = np.concatenate([[0.0] * 3, np.cumsum(rng.uniform(0.3, 2.0, 37)), [37.0 * 2] * 3])
    knots[-3:] = knots[-4] + 1.0
    curve = CompositeCurve.from_nurbs(points, knots, 2)
    pieces = [curve[i : i + 1] for i in range(len(curve))]
    mixed = CompositeCurve.joined([p.elevated(2 + int(rng.integers(0, 3))) for p in pieces])
    limits = np.exp(rng.uniform(0.0, 3.0, 3)), np.exp(rng.uniform(0.0, 5.0, 3))
    feed = float(np.exp(rng.uniform(0.0, 3.0)))
    problem = problem_along(path_along(mixed, feed=feed), *limits)
    profile = plan(problem)
    assert profile.time == pytest.approx(Planned(curve, *limits, feed).time, rel=1e-11)
    excess, use = worst_excess(problem, profile)
    assert excess <= 1e-8
    assert use >= 1 - 1e-6


@pytest.mark.parametrize(("curve", "time"), [(lemniscate(), 1.239149290199), (trefoil(), 1.955242894798)])
def test_the_lemniscate_and_the_trefoil_take_their_known_times(curve: CompositeCurve, time: float) -> None:
    planned = Planned(curve, 250.0, 3000.0)
    assert planned.time == pytest.approx(time, rel=1e-11)
    assert worst_excess(planned.problem, planned.profile)[0] <= 1e-9


def test_a_flying_lap_of_a_circle_by_hand() -> None:
    # On each eighth of the circle one axis is at its limit: 8 √((2 − √2) r/A).
    r, a = 10.0, 3000.0
    curve = circle([0.0, 0.0], r)
    problem = problem_along(path_along(curve), FREE, a)
    speed = float(np.sqrt(a * r))
    flying = replace(problem, start_speed=speed, end_speed=speed)
    time = plan(flying).time
    assert time == pytest.approx(8 * np.sqrt((2 - np.sqrt(2)) * r / a), rel=1e-12)


def test_a_cusp_and_a_jump_of_parameter_speed_change_nothing_that_they_should_not() -> None:
    # A line with C' = 0 in the middle is passed like any line.
    line = CompositeCurve.from_bezier([[0.0], [10.0]])
    slow = CompositeCurve.joined(
        [
            CompositeCurve.from_bezier([[0.0], [5.0], [5.0], [5.0]]),
            CompositeCurve.from_bezier([[5.0], [5.0], [5.0], [10.0]], width=7.0),
        ]
    )
    time = Planned(line, 40.0, 500.0).time
    assert time == pytest.approx(10 / 40 + 40 / 500, rel=1e-12)
    along = problem_along(Path.from_curve(slow, feed=FREE), 40.0, 500.0)
    assert plan(along).time == pytest.approx(time, rel=1e-10)
    # A semicubical parabola turns back in its cusp: both halves are from rest to rest.
    whole = CompositeCurve.from_bezier([[-8.0, 4.0], [8.0, -4.0], [-8.0, -4.0], [8.0, 4.0]])
    halves = whole.split([0], [0.5])
    both = sum(Planned(halves[i : i + 1], 1e9, 100.0).time for i in range(2))
    assert Planned(whole, 1e9, 100.0).time == pytest.approx(both, rel=1e-9)

"""The exact planner: by hand, against the times of an independent implementation, every limit at many places.

`data/reference.npz` holds 122 random problems (seeds 700…, 0…11) and their times from an independent planner
of the same mathematics in numpy. Per problem: `m` axes, `n` pieces, `time` [s], `v`, `a` limits, `dl`, `dr`
the tangents (n, m) at the piece ends, `h` widths, `f` feeds, `j` (n + 1) squared junction speeds. They have
equal limits of several axes, exact zeros, cusps, corners, straight runs and limits over six decades; the last
twelve resemble CAM programs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path as FilePath
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from feedplan import InfeasibleError, InputError
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.planners.bang_bang import plan
from feedplan.profile import PhaseLaw, SpeedProfile
from tests.along import path_along, problem_along

Array = NDArray[np.float64]


def problem(
    left: Array,
    right: Array,
    width: Array,
    feed: Array,
    velocity: Array,
    acceleration: Array,
    junction: Array,
) -> Problem:
    """A problem given by the tangents at both ends of each piece; each piece begins at the origin."""
    second = left * width[:, None] / 2
    control = np.stack([np.zeros_like(left), second, second + right * width[:, None] / 2], axis=1)
    path = path_along(CompositeCurve.from_pieces(control, width), feed=feed)
    return problem_along(path, velocity, acceleration, junction_speed=junction)


def straight(length: float, feed: float, velocity: float, acceleration: float, pieces: int = 1) -> Problem:
    tangent = np.ones((pieces, 1))
    junction = np.full(pieces + 1, np.inf)
    return problem(
        tangent,
        tangent,
        np.full(pieces, length / pieces),
        np.full(pieces, feed),
        np.array([velocity]),
        np.array([acceleration]),
        junction,
    )


def references() -> Iterator[tuple[Problem, float]]:
    data = np.load(FilePath(__file__).parent / "data" / "reference.npz")
    axis = piece = value = 0
    for m, n, time in zip(data["m"], data["n"], data["time"], strict=True):
        tangents = slice(value, value + m * n)
        pieces = slice(piece, piece + n)
        junctions = data["j"][piece + axis_count(data, piece) : piece + axis_count(data, piece) + n + 1]
        yield (
            problem(
                data["dl"][tangents].reshape(n, m),
                data["dr"][tangents].reshape(n, m),
                data["h"][pieces],
                data["f"][pieces],
                data["v"][axis : axis + m],
                data["a"][axis : axis + m],
                np.sqrt(junctions),
            ),
            float(time),
        )
        axis, piece, value = axis + m, piece + n, value + m * n


def axis_count(data: NDArray[np.float64], piece: int) -> int:
    """The number of problems before a piece; each problem has one junction more than pieces."""
    return int(np.searchsorted(np.cumsum(data["n"]), piece, side="right"))  # type: ignore[call-overload]


def worst_excess(task: Problem, profile: SpeedProfile, samples: int = 100) -> tuple[float, float]:
    """Greatest relative excess of any limit, and the smallest use of the most used limit, at many places."""
    points, width = task.path.curve.by_piece, task.path.width
    left = 2 * (points[:, 1] - points[:, 0]) / width[:, None]
    bend = (2 * (points[:, 2] - points[:, 1]) / width[:, None] - left) / width[:, None]
    inner = (np.arange(samples) + 0.5) / samples
    excess, use = 0.0, np.inf
    for i in range(len(profile)):
        piece, kind, axis = profile.piece[i], profile.kind[i], profile.axis[i]
        u0, u1, p0, value = profile.u0[i], profile.u1[i], profile.p0[i], profile.value[i]
        u = u0 + (u1 - u0) * inner
        tangent, second = left[piece] + np.outer(u, bend[piece]), bend[piece]
        speed_sq = (tangent**2).sum(axis=1)
        if kind == PhaseLaw.AXIS_ACCELERATION:
            q, q0 = tangent[:, axis], left[piece, axis] + u0 * second[axis]
            p = (q0**2 * p0 + value * (u - u0) * (q + q0)) / q**2
            s = (value - second[axis] * p) / q
        elif kind == PhaseLaw.PARAMETER_ACCELERATION:
            p, s = np.full(samples, p0), np.zeros(samples)
        elif kind == PhaseLaw.FEED:
            p = value / speed_sq
            s = -p * (tangent @ second) / speed_sq
        else:
            assert kind == PhaseLaw.AXIS_VELOCITY
            p = value / tangent[:, axis] ** 2
            s = -p * second[axis] / tangent[:, axis]
        acceleration = np.abs(tangent * s[:, None] + second * p[:, None]) / task.max_acceleration
        velocity = np.abs(tangent) * np.sqrt(p)[:, None] / task.max_velocity
        feed = np.sqrt(speed_sq * p) / task.feed[piece]
        most = np.maximum(np.maximum(acceleration.max(axis=1), velocity.max(axis=1)), feed)
        excess, use = max(excess, float(most.max()) - 1), min(use, float(most.min()))
    return excess, use


@st.composite
def paths(draw: st.DrawFn) -> Problem:
    """Smooth paths whose tangents are small integers: zeros, equal limits, straight pieces, reversals."""
    axes, count = draw(st.integers(1, 4)), draw(st.integers(1, 8))
    whole = st.integers(-3, 3)
    knots = [draw(st.lists(whole, min_size=axes, max_size=axes)) for _ in range(count + 1)]
    for knot in knots:
        knot[0] = knot[0] if any(knot) else 1
    tangents = np.array(knots, dtype=float)
    positive = st.floats(0.1, 10.0)

    def numbers(size: int) -> Array:
        return np.array(draw(st.lists(positive, min_size=size, max_size=size)))

    return problem(
        tangents[:-1],
        tangents[1:],
        numbers(count),
        numbers(count),
        numbers(axes),
        numbers(axes),
        np.full(count + 1, np.inf),
    )


@given(paths())
def test_any_small_path_keeps_every_limit_and_uses_one_everywhere(task: Problem) -> None:
    excess, use = worst_excess(task, plan(task), samples=20)
    assert excess <= 1e-9
    assert use >= 1 - 1e-6


@given(paths(), st.randoms(use_true_random=False))
def test_direction_and_order_of_the_axes_do_not_matter(task: Problem, random: Random) -> None:
    order = random.sample(range(len(task.max_velocity)), len(task.max_velocity))
    path = task.path
    other = replace(
        task,
        path=replace(
            path, curve=CompositeCurve.from_pieces(path.curve.by_piece[::-1, ::-1, order], path.width[::-1])
        ),
        feed=task.feed[::-1].copy(),
        max_velocity=task.max_velocity[order],
        max_acceleration=task.max_acceleration[order],
    )
    assert plan(other).time == pytest.approx(plan(task).time, rel=1e-10)


def test_a_short_line_is_a_triangle() -> None:
    assert plan(straight(10.0, 1e3, 1e3, 1000.0)).time == pytest.approx(2 * np.sqrt(10 / 1000), rel=1e-14)


@pytest.mark.parametrize(("feed", "velocity"), [(50.0, 1e3), (1e3, 50.0)])
def test_a_long_line_is_a_trapezoid(feed: float, velocity: float) -> None:
    assert plan(straight(10.0, feed, velocity, 500.0)).time == pytest.approx(10 / 50 + 50 / 500, rel=1e-14)


def test_cutting_a_line_into_pieces_changes_nothing() -> None:
    assert plan(straight(10.0, 50.0, 1e3, 500.0, 777)).time == pytest.approx(0.3, rel=1e-12)


def test_the_slower_of_two_axes_rules_a_diagonal() -> None:
    tangent = np.full((1, 2), np.sqrt(0.5))
    task = problem(
        tangent,
        tangent,
        np.array([10.0]),
        np.array([1e3]),
        np.full(2, 1e3),
        np.array([300.0, 100.0]),
        np.zeros(2),
    )
    along = 100.0 * np.sqrt(2.0)
    assert plan(task).time == pytest.approx(2 * np.sqrt(10 / along), rel=1e-14)


def test_times_agree_with_the_reference() -> None:
    worst = max(abs(plan(task).time / time - 1) for task, time in references())
    assert worst <= 1e-12


def test_every_limit_holds_and_some_limit_is_active_everywhere() -> None:
    for task, _ in references():
        excess, use = worst_excess(task, plan(task))
        assert excess <= 1e-9
        assert use >= 1 - 1e-6


def test_an_end_that_cannot_be_reached_names_line_and_speed() -> None:
    task = replace(straight(10.0, 1e3, 1e3, 500.0, 4), end_speed=120.0)
    with pytest.raises(InfeasibleError, match="line 40: no profile ends at 120 mm/s") as caught:
        plan(task)
    assert caught.value.reachable == pytest.approx(100.0)
    assert caught.value.line == 40
    assert plan(replace(task, end_speed=100.0 * (1 - 1e-12))).time == pytest.approx(0.2)


def test_a_start_that_cannot_be_held_names_the_speed() -> None:
    with pytest.raises(InfeasibleError, match="line 10: no profile starts at 101 mm/s") as caught:
        plan(replace(straight(10.0, 1e3, 1e3, 500.0), start_speed=101.0))
    assert caught.value.reachable == pytest.approx(100.0)


@pytest.mark.parametrize("field", ["max_velocity", "max_acceleration", "feed"])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_limits_that_are_no_limits_are_refused(field: str, bad: float) -> None:
    task = straight(10.0, 50.0, 1e3, 500.0)
    with pytest.raises(InputError):
        plan(replace(task, **{field: np.full(1, bad)}))

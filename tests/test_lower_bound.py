"""The lower bound of a plan's time: known times; never above a plan's time and near it, on every path."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.named import butterfly, lemniscate, part, path_of, trefoil
from feedplan import _solvers
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.path import Path
from feedplan.lower_bound import lower_bound
from feedplan.planners import planner
from feedplan.profile import PhaseLaw, SpeedProfile
from tests.along import FREE, path_along, problem_along
from tests.campaign import seeds
from tests.constraints.test_joints import NOT_PLAIN
from tests.constraints.test_joints import random_problem as random_joints
from tests.planners.test_curves import Planned, random_curve
from tests.turns import circle

plan = planner("bang-bang")


def gap(problem: Problem, profile: SpeedProfile) -> float:
    """The relative gap between the native lower bound and the profile's time."""
    return 1.0 - _solvers.lower_bound(problem, profile) / profile.time


def bare(problem: Problem, width: float = 1.0) -> SpeedProfile:
    """A profile without any information for the bound: one phase per piece, with too long a duration."""
    count = len(problem.path)
    nothing = np.zeros(count)
    return SpeedProfile(
        piece=np.arange(count, dtype=np.uint32),
        kind=np.full(count, PhaseLaw.FEED, dtype=np.uint8),
        axis=np.full(count, 255, dtype=np.uint8),
        value=nothing,
        u0=nothing,
        u1=width * problem.curve.width,
        p0=nothing,
        p1=nothing,
        duration=np.full(count, 1e3),
        runs=problem.path.runs,
    )


def test_a_line_from_rest_to_rest_takes_its_bound() -> None:
    line = CompositeCurve.from_bezier([[0.0, 0.0], [30.0, 40.0]])
    for feed, time in ((10.0, 5.0 + 10.0 / 500.0), (1e9, 2.0 * math.sqrt(50.0 / 500.0))):
        # Axis Y limits the acceleration: its 400 mm/s² are 500 mm/s² along the line.
        planned = Planned(line, 1e9, np.array([1e4, 400.0]), feed)
        bound = lower_bound(planned.problem, planned.profile)
        assert time * (1 - 1e-12) < bound <= time * (1 + 1e-15)


def test_a_circle_takes_its_bound() -> None:
    r, a = 10.0, 3000.0
    planned = Planned(circle([0.0, 0.0], r), 1e9, a)
    assert lower_bound(planned.problem, planned.profile) == pytest.approx(0.412407376368, rel=3e-12)
    # A circle passed at speed; on each eighth one axis is at its limit: 8 √((2 − √2) r/A).
    speed = math.sqrt(a * r)
    flying = replace(planned.problem, start_speed=speed, end_speed=speed)
    bound = lower_bound(flying, plan(flying))
    assert bound == pytest.approx(8.0 * math.sqrt((2.0 - math.sqrt(2.0)) * r / a), rel=1e-11)
    # At the feed: length divided by feed.
    slow = Planned(circle([0.0, 0.0], r), 1e9, 1e9, 5.0)
    assert lower_bound(slow.problem, slow.profile) == pytest.approx(4.0 * math.pi, rel=2e-4)


def published() -> dict[str, Planned]:
    return {
        "butterfly": Planned(butterfly(), 250.0, 3000.0),
        "butterfly at a feed": Planned(butterfly(), 250.0, 3000.0, 250.0),
        "lemniscate": Planned(lemniscate(), 250.0, 3000.0),
        "trefoil": Planned(trefoil(), 250.0, 3000.0),
    }


def test_the_gap_closes_on_published_curves() -> None:
    for name, planned in published().items():
        assert -1e-11 < gap(planned.problem, planned.profile) < 2e-5, name


def test_the_bound_is_far_above_zero_without_any_profile() -> None:
    for name, planned in published().items():
        bound = _solvers.lower_bound(planned.problem, bare(planned.problem))
        assert 0.95 * planned.time < bound < planned.time * (1 + 1e-11), name


@pytest.mark.parametrize("weights", [False, True])
def test_random_curves_are_certified(weights: bool) -> None:
    gaps = []
    for seed in range(seeds(200)):
        rng = np.random.default_rng(seed + 10_000)
        curve = random_curve(seed, weights)
        limits = np.exp(rng.uniform(0.0, 3.0, curve.axes)), np.exp(rng.uniform(0.0, 5.0, curve.axes))
        problem = problem_along(path_along(curve, feed=np.exp(rng.uniform(0.0, 3.0))), *limits)
        gaps.append(gap(problem, plan(problem)))
        assert gaps[-1] > -1e-9, seed
    assert np.median(gaps) < 1e-4
    assert max(gaps) < 1e-3


@pytest.mark.parametrize("name", NOT_PLAIN)
def test_random_motions_of_joints_are_certified(name: str) -> None:
    gaps = []
    for seed in range(seeds(4)):
        problem = random_joints(name, seed)
        gaps.append(gap(problem, plan(problem)))
        assert gaps[-1] > 0.0, seed
    assert max(gaps) < 1e-3


@pytest.mark.parametrize(("name", "blocks"), [("vase", 1000), ("head", 1000), ("lettering", 300)])
def test_the_examples_are_certified(name: str, blocks: int) -> None:
    program, machine = part(name, blocks)
    problem = build_problem(path_of(program, machine), machine)
    assert -1e-12 < gap(problem, plan(problem)) < 1e-3


def test_a_wrong_profile_makes_the_bound_loose_at_most() -> None:
    planned = published()["trefoil"]
    for wrong in (
        replace(planned.profile, duration=0.1 * planned.profile.duration),
        replace(planned.profile, duration=np.full_like(planned.profile.duration, np.nan)),
        replace(planned.profile, u1=planned.profile.u1[::-1].copy()),
        replace(planned.profile, piece=planned.profile.piece[::-1].copy()),
        bare(planned.problem, width=7.0),
    ):
        assert 0.0 < _solvers.lower_bound(planned.problem, wrong) < planned.time * (1 + 1e-11)


def test_a_profile_that_breaks_a_limit_shows_a_bound_above_its_time() -> None:
    planned = published()["lemniscate"]
    hasty = Planned(planned.curve, 250.0, 3030.0)
    assert lower_bound(planned.problem, hasty.profile) > 1.001 * hasty.time


def test_columns_that_differ_in_length_make_no_profile() -> None:
    profile = published()["lemniscate"].profile
    with pytest.raises(InputError, match=f"{len(profile)} phases, and `u1` has {len(profile) - 1} entries"):
        replace(profile, u1=profile.u1[:-1])


def test_a_path_of_a_tool_on_plain_axes_has_the_same_bound_run_by_run() -> None:
    line = CompositeCurve.from_bezier([[0.0], [10.0]])
    curve = CompositeCurve.joined([line, replace(line, control_points=line.control_points + 10.0)])
    problem = problem_along(path_along(curve), FREE, 100.0)
    path: Path = replace(problem.path, runs=np.array([0, 1, 2]), dwell=np.zeros(2))
    stops = replace(problem, path=path)
    # Twice 10 mm from rest to rest, compared with 20 mm once.
    assert lower_bound(stops, plan(stops)) == pytest.approx(4.0 * math.sqrt(0.1), rel=1e-14)
    assert lower_bound(problem, plan(problem)) == pytest.approx(2.0 * math.sqrt(0.2), rel=1e-14)

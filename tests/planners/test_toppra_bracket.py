"""toppra on a mesh aligned with the knots brackets the exact time from both sides.

Collocation keeps the limits at the stations only and is optimistic. The one-sided scheme keeps them at both
ends of every interval with the interval's own q''. On a quadratic piece the acceleration is linear in an
interval, so this profile is feasible; on other curves and joints it is feasible up to second order. Both
times converge to the exact one as the mesh is refined.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("toppra", reason="toppra has wheels for Linux on x86-64 only")

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.planners import toppra
from feedplan.planners.bang_bang import plan
from tests.along import path_along, problem_along
from tests.constraints.test_joints import random_problem


def cam_problem(count: int, seed: int) -> Problem:
    """A C1 quadratic B-spline with steps of 0.3 to 3 mm and some sharp bends, and random limits."""
    rng = np.random.default_rng(seed)
    heading, polygon = np.array([1.0, 0.0, 0.0]), [np.zeros(3)]
    for _ in range(count + 1):
        bend = 1.0 if rng.random() < 0.08 else 0.15
        heading = heading + bend * rng.normal(size=3)
        heading /= np.linalg.norm(heading)
        polygon.append(polygon[-1] + heading * np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
    edges = np.diff(polygon, axis=0)
    length = np.linalg.norm(edges, axis=1)
    width = 0.5 * (length[:-1] + length[1:])
    tangent = 2 * edges / (np.append(0, width) + np.append(width, 0))[:, None]
    start = np.vstack([np.zeros(3), np.cumsum(0.5 * (tangent[:-1] + tangent[1:]) * width[:, None], axis=0)])
    middle = start[:-1] + 0.5 * tangent[:-1] * width[:, None]
    feed = rng.uniform(20.0, 60.0)
    curve = CompositeCurve.from_pieces(np.stack([start[:-1], middle, start[1:]], axis=1), width)
    acceleration, velocity = np.exp(rng.uniform(5.0, 7.0, 3)), rng.uniform(20.0, 60.0, 3)
    return problem_along(path_along(curve, feed=feed), velocity, acceleration)


def time_of(problem: Problem, cells: int, scheme: str) -> float:
    return toppra.plan(problem, cells=cells, scheme=scheme).time


@pytest.mark.parametrize("seed", range(4))
def test_both_schemes_close_in_on_the_exact_time(seed: int) -> None:
    problem = cam_problem(30, seed)
    exact = plan(problem).time
    below = [1 - time_of(problem, cells, "collocation") / exact for cells in (40, 160)]
    above = [time_of(problem, cells, "one-sided") / exact - 1 for cells in (40, 160)]
    for coarse, fine in (below, above):
        assert 0 < fine < 0.4 * coarse < 0.01


@pytest.mark.parametrize("seed", [2, 4])
@pytest.mark.parametrize("name", ["cylindrical", "corexy", "trunnion-ac", "head-head", "polar"])
def test_both_schemes_close_in_on_the_exact_time_of_joints(name: str, seed: int) -> None:
    problem = random_problem(name, seed)
    exact = plan(problem).time
    # The pieces are short already, so the mesh counts intervals per piece. One error may pass through 0, but
    # not both at once.
    meshes = [math.ceil(cells / len(problem.path)) for cells in (500, 2000)]
    coarse, fine = (
        max(
            abs(time_of(problem, cells, "collocation") / exact - 1),
            abs(time_of(problem, cells, "one-sided") / exact - 1),
        )
        for cells in meshes
    )
    assert fine < 0.6 * coarse < 0.01

"""Random curves on random machines with limits of jerk, for the planners that keep them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.machine import Axis, Machine


def random_problem(seed: int) -> Problem:
    """A B-spline of degree 2 to 5 in one to three axes, rational or not, smooth or with double knots."""
    return random_case(seed)[0]


def random_case(seed: int) -> tuple[Problem, Machine]:
    """The same with its machine."""
    rng = np.random.default_rng(seed)
    degree, axes = int(rng.integers(2, 6)), int(rng.integers(1, 4))
    count = degree + 1 + int(rng.integers(0, 20 if rng.random() < 0.5 else 6))
    size = 10 ** rng.uniform(-1, 2.5)
    points = rng.uniform(-1, 1, (count, axes)) * size
    if rng.random() < 0.5:
        points = np.cumsum(rng.normal(size=(count, axes)), axis=0) * size / np.sqrt(count)
    inner = np.sort(rng.uniform(0, 1, count - degree - 1))
    if len(inner) > 2 and rng.random() < 0.3:
        inner[1] = inner[0]
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    weights = 10 ** rng.uniform(-0.7, 0.7, count) if rng.random() < 0.4 else None
    velocity, acceleration, jerk = (10 ** rng.uniform(*range_) for range_ in ((1.5, 2.7), (2.5, 4), (3.5, 6)))
    own = rng.uniform(0.5, 2, (axes, 3)) * (velocity, acceleration, jerk)
    machine = Machine("random", tuple(Axis("XYZ"[k], *own[k, :2], max_jerk=own[k, 2]) for k in range(axes)))
    curve = CompositeCurve.from_nurbs(points, knots, degree, weights)
    path = Path.from_curve(curve, axes=tuple("XYZ"[:axes]), feed=10 ** rng.uniform(0.5, 3))
    problem = build_problem(path, machine)
    if rng.random() >= 0.5:
        problem = replace(problem, chord_tolerance=np.inf)
    return problem, machine

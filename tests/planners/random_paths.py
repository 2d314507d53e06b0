"""Random curves on random machines with limits of jerk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine


def random_problem(seed: int) -> Problem:
    """A B-spline of degree 2 to 5 in one to three axes, rational or not, smooth or with double knots."""
    return random_case(seed)[0]


def random_case(seed: int, scale: float = 1.0) -> tuple[Problem, Machine]:
    """The problem of `random_problem` with all lengths times `scale`, and its machine."""
    rng = np.random.default_rng(seed)
    degree, axes = int(rng.integers(2, 6)), int(rng.integers(1, 4))
    count = degree + 1 + int(rng.integers(0, 20 if rng.random() < 0.5 else 6))
    size = scale * 10 ** rng.uniform(-1, 2.5)
    points = rng.uniform(-1, 1, (count, axes)) * size
    if rng.random() < 0.5:
        points = np.cumsum(rng.normal(size=(count, axes)), axis=0) * size / np.sqrt(count)
    inner = np.sort(rng.uniform(0, 1, count - degree - 1))
    if len(inner) > 2 and rng.random() < 0.3:
        inner[1] = inner[0]
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    weights = 10 ** rng.uniform(-0.7, 0.7, count) if rng.random() < 0.4 else None
    velocity, acceleration, jerk = (10 ** rng.uniform(*range_) for range_ in ((1.5, 2.7), (2.5, 4), (3.5, 6)))
    own = scale * rng.uniform(0.5, 2, (axes, 3)) * (velocity, acceleration, jerk)
    machine = Machine("random", tuple(Axis("XYZ"[k], *own[k, :2], max_jerk=own[k, 2]) for k in range(axes)))
    curve = CompositeCurve.from_nurbs(points, knots, degree, weights)
    path = Path.from_curve(curve, axes=tuple("XYZ"[:axes]), feed=scale * 10 ** rng.uniform(0.5, 3))
    problem = build_problem(path, machine)
    problem = replace(problem, chord_tolerance=scale * problem.chord_tolerance)
    if rng.random() >= 0.5:
        problem = replace(problem, chord_tolerance=np.inf)
    return problem, machine


def awkward_case(seed: int) -> tuple[Path, Machine]:
    """A curve of degree 1 to 9 in one to five axes that is difficult for planners, with its machine.

    Spans are as short as 1e-6 of the whole. Curves are rational or not, in one axis, on or nearly on a line,
    turning back, with C' = 0 at a place, or with double and triple knots.
    """
    rng = np.random.default_rng(seed)
    degree, axes = int(rng.integers(1, 10)), int(rng.choice([1, 2, 3, 5]))
    spans = int(rng.integers(1, 8))
    short = rng.random(spans) < 0.3
    spacing = np.where(short, 10 ** rng.uniform(-6, -1, spans), rng.uniform(0.2, 1, spans))
    inner = np.repeat(np.cumsum(spacing)[:-1], rng.integers(1, min(4, degree + 1), spans - 1))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree + 1, spacing.sum())])
    count = len(knots) - degree - 1
    size = 10 ** rng.uniform(-1, 2.5)
    points = rng.uniform(-1, 1, (count, axes))
    kind = rng.choice(["free", "walk", "line", "nearly", "repeated"])
    if kind == "walk":
        points = np.cumsum(rng.normal(size=(count, axes)), axis=0) / np.sqrt(count)
    elif kind in ("line", "nearly"):
        places = rng.uniform(0, 1, count)
        if rng.random() < 0.5:
            places.sort()
        off = 0.0 if kind == "line" else 10 ** rng.uniform(-12, -1)
        points = points[0] + np.outer(places, rng.normal(size=axes)) + off * points
    elif kind == "repeated":
        points[rng.integers(0, count, count // 2)] = points[0]
        points[-1] += 0.1
    weights = 10 ** rng.uniform(-1, 1, count) if rng.random() < 0.4 else None
    scale = [10 ** rng.uniform(*bounds) for bounds in ((1, 3), (2.5, 4), (3.5, 6))]
    own = rng.uniform(0.5, 2, (axes, 3)) * scale
    machine = Machine(
        "awkward", tuple(Axis("XYZAB"[k], *own[k, :2], max_jerk=own[k, 2]) for k in range(axes)), period=1e-3
    )
    curve = CompositeCurve.from_nurbs(points * size, knots, degree, weights)
    feed = 10 ** rng.uniform(0.5, 3) if rng.random() < 0.5 else np.inf
    return Path.from_curve(curve, axes=tuple("XYZAB"[:axes]), feed=feed), machine

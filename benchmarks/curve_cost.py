"""Cost of the exact planner on curves of higher degree, on rational curves and on joint paths."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.interpolate import make_interp_spline

from benchmarks.problems import MACHINE, random_problem
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of_each
from feedplan._solvers import plan_bang_bang
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.profile import SpeedProfile

SEED = 1
FEEDS = (100.0, 1e5)
# Number of timed calls of each case; the cases alternate.
ROUNDS = 15


def run(quick: bool = False) -> Result:
    """Plans one random path of each kind from rest to rest; the best of several calls that alternate."""
    count = 300 if quick else 3000
    quadratics = random_problem(count)
    cases = [
        ("quadratics", quadratics),
        ("quadratics elevated to cubics", build_problem(elevated(quadratics.path), MACHINE)),
    ]
    for kind, curve in random_curves(count).items():
        for feed in FEEDS:
            problem = build_problem(Path.from_curve(curve, feed=feed), MACHINE)
            cases.append((f"{kind}, {feed:g} mm/s", problem))
    cases.append(("joints of cubics, cylindrical", cylindrical(count // 10)))
    calls = [partial(plan_bang_bang, problem) for _, problem in cases]
    costs = [taken.processor for taken in best_of_each(calls, ROUNDS)]
    of_quadratics = costs[0] / len(quadratics.path)
    return Result(
        "Exact planner on curves, one thread",
        tuple(
            _row(name, problem, cost, of_quadratics)
            for (name, problem), cost in zip(cases, costs, strict=True)
        ),
        (
            "The whole native call, profile included. Joint pieces have degree 9.",
            "ratio: to a quadratic.",
        ),
    )


def elevated(path: Path) -> Path:
    """The same path with pieces of degree 3."""
    return replace(path, curve=path.curve.elevated(3))


def cylindrical(count: int) -> Problem:
    """Cubic tip curves on the cylindrical machine; the joint pieces have degree 9."""
    machine = Machine.load("cylindrical")
    axes = tuple(replace(axis, travel=(-np.inf, np.inf)) for axis in machine.axes)
    near = random_curves(count)["cubics"]
    away = replace(near, control_points=near.control_points + np.array([300.0, 0.0, 0.0]))
    return build_problem(Path.from_curve(away, feed=FEEDS[0]), replace(machine, axes=axes))


def random_curves(count: int) -> dict[str, CompositeCurve]:
    """Splines of several kinds through one random walk of points whose direction changes slowly."""
    rng = np.random.default_rng(SEED)
    heading = np.cumsum(rng.normal(0, 0.25, (count + 1, 3)), axis=0) + np.array([3.0, 0.0, 0.0])
    steps = heading / np.linalg.norm(heading, axis=1)[:, None] * rng.uniform(0.5, 2.0, (count + 1, 1))
    points = np.cumsum(steps, axis=0)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    cubic, quintic = (make_interp_spline(length, points, k=degree) for degree in (3, 5))
    weights = np.exp(rng.uniform(-1.0, 1.0, len(cubic.c)))
    return {
        "cubics": CompositeCurve.from_bspline(cubic),
        "quintics": CompositeCurve.from_bspline(quintic),
        "rational cubics": CompositeCurve.from_nurbs(cubic.c, cubic.t, 3, weights),
    }


def _row(name: str, problem: Problem, cost: float, of_quadratics: float) -> dict[str, Cell]:
    pieces = len(problem.path)
    return {
        "path": name,
        "pieces": pieces,
        "phases a piece": len(SpeedProfile.of(plan_bang_bang(problem))) / pieces,
        "CPU per piece [µs]": 1e6 * cost / pieces,
        "ratio": cost / pieces / of_quadratics,
    }

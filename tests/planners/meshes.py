"""Problems on which planners are compared: random paths of all kinds with all limits, and named problems."""

from __future__ import annotations

import json
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from tests.along import path_along

CURVES = FilePath(__file__).parents[2] / "benchmarks" / "curves"


def machine_of(axes: str, velocity: float, acceleration: float, jump: float = 0.0) -> Machine:
    return Machine(
        "any",
        tuple(Axis(name, velocity, acceleration, max_velocity_jump=jump) for name in axes),
        chord_tolerance=np.inf,
    )


def on_plane(points: NDArray[np.float64], feed: float, degree: int = 3) -> Problem:
    """A spline through points of the plane, with axes of 250 mm/s and 3000 mm/s²."""
    knots = np.concatenate([np.zeros(degree), np.linspace(0, 1, len(points) - degree + 1), np.ones(degree)])
    path = Path.from_bspline(points, knots, degree, feed=feed)
    return build_problem(path, machine_of("XY" if points.shape[1] == 2 else "XYZ", 250.0, 3000.0))


def butterfly() -> Problem:
    data = json.loads((CURVES / "butterfly.json").read_text(encoding="utf-8"))
    path = Path.from_nurbs(data["control_points"], data["knots"], data["degree"], data["weights"], feed=200.0)
    return build_problem(path, machine_of("XY", 250.0, 3000.0))


def infinity() -> Problem:
    t = np.linspace(0.0, 2.0 * np.pi, 17)
    return on_plane(np.stack([40.0 * np.sin(t), 20.0 * np.sin(2.0 * t)], axis=1), 200.0)


def trefoil() -> Problem:
    t = np.linspace(0.0, 2.0 * np.pi, 25)
    radius = 20.0 + 10.0 * np.cos(3.0 * t)
    return on_plane(
        np.stack([radius * np.cos(2.0 * t), radius * np.sin(2.0 * t), 10.0 * np.sin(3.0 * t)], axis=1), 150.0
    )


NAMED = {"butterfly": butterfly, "infinity": infinity, "trefoil": trefoil}


def random_path_problem(seed: int) -> Problem:
    """A random curve in two to four axes: quadratic, cubic or rational; some seeds have corners, speeds at
    the ends, a chord tolerance or feeds."""
    rng = np.random.default_rng(seed)
    axes = "XYZA"[: int(rng.integers(2, 5))]
    kind = ("quadratic", "cubic", "rational")[seed % 3]
    degree = {"quadratic": 2, "cubic": 3}.get(kind, int(rng.integers(2, 5)))
    curves, start = [], np.zeros(len(axes))
    for _ in range(int(rng.integers(1, 3))):
        count = degree + 1 + int(rng.integers(0, 7))
        points = start + np.concatenate(
            [np.zeros((1, len(axes))), np.cumsum(rng.normal(size=(count - 1, len(axes))) * 6.0, axis=0)]
        )
        inner = np.sort(rng.uniform(0.1, 0.9, count - degree - 1))
        knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
        weights = 10 ** rng.uniform(-0.5, 0.5, count) if kind == "rational" else None
        curve = CompositeCurve.from_nurbs(points, knots, degree, weights)
        curves.append(curve.with_width(curve.width * 6.0 * count * 10 ** rng.uniform(-0.3, 0.3)))
        start = points[-1]
    curve = CompositeCurve.joined(curves)
    n = len(curve)
    path = path_along(curve, axes, feed=np.full(n, 10 ** rng.uniform(1.3, 2.5)) * rng.uniform(0.7, 1.0, n))
    jump = 10 ** rng.uniform(0.0, 1.5) if rng.random() < 0.7 else 0.0
    machine = Machine(
        "any",
        tuple(
            Axis(name, 10 ** rng.uniform(1.5, 2.5), 10 ** rng.uniform(2.3, 3.5), max_velocity_jump=jump)
            for name in axes
        ),
        chord_tolerance=0.002 if rng.random() < 0.3 else np.inf,
        period=0.004,
    )
    speeds = rng.uniform(0.0, 3.0, 2) * (rng.random(2) < 0.4)
    return build_problem(path, machine, start_speed=float(speeds[0]), end_speed=float(speeds[1]))

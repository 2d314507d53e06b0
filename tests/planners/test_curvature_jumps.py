"""Paths whose curvature jumps: third differences of the setpoints keep the limits of jerk."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan import Axis, Machine, Path, Plan, plan
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.axis import JERK_TIMES
from tests.campaign import seeds

Array = NDArray[np.float64]
METHODS = ("jerk-limited", "s-curve", "ruckig")
PERIODS = (1e-3, 2e-3, 2.5e-4, 4e-3)
COUNT = seeds(6)


def arcs_and_lines(rng: np.random.Generator) -> CompositeCurve:
    """Circular arcs and lines, each tangent to the one before."""
    size, angle = 10 ** rng.uniform(-0.5, 1.5), rng.uniform(0.0, 2.0 * np.pi)
    at, pieces = np.zeros(2), []
    for _ in range(rng.integers(3, 12)):
        direction = np.array([np.cos(angle), np.sin(angle)])
        length = size * 10 ** rng.uniform(-1.0, 0.5)
        if rng.random() < 0.4:
            pieces.append(CompositeCurve.from_bezier([at, at + length * direction]))
            at = at + length * direction
            continue
        turn = rng.uniform(0.1, 2.0) * rng.choice([-1, 1])
        angle += turn
        corner = at + length * np.tan(0.5 * abs(turn)) * direction
        end = corner + length * np.tan(0.5 * abs(turn)) * np.array([np.cos(angle), np.sin(angle)])
        weights = [1.0, np.cos(0.5 * turn), 1.0]
        pieces.append(CompositeCurve.from_nurbs([at, corner, end], [0, 0, 0, 1, 1, 1], 2, weights))
        at = end
    return CompositeCurve.joined(pieces)


def spline(rng: np.random.Generator, degree: int) -> CompositeCurve:
    """A B-spline whose curvature jumps at its knots: quadratic, or cubic with double knots."""
    inner = np.repeat(np.sort(rng.uniform(0.0, 1.0, rng.integers(2, 8))), degree - 1)
    count = degree + 1 + len(inner)
    steps = rng.normal(size=(count, rng.integers(2, 4))) * 10 ** rng.uniform(-0.5, 2.0)
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    return CompositeCurve.from_nurbs(np.cumsum(steps, axis=0) / np.sqrt(count), knots, degree)


def many_pieces(rng: np.random.Generator) -> CompositeCurve:
    """A quadratic B-spline of so many pieces that several jumps fall into one third difference."""
    count = int(rng.integers(60, 400))
    t, (a, b), (c, d) = np.linspace(0.0, 1.0, count), rng.uniform(6.0, 25.0, 2), rng.uniform(0.0, 6.0, 2)
    noise = rng.uniform(-1e-3, 1e-3, (count, 2)) * rng.choice([0, 1])
    points = 10 ** rng.uniform(0.0, 1.3) * (np.stack([np.sin(a * t + c), np.cos(b * t + d)], axis=1) + noise)
    knots = np.concatenate([[0.0, 0.0], np.linspace(0.0, 1.0, count - 1), [1.0, 1.0]])
    return CompositeCurve.from_nurbs(points, knots, 2)


def random_case(seed: int) -> tuple[Path, Machine]:
    """A path whose curvature jumps, and a machine with one of the periods."""
    rng = np.random.default_rng(seed)
    kinds = (arcs_and_lines, lambda rng: spline(rng, 2), lambda rng: spline(rng, 3), many_pieces)
    curve = kinds[seed % 4](rng)
    # From seed 16 on the axes' limits differ by up to a hundred times.
    spread = 2.0 if seed < 16 else 10.0
    letters = "XYZ"[: curve.axes]
    limits = 10 ** np.array([rng.uniform(*span) for span in ((1.5, 2.7), (2.5, 4.0), (3.5, 6.0))])
    own = spread ** rng.uniform(-1.0, 1.0, (len(letters), 3)) * limits
    # A machine takes no jerk that needs longer to reach the acceleration.
    own[:, 2] = np.maximum(own[:, 2], 1.001 * own[:, 1] / JERK_TIMES[1])
    axes = tuple(Axis(k, *row[:2], max_jerk=row[2]) for k, row in zip(letters, own, strict=True))
    path = Path.from_curve(curve, axes=tuple(letters), feed=10 ** rng.uniform(0.5, 3.0))
    return path, Machine("random", axes, period=PERIODS[seed // 4 % 4])


def third_differences(planned: Plan) -> Array:
    """The greatest third difference of each axis, minus its rounding error, over the limit of jerk."""
    period = planned.machine.period
    position = planned.setpoints().all().position
    greatest = np.abs(np.diff(position, 3, axis=0)).max(axis=0)
    rounding = 8.0 * np.finfo(float).eps * np.abs(position).max(axis=0)
    return np.asarray((greatest - rounding) / period**3 / planned.problem.max_jerk)


@pytest.mark.parametrize("method", METHODS)
def test_third_differences_keep_the_limits_of_jerk(method: str) -> None:
    found = []
    for seed in range(COUNT):
        path, machine = random_case(seed)
        planned = plan(path, machine, method, time_limit=0.3 if method == "ruckig" else None)
        worst = third_differences(planned).max()
        if not (worst <= 1.0 + 1e-6 and planned.audit().ok):
            found.append((seed, worst, planned.audit().failures))
    assert found == []

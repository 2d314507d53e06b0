"""Random problems whose paths resemble fitted programs of CAM systems."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan import Axis, Machine, Path
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve

# The accelerations of Zhang et al. 2010, section 4.3; the velocities are reached on some pieces.
MACHINE = Machine(
    name="benchmark",
    axes=(Axis("X", 250.0, 3000.0), Axis("Y", 250.0, 3000.0), Axis("Z", 250.0, 1000.0)),
)
FEED = 100.0  # [mm/s]


def random_spline(pieces: int, seed: int = 0) -> Path:
    """A random C1 quadratic B-spline of this many pieces in X, Y, Z; equal seeds give equal splines.

    Control polygon edges are 0.3 to 3 mm long (log-uniform); directions wander by about 0.15 rad from edge to
    edge, and one edge in twelve turns sharply, up to a reversal.
    """
    rng = np.random.default_rng(seed)
    edges = pieces + 1
    length = np.exp(rng.uniform(np.log(0.3), np.log(3.0), edges))
    turn = rng.normal(scale=0.15, size=(2, edges))
    sharp = rng.random(edges) < 1.0 / 12.0
    turn[:, sharp] = rng.uniform(-0.9 * np.pi, 0.9 * np.pi, (2, int(sharp.sum())))
    yaw, pitch = np.cumsum(turn, axis=1)
    direction = np.column_stack((np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)))
    edge = length[:, None] * direction
    return quadratic_spline(np.concatenate((np.zeros((1, 3)), np.cumsum(edge, axis=0))), FEED)


def quadratic_spline(points: NDArray[np.float64], feed: float) -> Path:
    """The C1 quadratic B-spline with control points (n + 2, axes) as a path of one run.

    Knot spans are the mean lengths of the edges on both sides, so the parameter is about the arc length.
    """
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    knots = np.cumsum(np.concatenate(([0.0], 0.5 * (length[:-1] + length[1:]))))
    curve = CompositeCurve.from_bspline(points, np.pad(knots, 2, mode="edge"), 2)
    return Path.from_curve(curve, feed=feed)


def random_problem(pieces: int, seed: int = 0) -> Problem:
    """The random spline on the benchmark's machine, from rest to rest."""
    return build_problem(random_spline(pieces, seed), MACHINE)

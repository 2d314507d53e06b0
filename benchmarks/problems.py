"""Random problems of the benchmarks, whose paths are like fitted programs of CAM systems."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan import Axis, Machine, Path
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve

# The accelerations of Zhang et al. 2010, section 4.3, and speeds that some pieces reach.
MACHINE = Machine(
    name="benchmark",
    axes=(Axis("X", 250.0, 3000.0), Axis("Y", 250.0, 3000.0), Axis("Z", 250.0, 1000.0)),
)
FEED = 100.0  # [mm/s]


def random_spline(pieces: int, seed: int = 0) -> Path:
    """A C1 quadratic B-spline of this many pieces in X, Y, Z, a pure function of `seed`.

    Control polygon edges are 0.3 to 3 mm long (log-uniform); directions wander by about 0.15 rad from edge to
    edge, and one edge in twelve turns sharply, up to a reversal. Knot spans are the mean lengths of the edges
    on both sides, so the parameter is about the arc length.
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

    width = 0.5 * (length[:-1] + length[1:])
    spans = np.concatenate(([0.0], width, [0.0]))
    derivative = 2.0 * edge / (spans[:-1] + spans[1:])[:, None]
    to_middle = 0.5 * width[:, None] * derivative[:-1]
    to_end = 0.5 * width[:, None] * derivative[1:]
    ends = np.concatenate((np.zeros((1, 3)), np.cumsum(to_middle + to_end, axis=0)))
    control_points = np.stack((ends[:-1], ends[:-1] + to_middle, ends[1:]), axis=1)
    return spline_path(control_points, width)


def spline_path(control_points: NDArray[np.float64], width: NDArray[np.float64]) -> Path:
    """Bézier triples (n, 3, axes) and widths (n,) as a path of one run at the benchmark's feed."""
    count = len(width)
    return Path(
        axes=("X", "Y", "Z"),
        curve=CompositeCurve.from_pieces(control_points, width),
        feed=np.full(count, FEED),
        move=np.column_stack((np.arange(count), np.arange(count))),
        line=np.arange(1, count + 1, dtype=np.int32),
        runs=np.array([0, count]),
        dwell=np.zeros(1),
        tolerance=np.full(count, 0.01),
    )


def random_problem(pieces: int, seed: int = 0) -> Problem:
    """The random spline on the benchmark's machine, from rest to rest."""
    return build_problem(random_spline(pieces, seed), MACHINE)

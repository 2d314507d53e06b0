"""toppra on the same problem, on a mesh aligned with the knots: time, grid size and processor time.

toppra's default scheme asks one path acceleration to serve both values of q'' at a knot and therefore does
not converge on C1 quadratic splines; its collocation scheme does, from below, and is what is compared here.
The velocity and acceleration constraints are toppra's own; the feed is a bound on the squared path speed.
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray
from toppra.algorithm import TOPPRA
from toppra.constraint import (
    DiscretizationType,
    JointAccelerationConstraint,
    JointVelocityConstraint,
    LinearConstraint,
)
from toppra.interpolator import AbstractGeometricPath

from feedplan.constraints.problem import Problem

logging.getLogger("toppra").setLevel(logging.ERROR)
VERSION = metadata.version("toppra")


class JointPath(AbstractGeometricPath):  # type: ignore[misc]
    """The joints along the path's pieces, laid end to end on one parameter."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.knots = np.concatenate(([0.0], np.cumsum(problem.path.width)))

    def piece(self, u: NDArray[np.float64], side: str = "right") -> NDArray[np.int64]:
        found = np.searchsorted(self.knots, u, side=side)  # type: ignore[call-overload]
        return np.asarray(np.clip(found - 1, 0, len(self.knots) - 2))

    def on(self, piece: NDArray[np.int64], u: NDArray[np.float64], order: int) -> NDArray[np.float64]:
        """The derivative at places of given pieces."""
        local = np.clip(u - self.knots[piece], 0.0, self.problem.path.width[piece])
        return self.problem.derivatives(piece, local, order)[order]

    def __call__(self, u: Any, order: int = 0) -> NDArray[np.float64]:
        places = np.atleast_1d(np.asarray(u, dtype=float))
        values = self.on(self.piece(places), places, order)
        return values if np.ndim(u) else values[0]

    def speed_sq(self, piece: NDArray[np.int64], u: NDArray[np.float64]) -> NDArray[np.float64]:
        """The square of the speed that the feed is about, over that of u."""
        tool = self.problem.tip_curve or self.problem.path.curve
        local = np.clip(u - self.knots[piece], 0.0, self.problem.path.width[piece])
        square: NDArray[np.float64] = (tool.evaluate(piece, local, 1)[1] ** 2).sum(axis=1)
        return square

    @property
    def dof(self) -> int:
        return len(self.problem.axes)

    @property
    def path_interval(self) -> NDArray[np.float64]:
        return self.knots[[0, -1]]

    @property
    def waypoints(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return self.knots, self(self.knots)


class FeedConstraint(LinearConstraint):  # type: ignore[misc]
    """Speed along the path at most the feed of the piece, of both pieces at a knot."""

    def __init__(self, feed: NDArray[np.float64], axes: int) -> None:
        super().__init__()
        self.feed = feed
        self.dof = axes

    def compute_constraint_params(self, path: JointPath, gridpoints: NDArray[np.float64]) -> tuple[Any, ...]:
        sides = [path.piece(gridpoints), path.piece(gridpoints, "left")]
        limits = [self.feed[piece] ** 2 / path.speed_sq(piece, gridpoints) for piece in sides]
        bound = np.column_stack((np.zeros(len(gridpoints)), np.minimum(*limits)))
        return None, None, None, None, None, None, bound


@dataclass(frozen=True)
class Solution:
    """What toppra found: `time` along the path [s], `cells` a piece, `processor` time [s]."""

    time: float
    cells: int
    processor: float


def solve(problem: Problem, cells: int) -> Solution:
    """Plan on `cells` equal cells in every piece, from rest to rest.

    `processor` covers the constraints' parameters and both passes; not the path, the mesh, the conversion
    of the result to a trajectory, nor toppra's import.
    """
    path = JointPath(problem)
    steps = np.diff(path.knots)[:, None] * (np.arange(cells) / cells)
    grid = np.append((path.knots[:-1, None] + steps).ravel(), path.knots[-1])
    acceleration, velocity = problem.max_acceleration, problem.max_velocity
    constraints = [
        JointAccelerationConstraint(
            np.column_stack((-acceleration, acceleration)),
            discretization_scheme=DiscretizationType.Collocation,
        ),
        JointVelocityConstraint(np.column_stack((-velocity, velocity))),
        FeedConstraint(problem.feed, path.dof),
    ]
    begin = time.process_time()
    instance = TOPPRA(constraints, path, gridpoints=grid, solver_wrapper="seidel")
    _, speed, _ = instance.compute_parameterization(0.0, 0.0)
    processor = time.process_time() - begin
    if speed is None:
        raise RuntimeError(f"toppra found no profile on {cells} cells a piece")
    return Solution(float((2.0 * np.diff(grid) / (speed[1:] + speed[:-1])).sum()), cells, processor)


def solve_to(problem: Problem, exact: float, accuracy: float) -> tuple[Solution, float]:
    """The coarsest mesh, to a tenth, whose time is within `accuracy` (relative) of `exact`, and its error.

    The error falls about as 1/cells: each try is sized by the one before, until one is accurate enough; then
    the mesh is coarsened again between the last that was not and the first that was.
    """
    too_coarse, cells = 0, 8
    solution = solve(problem, cells)
    while (error := abs(solution.time / exact - 1.0)) > accuracy:
        too_coarse, cells = cells, max(cells + 1, math.ceil(1.03 * cells * error / accuracy))
        solution = solve(problem, cells)
    while solution.cells > 1.1 * too_coarse + 1:
        cells = math.isqrt(max(too_coarse, 1) * solution.cells)
        candidate = solve(problem, cells)
        candidate_error = abs(candidate.time / exact - 1.0)
        if candidate_error > accuracy:
            too_coarse = cells
        else:
            solution, error = candidate, candidate_error
    return solution, error

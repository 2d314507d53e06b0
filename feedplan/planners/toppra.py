"""The profile of TOPP-RA on a mesh aligned with the knots: a backward and a forward pass of small linear
programs.

After Pham and Pham, "A new approach to time-optimal path parameterization based on reachability analysis",
IEEE Transactions on Robotics 34 (2018), in the package toppra. toppra's own scheme uses one path acceleration
for both values of q'' at a knot and does not converge on C1 splines; here every cell has rows of its own.
They hold at both ends of the cell (`one-sided`): the result is feasible, and its time falls to the least time
as the cells get smaller. Or they hold only at its start (`collocation`): the result breaks limits between the
stations, and its time rises to the least time. Both are of first order.
"""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np

from feedplan.arguments import one_of
from feedplan.arrays import Flags, Floats
from feedplan.constraints.problem import Problem
from feedplan.planners._mesh import Mesh
from feedplan.planners._refinement import Method, Refusal, plan_on_meshes
from feedplan.planners._transcription import Rows, Transcription, end_rows
from feedplan.profile import SpeedProfile

ACCURACY = 1e-3
# Upper bound of x, which is about 1 where p is greatest, if no other bound holds.
_FASTEST = 1e6
Scheme = Literal["one-sided", "collocation"]
SCHEMES: tuple[Scheme, ...] = get_args(Scheme)


def plan(
    problem: Problem,
    *,
    accuracy: float = ACCURACY,
    cells: int | None = None,
    time_limit: float | None = None,
    scheme: Scheme = "one-sided",
) -> SpeedProfile:
    """The fastest profile on a mesh: refined until the time has about the relative `accuracy`, or with
    `cells` cells in each piece.

    `time_limit` [s] ends the refinement; toppra itself cannot be interrupted. `scheme` is `one-sided`, or
    `collocation`, whose profile is faster than the limits allow. Raises SolverError where toppra fails,
    InfeasibleError where a given speed at an end is not possible, MissingPackageError.
    """
    one_of(scheme, "scheme of toppra", SCHEMES)
    feasible = scheme == "one-sided"
    ends = (0, -1) if feasible else (0,)

    def rows(mesh: Mesh, limit: Floats, at_ends: Flags) -> Rows:
        return end_rows(mesh, limit, ends=ends)

    method = Method("toppra", _solve, rows, by_axis=False, feasible=feasible, platform="Linux on x86-64")
    return plan_on_meshes(problem, method, accuracy, cells, time_limit)


def _solve(task: Transcription, seconds: float) -> Floats:
    import logging

    from toppra.algorithm import TOPPRA

    # toppra's path has one parameter with continuous speed. It is made from the parameters of the pieces,
    # each scaled to continue the speed of the one before, so that cells are about 1 wide and squared speeds
    # are about 1.
    factor = np.concatenate([[0.0], np.cumsum(np.log(task.near[1:] / task.far[:-1]))])
    factor = np.exp(-factor) / np.median(task.width * np.exp(-factor))
    unit = np.median((factor * task.near) ** 2)
    start, end = (factor * task.near) ** 2 / unit, (factor * task.far) ** 2 / unit
    squares = np.append(start, end[-1])
    grid = np.concatenate([[0.0], np.cumsum(factor * task.width)])
    constraint = _constraint(task, 1.0 / start, 1.0 / end, grid, squares)
    log = logging.getLogger("toppra")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        solver = TOPPRA([constraint], _path(grid), gridpoints=grid, solver_wrapper="seidel")
        # At a cusp the tool stands still for every p.
        ends = [np.sqrt((x or 0.0) * squares[side]) for side, x in zip((0, -1), task.fixed, strict=True)]
        _, speed, _ = solver.compute_parameterization(*ends)
    finally:
        log.setLevel(level)
    if speed is None or not np.isfinite(speed).all():
        raise Refusal(str(solver.problem_data.return_code), infeasible=speed is None)
    x: Floats = speed**2 / squares
    return x


def _constraint(task: Transcription, start: Floats, end: Floats, grid: Floats, squares: Floats) -> Any:
    """The rows of each cell in toppra's form, −low ≤ (near + far) x + 2 Δ far u ≤ 1, and 0 ≤ x ≤ most."""
    from toppra.constraint import LinearConstraint

    rows, n = task.rows, task.cells
    order = np.argsort(rows.cell, kind="stable")
    cell = rows.cell[order]
    place = np.arange(len(cell)) - np.searchsorted(cell, cell)
    count = int(place.max()) + 1
    # Every row appears twice: row ≤ 1, and row/(−low) ≤ 1.
    near, far = np.zeros((2, n + 1, 2 * count))
    for side, scale in ((place, 1.0), (count + place, -1.0 / rows.low[order])):
        near[cell, side] = (rows.near * start[rows.cell])[order] * scale
        far[cell, side] = (rows.far * end[rows.cell])[order] * scale
    step = np.append(np.diff(grid), 0.0)[:, None]
    identity, ones = np.eye(2 * count), np.ones(2 * count)
    bound = np.column_stack([np.zeros(n + 1), np.minimum(task.most * squares, _FASTEST * squares)])

    class Cells(LinearConstraint):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.dof = 1
            self.identical = True

        def compute_constraint_params(self, path: Any, gridpoints: Any, *args: Any) -> tuple[Any, ...]:
            return 2.0 * step * far, near + far, np.zeros_like(near), identity, ones, None, bound

    return Cells()


def _path(grid: Floats) -> Any:
    """A path for toppra; only the ends of its parameter interval are used."""
    from toppra.interpolator import AbstractGeometricPath

    class Line(AbstractGeometricPath):  # type: ignore[misc]
        dof = 1
        path_interval = grid[[0, -1]]
        waypoints = (grid, grid[:, None])

        def __call__(self, u: Any, order: int = 0) -> Any:
            return np.asarray(u)[..., None] if order == 0 else np.full((*np.shape(u), 1), float(order == 1))

    return Line()

"""The time-optimal profile as a second-order cone program, solved by Clarabel.

After Verscheure, Demeulenaere, Swevers, De Schutter and Diehl, "Time-optimal path tracking for robots: a
convex optimization approach", IEEE Transactions on Automatic Control 54 (2009). With x = p, c ≤ √x at the
stations and d ≥ 1/(c_start + c_end) in the cells of width h, the time Σ 2 h d is linear, and both
inequalities are second-order cones.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.planners._refinement import Method, Refusal, plan_on_meshes
from feedplan.planners._transcription import Transcription, mean_rows
from feedplan.profile import SpeedProfile

ACCURACY = 1e-4
# Tolerances of the solver: GAP for the time, far below the error of any mesh, and ROWS for the rows; p is
# finally scaled so that all limits hold.
GAP, ROWS = 1e-6, 1e-7


def plan(
    problem: Problem,
    *,
    accuracy: float = ACCURACY,
    cells: int | None = None,
    time_limit: float | None = None,
) -> SpeedProfile:
    """The fastest profile on a mesh: refined until the time has about the relative `accuracy`, or with
    `cells` cells in each piece.

    `time_limit` [s] limits the whole plan. Raises SolverError with Clarabel's status, InfeasibleError where a
    given speed at an end is not possible, MissingPackageError.
    """
    return plan_on_meshes(
        problem, Method("clarabel", _solve, mean_rows, others=("scipy",)), accuracy, cells, time_limit
    )


def _solve(task: Transcription, seconds: float) -> Floats:
    import clarabel
    from scipy import sparse

    deadline = time.monotonic() + seconds
    matrix, bound, cones, cost = _program(task)
    none = sparse.csc_matrix((matrix.shape[1], matrix.shape[1]))
    # The program is already scaled by the greatest p, so equilibration mostly increases rounding errors; it
    # is the second attempt.
    for equilibrate in (False, True):
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        settings.equilibrate_enable = equilibrate
        settings.tol_gap_rel = settings.tol_gap_abs = GAP
        settings.tol_feas = ROWS
        if math.isfinite(seconds):
            settings.time_limit = max(deadline - time.monotonic(), 1e-3)
        solution = clarabel.DefaultSolver(none, cost, matrix, bound, cones, settings).solve()
        word = str(solution.status)
        if word == "Solved":
            break
    else:
        raise Refusal(word, infeasible="PrimalInfeasible" in word)
    return task.completed(np.maximum(np.array(solution.x)[: task.free.sum()], 0.0))


def _program(task: Transcription) -> tuple[Any, Floats, list[Any], Floats]:
    """Minimise cost·z with A z + s = b, s in cones; z holds x and c at the free stations and d in the cells.

    d is in units of 1/(near + far), so that all of z is about 1.
    """
    import clarabel
    from scipy import sparse

    n, free = task.cells, int(task.free.sum())
    column = np.where(task.free, np.cumsum(task.free) - 1, -1)
    size = 2 * free + n
    unit = task.near + task.far

    def block(rows: int, entries: list[tuple[Any, Any, Any]]) -> Any:
        """A matrix of entries (row, column or −1 for none, value)."""
        row, col, value = (
            np.concatenate([np.broadcast_to(e[i], np.shape(e[0])) for e in entries]) for i in range(3)
        )
        kept = col >= 0
        return sparse.coo_matrix((value[kept], (row[kept], col[kept])), shape=(rows, size))

    rows = task.rows
    number = np.arange(len(rows.cell))
    near, far = column[rows.cell], column[rows.cell + 1]
    offset = rows.near * task.known[rows.cell] + rows.far * task.known[rows.cell + 1]
    inside = block(len(number), [(number, near, rows.near), (number, far, rows.far)])
    found = np.arange(free)
    bounded = np.flatnonzero(np.isfinite(task.most) & task.free)
    most = block(len(bounded), [(np.arange(len(bounded)), column[bounded], 1.0)])
    # (x + 1, x − 1, 2 c) and (c_start + c_end + d, c_start + c_end − d, 2), each with s = b − A z.
    first = 3 * found
    root = block(3 * free, [(first, found, -1.0), (first + 1, found, -1.0), (first + 2, free + found, -2.0)])
    cell = np.arange(n)
    weights = (task.near / unit, task.far / unit)
    ends = [np.where(column[at] >= 0, free + column[at], -1) for at in (slice(0, n), slice(1, n + 1))]
    slow = block(
        3 * n,
        [(3 * cell + i, ends[side], -weights[side]) for i in (0, 1) for side in (0, 1)]
        + [(3 * cell, 2 * free + cell, -1.0), (3 * cell + 1, 2 * free + cell, 1.0)],
    )
    known = weights[0] * np.sqrt(task.known[:-1]) + weights[1] * np.sqrt(task.known[1:])
    bound = np.concatenate(
        [
            1.0 - offset,
            rows.low + offset,
            task.most[bounded],
            np.tile([1.0, -1.0, 0.0], free),
            np.column_stack([known, known, np.full(n, 2.0)]).ravel(),
        ]
    )
    cones = [clarabel.NonnegativeConeT(2 * len(number) + len(bounded))]
    cones += [clarabel.SecondOrderConeT(3)] * (free + n)
    cost = np.zeros(size)
    time = 2.0 * task.width / unit
    cost[2 * free :] = time / time.sum()
    return sparse.vstack([inside, -inside, most, root, slow], format="csc"), bound, cones, cost

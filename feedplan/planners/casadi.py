"""The time-optimal profile by direct transcription: a nonlinear program in p at stations, solved by IPOPT.

CasADi computes the Hessian of the time. The rows are linear in p, so the program is convex, and IPOPT finds
the optimum of the mesh.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.planners._refinement import Method, Refusal, plan_on_meshes
from feedplan.planners._transcription import Transcription, mean_rows
from feedplan.profile import SpeedProfile

ACCURACY = 1e-4
# Tolerance of IPOPT for optimality and for rows, both scaled to about 1.
_LEFT = 1e-8
# Least x between the ends of a subrun: at 0 the time is infinite.
_SLOWEST = 1e-9
_START = 0.5


def plan(
    problem: Problem,
    *,
    accuracy: float = ACCURACY,
    cells: int | None = None,
    time_limit: float | None = None,
) -> SpeedProfile:
    """The fastest profile on a mesh: refined until the time has about the relative `accuracy`, or with
    `cells` cells in each piece.

    `time_limit` [s] limits the whole plan. Raises SolverError with IPOPT's status, InfeasibleError where a
    given speed at an end is not possible, MissingPackageError.
    """
    return plan_on_meshes(problem, Method("casadi", _solve, mean_rows), accuracy, cells, time_limit)


def _solve(task: Transcription, seconds: float) -> Floats:
    import casadi

    free = np.flatnonzero(task.free)
    x = casadi.SX.sym("x", len(free))
    everywhere = casadi.SX(task.known)
    everywhere[free.tolist()] = x
    root = casadi.sqrt(everywhere)
    n = task.cells
    pace = casadi.DM(task.near) * root[:n] + casadi.DM(task.far) * root[1:]
    # The objective is scaled so that each cell contributes about 1: IPOPT's tolerance is then relative to the
    # time of one cell.
    mean = (2.0 * task.width / (task.near + task.far)).mean()
    time = casadi.sum1(casadi.DM(2.0 * task.width / mean) / pace)
    near, far = task.rows.cell.tolist(), (task.rows.cell + 1).tolist()
    used = casadi.DM(task.rows.near) * everywhere[near] + casadi.DM(task.rows.far) * everywhere[far]
    options: dict[str, Any] = {
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": _LEFT,
        "ipopt.constr_viol_tol": _LEFT,
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.jac_c_constant": "yes",
        "ipopt.jac_d_constant": "yes",
    }
    if math.isfinite(seconds):
        options["ipopt.max_wall_time"] = seconds
    solver = casadi.nlpsol("time_optimal", "ipopt", {"x": x, "f": time, "g": used}, options)
    start = np.minimum(_START, _START * task.most[free])
    found = solver(x0=start, lbx=_SLOWEST, ubx=task.most[free], lbg=-task.rows.low, ubg=1.0)
    statistics = solver.stats()
    if not statistics["success"]:
        word = str(statistics["return_status"])
        raise Refusal(word, infeasible=word == "Infeasible_Problem_Detected")
    return task.completed(np.asarray(found["x"]).ravel())

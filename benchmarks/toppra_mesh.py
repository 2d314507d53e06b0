"""toppra on the same problem: the coarsest mesh with about the exact time, and its computing time."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from importlib import metadata

from feedplan.constraints.problem import Problem
from feedplan.planners import toppra

VERSION = metadata.version("toppra")
# A mesh counts as the coarsest one if its error is at least this share of the accuracy.
USED = 0.8


@dataclass(frozen=True)
class Solution:
    """toppra's result: `time` along the path [s], intervals (`cells`) of each piece, `processor` time [s]."""

    time: float
    cells: int
    processor: float


def solve(problem: Problem, cells: int) -> Solution:
    """Plans by collocation on `cells` intervals of every piece; `processor` is the time of the whole call."""
    begin = time.process_time()
    profile = toppra.plan(problem, cells=cells, scheme="collocation")
    return Solution(profile.time, cells, time.process_time() - begin)


def solve_to(problem: Problem, exact: float, accuracy: float) -> tuple[Solution, float]:
    """The coarsest mesh (to a fourth) whose time is within `accuracy` (relative) of `exact`, and its error.

    The error is about proportional to 1/cells, which gives the size of the next mesh until one is accurate
    enough. If its error is much less than allowed, a mesh between it and the last inaccurate one is tried.
    """
    too_coarse, cells = 0, 8
    solution = solve(problem, cells)
    while (error := abs(solution.time / exact - 1.0)) > accuracy:
        too_coarse, cells = cells, max(cells + 1, math.ceil(1.03 * cells * error / accuracy))
        solution = solve(problem, cells)
    while error < USED * accuracy and solution.cells > 1.1 * too_coarse + 1:
        cells = math.isqrt(max(too_coarse, 1) * solution.cells)
        candidate = solve(problem, cells)
        candidate_error = abs(candidate.time / exact - 1.0)
        if candidate_error > accuracy:
            too_coarse = cells
        else:
            solution, error = candidate, candidate_error
    return solution, error

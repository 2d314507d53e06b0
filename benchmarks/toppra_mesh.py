"""toppra on the same problem: the coarsest mesh close enough to a known time, and its processor time."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from importlib import metadata

from feedplan.constraints.problem import Problem
from feedplan.planners import toppra

VERSION = metadata.version("toppra")
# The part of the accuracy that the error of a mesh near the coarsest uses.
USED = 0.8


@dataclass(frozen=True)
class Solution:
    """What toppra found: `time` along the path [s], `cells` a piece, `processor` time [s]."""

    time: float
    cells: int
    processor: float


def solve(problem: Problem, cells: int) -> Solution:
    """Plan by collocation on `cells` cells in every piece; `processor` covers the whole planner."""
    begin = time.process_time()
    profile = toppra.plan(problem, cells=cells, scheme="collocation")
    return Solution(profile.time, cells, time.process_time() - begin)


def solve_to(problem: Problem, exact: float, accuracy: float) -> tuple[Solution, float]:
    """The coarsest mesh, to a fourth, whose time is within `accuracy` (relative) of `exact`, and its error.

    The error falls about as 1/cells: each try is sized by the one before, until one is accurate enough; where
    its error is much less than allowed the mesh is coarsened again between it and the last that was not.
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

"""The exact planner against toppra at equal accuracy of the time."""

from __future__ import annotations

import time

from benchmarks import toppra_mesh
from benchmarks.problems import random_problem
from benchmarks.results import Cell, Result
from feedplan.planners import bang_bang

NAME = "against-toppra"


def run(quick: bool = False) -> Result:
    """Refine toppra's mesh until its time is close enough to the exact one; compare computing times."""
    cases = [(100, seed, 1e-3) for seed in range(1 if quick else 3)]
    if not quick:
        cases += [(1000, 0, 1e-3), (100, 0, 1e-4)]
    rows: list[dict[str, Cell]] = []
    for pieces, seed, accuracy in cases:
        problem = random_problem(pieces, seed)
        times = []
        for _ in range(20):
            begin = time.perf_counter()
            profile = bang_bang.plan(problem)
            times.append(time.perf_counter() - begin)
        solution, error = toppra_mesh.solve_to(problem, profile.time, accuracy)
        rows.append(
            {
                "pieces": pieces,
                "seed": seed,
                "accuracy": accuracy,
                "exact time [s]": profile.time,
                "toppra error": error,
                "cells a piece": solution.cells,
                "feedplan [ms]": 1e3 * min(times),
                "toppra [ms]": 1e3 * solution.computing,
                "ratio": solution.computing / min(times),
            }
        )
    return Result(
        NAME,
        f"Exact planner against toppra {toppra_mesh.VERSION} at equal accuracy",
        tuple(rows),
        ("toppra: collocation on a mesh aligned with the knots, the coarsest found that is close enough.",),
    )

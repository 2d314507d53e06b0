"""Computing time of the exact planner against toppra's, at equal accuracy of the planned time."""

from __future__ import annotations

from functools import partial

from benchmarks import toppra_mesh
from benchmarks.problems import random_problem
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of
from feedplan.planners import bang_bang


def run(quick: bool = False) -> Result:
    """Refines toppra's mesh until its time is close enough to the exact one; compares computing times."""
    cases = [(100, seed, 1e-3) for seed in range(1 if quick else 5)]
    if not quick:
        cases += [(1000, 0, 1e-3), (100, 0, 1e-4)]
    rows: list[dict[str, Cell]] = []
    for pieces, seed, accuracy in cases:
        problem = random_problem(pieces, seed)
        profile = bang_bang.plan(problem)
        exact = best_of(partial(bang_bang.plan, problem), 50).processor
        solution, error = toppra_mesh.solve_to(problem, profile.time, accuracy)
        rows.append(
            {
                "pieces": pieces,
                "seed": seed,
                "accuracy": accuracy,
                "time [s]": profile.time,
                "toppra's error": error,
                "cells a piece": solution.cells,
                "feedplan [ms]": 1e3 * exact,
                "toppra [ms]": 1e3 * solution.processor,
                "ratio": solution.processor / exact,
            }
        )
    return Result(
        f"Exact planner against toppra {toppra_mesh.VERSION} at equal accuracy",
        tuple(rows),
        (
            "Processor times, best of 50 and one.",
            "toppra: collocation on a mesh aligned with the knots, the coarsest found that is close enough.",
        ),
    )

"""Cost of the exact planner per piece, from ten pieces to a million; it should be constant."""

from __future__ import annotations

from functools import partial

from benchmarks.problems import random_problem
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of
from feedplan.planners import bang_bang


def run(quick: bool = False) -> Result:
    """Plans one random spline of each size on one thread; the best of several calls."""
    rows: list[dict[str, Cell]] = []
    for pieces in (10, 100, 1000, 10_000) if quick else (10, 100, 1000, 10_000, 100_000, 1_000_000):
        problem = random_problem(pieces)
        best = best_of(partial(bang_bang.plan, problem), 3 if quick else 1_000_000 // pieces)
        profile = bang_bang.plan(problem)
        rows.append(
            {
                "pieces": pieces,
                "path time [s]": profile.time,
                "wall [ms]": 1e3 * best.wall,
                "CPU [ms]": 1e3 * best.processor,
                "CPU per piece [µs]": 1e6 * best.processor / pieces,
                "arcs a piece": len(profile) / pieces,
            }
        )
    return Result(
        "Exact planner, one thread: cost per quadratic piece",
        tuple(rows),
        ("The whole Python call, profile included; below about 1000 pieces the call itself dominates.",),
    )

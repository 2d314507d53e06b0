"""Cost of the exact planner per piece, from ten pieces to a million: it should not grow."""

from __future__ import annotations

import time

from benchmarks.problems import random_problem
from benchmarks.results import Cell, Result
from feedplan.planners import bang_bang

NAME = "planner-cost"


def run(quick: bool = False) -> Result:
    """Plan one random spline of each size, the best of several times, on one thread (one run)."""
    rows: list[dict[str, Cell]] = []
    for pieces in (10, 100, 1000, 10_000) if quick else (10, 100, 1000, 10_000, 100_000, 1_000_000):
        problem = random_problem(pieces)
        times = []
        for _ in range(3 if quick else max(3, min(20, 1_000_000 // pieces))):
            begin = time.perf_counter()
            profile = bang_bang.plan(problem)
            times.append(time.perf_counter() - begin)
        rows.append(
            {
                "pieces": pieces,
                "path time [s]": profile.time,
                "computing [ms]": 1e3 * min(times),
                "per piece [µs]": 1e6 * min(times) / pieces,
                "arcs a piece": len(profile) / pieces,
            }
        )
    return Result(
        NAME,
        "Exact planner, one thread: cost per quadratic piece",
        tuple(rows),
        ("The whole Python call, profile included; below about 1000 pieces the call itself dominates.",),
    )

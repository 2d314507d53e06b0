"""Computing time of the lower bound compared with that of its plan, and the gap between bound and plan."""

from __future__ import annotations

import math
from functools import partial

from benchmarks.curve_cost import FEEDS, cylindrical, random_curves
from benchmarks.end_to_end import PARTS, QUICK
from benchmarks.jerk import CURVES as JERK_CURVES
from benchmarks.jerk import MACHINE as JERK_MACHINE
from benchmarks.named import CURVES, FREE, butterfly, part, path_of
from benchmarks.problems import MACHINE, random_problem
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of_each
from feedplan._solvers import lower_bound, plan_bang_bang, plan_jerk_limited
from feedplan.constraints.problem import Problem, build_problem
from feedplan.geometry.path import Path as ToolPath
from feedplan.planners._jerk import jerk_limits
from feedplan.planners.jerk_limited import RESOLUTION
from feedplan.profile import SpeedProfile


def run(quick: bool = False) -> Result:
    """Times the native calls for plan and bound on one path of each kind: the best of five."""
    count = 300 if quick else 3000
    rows = [_row(f"quadratics, {pieces}", random_problem(pieces)) for pieces in _sizes(quick)]
    for kind, curve in random_curves(count).items():
        for feed in FEEDS:
            problem = build_problem(ToolPath.from_curve(curve, feed=feed), MACHINE)
            rows.append(_row(f"{kind}, {feed:g} mm/s", problem))
    rows.append(_row("joints of cubics, cylindrical", cylindrical(count // 10)))
    rows.append(
        _row("butterfly, 250 mm/s", build_problem(ToolPath.from_curve(butterfly(), feed=250.0), CURVES))
    )
    for name, _, blocks in PARTS:
        program, machine = part(name, blocks // (QUICK if quick else 10))
        rows.append(_row(name, build_problem(path_of(program, machine), machine)))
    for name, curve_of in JERK_CURVES.items():
        problem = build_problem(ToolPath.from_curve(curve_of(), feed=FREE), JERK_MACHINE)
        rows.append(_jerk_row(f"{name}, jerk-limited", problem))
    return Result(
        "Lower bound beside its plan",
        tuple(rows),
        (
            "The whole native calls. gap: how far the bound stays below the plan's time, as a part of it.",
            "jerk-limited: the bound on the grid is made with the plan; it costs what plans without it save.",
        ),
    )


def _sizes(quick: bool) -> tuple[int, ...]:
    return (1000, 10_000) if quick else (1000, 10_000, 100_000, 1_000_000)


def _row(name: str, problem: Problem) -> dict[str, Cell]:
    profile = SpeedProfile.of(plan_bang_bang(problem))
    calls = [partial(plan_bang_bang, problem), partial(lower_bound, problem, profile)]
    plan, bound = best_of_each(calls, 3 if len(problem.path) > 100_000 else 7)
    gap = 1.0 - lower_bound(problem, profile) / profile.time
    return _cells(name, problem, gap, plan.processor, bound.processor)


def _jerk_row(name: str, problem: Problem) -> dict[str, Cell]:
    call = partial(plan_jerk_limited, problem, jerk_limits(problem), RESOLUTION, 1e-6)
    alone, proven = best_of_each([partial(call, False), partial(call, True)], 7)
    native, _, _, bounds = call(True)
    gap = 1.0 - math.fsum(bounds) / SpeedProfile.of(native).time
    return _cells(name, problem, gap, alone.processor, proven.processor - alone.processor)


def _cells(name: str, problem: Problem, gap: float, plan: float, bound: float) -> dict[str, Cell]:
    """One row: processor times of `plan` and `bound` [s] as times per piece [µs]."""
    pieces = len(problem.path)
    return {
        "path": name,
        "pieces": pieces,
        "gap": gap,
        "plan [µs]": 1e6 * plan / pieces,
        "bound [µs]": 1e6 * bound / pieces,
        "bound/plan": bound / plan,
    }

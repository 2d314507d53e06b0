"""Methods with limits of jerk on published curves, compared with other solvers of the same problem."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.interpolate import make_interp_spline

from benchmarks.jerk_excess import jerk_excess
from benchmarks.named import FREE, butterfly, lemniscate, trefoil
from benchmarks.results import Cell, Result
from benchmarks.third_order import by_clarabel, by_ipopt, grid_of, pseudo_jerk
from benchmarks.timing import best_of, taken
from feedplan import Axis, Machine
from feedplan import plan as plan_path
from feedplan.constraints.problem import build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.planners import planner
from feedplan.profile import SpeedProfile

AXES = tuple(Axis(name, 250.0, 3000.0, max_jerk=50_000.0) for name in "XYZ")
MACHINE = Machine("jerk", AXES, chord_tolerance=float("inf"))
METHODS = ("jerk-limited", "ruckig", "s-curve", "bang-bang")
CURVES: dict[str, Callable[[], CompositeCurve]] = {
    "lemniscate": lemniscate,
    "trefoil": trefoil,
    "butterfly": butterfly,
}
# Other solvers get the grid of a plan with this accuracy; the butterfly's grid is too large for IPOPT.
ACCURACY = 1e-3
OTHERS = {"Clarabel": by_clarabel, "one stage (pseudo-jerk)": pseudo_jerk, "IPOPT": by_ipopt}
# Lengths of the winding path [mm]; the longest needs about a million intervals.
WINDING = (1e3, 1e4, 1e5)


def run(quick: bool = False) -> Result:
    """Runs every method on every curve, and the other solvers on the grid of a plan."""
    rows: list[dict[str, Cell]] = []
    for name, make in CURVES.items():
        if quick and name != "lemniscate":
            continue
        path = Path.from_curve(make(), feed=FREE)
        best = plan_path(path, MACHINE, "jerk-limited", accuracy=ACCURACY)
        again = partial(planner("jerk-limited", accuracy=ACCURACY), best.problem)
        spent = best_of(again, 5).wall
        row = partial(_row, name, best.time, spent)
        for method in METHODS:
            made = plan_path(path, MACHINE, method)
            excess = jerk_excess(made.problem, made.profile).worst if method != "bang-bang" else float("nan")
            rows.append(row(method, made.time, made.gap, excess, made.compute["plan"]))
        excess = jerk_excess(best.problem, best.profile).worst
        rows.append(row(f"jerk-limited, accuracy {ACCURACY:g}", best.time, best.gap, excess, spent))
        grid = grid_of(best.problem, best.profile)
        for solver, solve in OTHERS.items():
            if (name, solver) == ("butterfly", "IPOPT"):
                continue
            start = time.perf_counter()
            found = solve(grid)
            cost = time.perf_counter() - start
            rows.append(row(f"{solver}, the same grid", found, 0.0, 0.0, cost))
    rows.extend(_cost(length) for length in (WINDING[:1] if quick else WINDING))
    return Result(
        "Limits of jerk",
        tuple(rows),
        (
            "250 mm/s, 3000 mm/s², 50 000 mm/s³ of each axis, rest to rest; bang-bang limits no jerk.",
            f"ratio: of times, and of computing times, to those of jerk-limited at accuracy {ACCURACY:g},",
            "whose computing time is the best of five.",
            "excess: of any limit, between the places of the grid. Other solvers hold them at those alone.",
            "one stage: the row of jerk with the speed of the optimum without limits of jerk, by Clarabel.",
            "winding: a long space curve, in windows; its computing ratio: CPU seconds to the clock's.",
        ),
    )


def winding(length: float) -> CompositeCurve:
    """A C2 cubic spline of about this length [mm]; yaw and pitch of its direction are sums of sines."""
    s = np.arange(0.0, length + 0.5)
    yaw = 0.9 * np.sin(s / 3.1) + 0.3 * np.sin(s / 1.7) + 1.5 * np.sin(s / 7.3)
    pitch = 0.3 * np.sin(s / 1.7) + 0.5 * np.cos(s / 7.3)
    way = np.stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)], axis=1)
    return CompositeCurve.from_bspline(make_interp_spline(s, np.cumsum(way, axis=0)))


def _cost(length: float) -> dict[str, Cell]:
    """Time and memory that the planner needs for a long path."""
    problem = build_problem(Path.from_curve(winding(length), feed=FREE), MACHINE)
    plan, made = planner("jerk-limited"), list[SpeedProfile]()
    cost = taken(lambda: made.append(plan(problem)))
    (profile,) = made
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        **_row("winding", profile.time, cost.wall, "jerk-limited", profile.time, np.nan, np.nan, cost.wall),
        "computing ratio": cost.processor / cost.wall,
        "intervals": len(profile),
        "µs each": 1e6 * cost.wall / len(profile),
        "peak memory [MB]": memory,
    }


def _row(
    curve: str, best: float, unit: float, method: str, found: float, gap: float, excess: float, cost: float
) -> dict[str, Cell]:
    """One row of the table; its ratios are to the time `best` [s] and the computing time `unit` [s]."""
    return {
        "curve": curve,
        "method": method,
        "time [s]": found,
        "ratio": found / best,
        "gap [%]": 100.0 * gap,
        "excess": excess,
        "computing [s]": cost,
        "computing ratio": cost / unit,
    }

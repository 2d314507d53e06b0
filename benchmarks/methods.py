"""Every method on every problem with a name: time over the optimum, gap, cost, limits kept."""

from __future__ import annotations

import math

from benchmarks.named import NAMED
from benchmarks.results import Cell, Chart, Result
from feedplan import plan
from feedplan.audit import Audit, audit
from feedplan.errors import InfeasibleError, SolverError
from feedplan.planners import methods

NAME = "methods"
EXACT = "bang-bang"
# Pieces beyond which a solver on a mesh takes minutes: what it does on fewer says the same.
MOST_PIECES = {"casadi": 100, "clarabel": 1000, "toppra": 1000}
QUICK = ("lemniscate", "butterfly", "spline-100")


def run(quick: bool = False) -> Result:
    """Plan every problem by every method, the exact one first."""
    rows: list[dict[str, Cell]] = []
    for name, make in NAMED.items():
        if quick and name not in QUICK:
            continue
        source, machine = make()
        optimum = plan(source, machine, EXACT)
        cost = _cost(optimum.compute["plan"])
        for method in (EXACT, *(method for method in methods() if method != EXACT)):
            if len(optimum.path) > MOST_PIECES.get(method, math.inf):
                continue
            try:
                made = optimum if method == EXACT else plan(source, machine, method)
            except (InfeasibleError, SolverError) as error:
                raise RuntimeError(f"{method} finds no plan of {name}: {error}") from None
            worst = _worst(audit(made.problem, made.profile, machine, made.program))
            rows.append(
                {
                    "problem": name,
                    "pieces": len(made.path),
                    "method": method,
                    "time [s]": made.time,
                    "over optimum [%]": 100.0 * (made.time / optimum.time - 1.0),
                    "gap [%]": 100.0 * made.gap,
                    "computing [ms]": _cost(made.compute["plan"]),
                    "ratio": _cost(made.compute["plan"]) / cost,
                    "worst use": worst,
                }
            )
    return Result(
        NAME,
        "Every method on every problem",
        tuple(rows),
        (
            "over optimum: against the exact plan of the fitted path; gap: to the bound of the method's own.",
            "worst use: the limit that the profile uses most, by the audit; above 1 it is broken.",
            "computing: wall time of the planner alone; ratio: over that of the exact planner.",
        ),
        Chart("computing [ms]", "over optimum [%]", "method", "problem"),
    )


def _cost(seconds: float) -> float:
    return 1e3 * seconds


def _worst(verdict: Audit) -> str:
    """`Y acceleration 1.832`."""
    names = ("feed", "velocity", "acceleration", "chord", "jump")
    checks = [check for check in verdict.checks if check.name in names and math.isfinite(check.ratio)]
    worst = max(checks, key=lambda check: check.ratio)
    return f"{worst.axis or ''} {worst.name} {worst.ratio:.6g}".strip()

"""Every method on every named problem: time over the optimum, gap, computing time, worst use of a limit."""

from __future__ import annotations

import math

from benchmarks.named import NAMED
from benchmarks.results import Cell, Chart, Result
from feedplan import plan
from feedplan.audit import Audit, audit
from feedplan.errors import InfeasibleError, SolverError
from feedplan.planners import limits_jerk, methods, options_of

EXACT = "bang-bang"
# Greatest number of pieces for slow methods, which would take minutes for more.
MOST_PIECES = {"casadi": 100, "clarabel": 1000, "toppra": 100, "ruckig": 100}
QUICK = ("spline-10",)
# Relative accuracy and time limit [s] of the solvers on meshes.
ACCURACY, TIME_LIMIT = 1e-3, 10.0


def run(quick: bool = False) -> Result:
    """Plans every problem by every method, the exact one first."""
    rows: list[dict[str, Cell]] = []
    for name, make in NAMED.items():
        if quick and name not in QUICK:
            continue
        source, machine = make()
        optimum = plan(source, machine, EXACT)
        cost = 1e3 * optimum.compute["plan"]
        for method in (EXACT, *(method for method in methods() if method != EXACT)):
            if len(optimum.path) > MOST_PIECES.get(method, math.inf):
                continue
            if limits_jerk(method) and not all(math.isfinite(axis.max_jerk) for axis in machine.axes):
                continue
            has_mesh = "accuracy" in options_of(method)
            mesh = {"accuracy": ACCURACY, "time_limit": TIME_LIMIT} if has_mesh else {}
            try:
                made = optimum if method == EXACT else plan(source, machine, method, **mesh)
            except (InfeasibleError, SolverError) as error:
                rows.append(_row(name, len(optimum.path), method, str(error)))
                continue
            verdict = audit(made.problem, made.profile, machine, made.program)
            spent = 1e3 * made.compute["plan"]
            over = 100.0 * (made.time / optimum.time - 1.0)
            numbers = (made.time, over, 100.0 * made.gap, spent, spent / cost)
            rows.append(_row(name, len(made.path), method, _worst(verdict), numbers))
    return Result(
        "Every method on every problem",
        tuple(rows),
        (
            "over optimum: against the exact plan of the fitted path; gap: to the bound of the method's own.",
            "worst use: the limit that the profile uses most, by the audit; above 1 it is broken.",
            f"Solvers on meshes: accuracy {ACCURACY:g}, at most {TIME_LIMIT:g} s.",
            "computing: wall time of the planner alone; ratio: over that of the exact planner.",
        ),
        Chart("computing [ms]", "over optimum [%]", "method", "problem"),
    )


def _row(
    problem: str, pieces: int, method: str, said: str, numbers: tuple[float, ...] = ()
) -> dict[str, Cell]:
    """One row; without a plan `said` is the reason, and the numbers are left out."""
    names = ("time [s]", "over optimum [%]", "gap [%]", "computing [ms]", "ratio")
    shown = numbers or ("-",) * len(names)
    return {
        "problem": problem,
        "pieces": pieces,
        "method": method,
        **dict(zip(names, shown, strict=True)),
        "worst use": said,
    }


def _worst(verdict: Audit) -> str:
    """The limit that is used most, with its use: `Y acceleration 1.832`."""
    names = ("feed", "velocity", "acceleration", "chord", "jump")
    checks = [check for check in verdict.checks if check.name in names and math.isfinite(check.ratio)]
    worst = max(checks, key=lambda check: check.ratio)
    return f"{worst.axis or ''} {worst.name} {worst.ratio:.6g}".strip()

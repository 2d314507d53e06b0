"""Cost per setpoint of sampling and of the audit, for plans by bang-bang and by jerk-limited."""

from __future__ import annotations

from collections import deque
from functools import partial

import feedplan
from benchmarks.named import PROGRAMS, part
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of_each
from feedplan import Plan
from feedplan.audit import CHUNK, audit
from feedplan.planners import limits_jerk

METHODS = ("bang-bang", "jerk-limited")


def run(quick: bool = False) -> Result:
    """Plans each part by two methods, then samples and audits it three times."""
    rows: list[dict[str, Cell]] = []
    for name, (_, blocks) in PROGRAMS.items():
        program, machine = part(name, blocks // 10 if quick else blocks)
        for method in METHODS:
            plan = feedplan.plan(program, machine, method=method)
            rows.append({"part": name, "method": method, **cost(plan)})
    return Result(
        "Sampling and audit: processor time for each setpoint at 1 kHz",
        tuple(rows),
        ("profile: with the path against the program; setpoints: sampled once more, and that subtracted.",),
    )


def cost(plan: Plan) -> dict[str, float]:
    """Number of setpoints and phases, and processor times per setpoint, each the least of three [µs]."""
    judged = partial(
        audit, plan.problem, plan.profile, plan.machine, plan.program, jerk=limits_jerk(plan.method)
    )
    count = len(plan.setpoints())
    calls = (
        lambda: deque(plan.setpoints().chunks(CHUNK), maxlen=0),
        judged,
        lambda: judged(setpoints=plan.setpoints()),
    )
    sample, profile, whole = (1e6 * taken.processor / count for taken in best_of_each(calls, 3))
    return {
        "setpoints": count,
        "phases": len(plan.profile),
        "sample [µs]": sample,
        "profile [µs]": profile,
        "setpoints [µs]": whole - profile - sample,
        "sum [µs]": whole,
    }

"""Cost of the lower bound beside that of the plan that it certifies, and the gap that it leaves."""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.curve_cost import FEEDS, cylindrical, random_curves
from benchmarks.end_to_end import QUICK, example
from benchmarks.problems import MACHINE, random_problem
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of
from feedplan._solvers import lower_bound, plan_bang_bang
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.build import build_path
from feedplan.geometry.path import Path as ToolPath
from feedplan.machine.machine import Axis, Machine
from feedplan.profile import SpeedProfile
from feedplan.program.read import read_program

NAME = "certificate-cost"
BUTTERFLY = Path(__file__).parent / "curves" / "butterfly.json"
PARTS = (("vase", "vase", 500_000), ("head", "mill", 500_000), ("lettering", "router", 50_000))


def run(quick: bool = False) -> Result:
    """The native calls on one path of each kind, the best of five, plan and bound in one process."""
    count = 300 if quick else 3000
    rows = [_row(f"quadratics, {pieces}", random_problem(pieces)) for pieces in _sizes(quick)]
    for kind, curve in random_curves(count).items():
        for feed in FEEDS:
            problem = build_problem(ToolPath.from_curve(curve, feed=feed), MACHINE)
            rows.append(_row(f"{kind}, {feed:g} mm/s", problem))
    rows.append(_row("joints of cubics, cylindrical", cylindrical(count // 10)))
    rows.append(_row("butterfly, 250 mm/s", _butterfly()))
    with tempfile.TemporaryDirectory() as directory:
        for part, name, blocks in PARTS:
            file = Path(directory, f"{part}.ngc")
            file.write_text(example(part).program(blocks // (QUICK if quick else 10)), encoding="ascii")
            machine = Machine.load(name)
            path = build_path(read_program(file, machine), machine)
            rows.append(_row(f"{part}, {name}", build_problem(path, machine)))
    return Result(
        NAME,
        "Lower bound beside the exact plan",
        tuple(rows),
        ("The whole native calls. gap: how far the bound stays below the plan's time, as a part of it.",),
    )


def _sizes(quick: bool) -> tuple[int, ...]:
    return (1000, 10_000) if quick else (1000, 10_000, 100_000, 1_000_000)


def _butterfly() -> Problem:
    data = json.loads(BUTTERFLY.read_text(encoding="utf-8"))
    curve = CompositeCurve.from_nurbs(data["control_points"], data["knots"], data["degree"], data["weights"])
    machine = Machine("butterfly", (Axis("X", 250.0, 3000.0), Axis("Y", 250.0, 3000.0)))
    return build_problem(ToolPath.from_curve(curve, feed=250.0), machine)


def _row(name: str, problem: Problem) -> dict[str, Cell]:
    profile = SpeedProfile(*plan_bang_bang(problem))
    pieces = len(problem.path)
    times = 3 if pieces > 100_000 else 7
    plan = best_of(partial(plan_bang_bang, problem), times)
    bound = best_of(partial(lower_bound, problem, profile), times)
    return {
        "path": name,
        "pieces": pieces,
        "gap": 1.0 - lower_bound(problem, profile) / profile.time,
        "plan [µs]": 1e6 * plan.processor / pieces,
        "bound [µs]": 1e6 * bound.processor / pieces,
        "bound/plan": bound.processor / plan.processor,
    }

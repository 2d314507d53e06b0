"""The first plan of jerk-limited (time limit 0) against its best plan and s-curve; time after a plan."""

from __future__ import annotations

import tempfile
import time
from itertools import islice

from benchmarks.jerk import CURVES, MACHINE, winding
from benchmarks.named import FREE
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of
from feedplan import plan
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.plan_folder import write_plan
from feedplan.planners import planner
from feedplan.time_limit import FOLLOWING

# Feeds along a winding path [mm/s], and its length [mm].
FEEDS, LENGTH = (1.0, 10.0, 100.0), 100.0


def run(quick: bool = False) -> Result:
    """Times the first plan, the best plan and s-curve on curves with and without a feed."""
    rows = [_row(name, make(), FREE) for name, make in islice(CURVES.items(), 1 if quick else None)]
    if not quick:
        rows += [_row(f"winding at {feed:g} mm/s", winding(LENGTH), feed) for feed in FEEDS]
    return Result(
        "Without time",
        tuple(rows),
        (
            "first: what there is without time; each run is the faster one of a coarse grid and s-curve.",
            "computing: of the first plan, s-curve included, over the whole one's.",
            "following: audit, setpoints and report over computing the setpoints once, on short paths mostly",
            f"the report's constant time; {FOLLOWING:g} times that is kept for it.",
        ),
    )


def _row(name: str, curve: CompositeCurve, feed: float) -> dict[str, Cell]:
    made = plan(Path.from_curve(curve, feed=feed), MACHINE, "jerk-limited")
    whole, at_once = planner("jerk-limited"), planner("jerk-limited", time_limit=0.0)
    cost = best_of(lambda: whole(made.problem), 3).wall
    least = best_of(lambda: at_once(made.problem), 3).wall
    points = made.setpoints()
    sampled = best_of(lambda: sum(map(len, points.chunks())), 3).wall
    start = time.perf_counter()
    made.audit()
    with tempfile.TemporaryDirectory() as folder:
        write_plan(made, folder)
    following = time.perf_counter() - start
    return {
        "path": name,
        "best [s]": made.time,
        "first over best [%]": 100.0 * (at_once(made.problem).time / made.time - 1.0),
        "s-curve over best [%]": 100.0 * (planner("s-curve")(made.problem).time / made.time - 1.0),
        "computing": least / cost,
        "following": following / sampled,
    }

"""Gain of the optimum on fitted splines over corner transitions, as in Zhang et al. 2010, section 5."""

from __future__ import annotations

from benchmarks.named import part
from benchmarks.results import Cell, Result
from feedplan import Program, plan

# Our examples that resemble the parts in the paper's figure 8, with their number of blocks.
PARTS = {"vase": 20_000, "lettering": 10_000, "head": 20_000}
QUICK = 20  # times fewer blocks
MACHINE = "vase"  # the accelerations of section 4.3
# The paper gives neither feed nor period. None: the feed that the example programs.
FEEDS = (None, 200.0)  # [mm/s]
PERIODS = (0.001, 0.002)  # [s]
METHODS = {"constant velocity": "constant-velocity-transition", "arcs": "arc-transition"}


def run(quick: bool = False) -> Result:
    """Plans every part by the three methods at each feed and period, and audits the plans."""
    rows: list[dict[str, Cell]] = []
    for name, blocks in PARTS.items():
        program, _ = part(name, blocks // (QUICK if quick else 1), MACHINE)
        rows += [_row(name, program, feed, period) for feed in FEEDS for period in PERIODS]
    return Result(
        "Machining time of transitions at corners over that of the optimum on fitted splines",
        tuple(rows),
        (
            "gain: the method's time over the optimum's, less 1. Zhang et al. 2010 report 65 to 130 % over",
            "constant-velocity transition and 30 to 110 % over arc transition, without feeds and period.",
        ),
    )


def _row(part: str, program: Program, feed: float | None, period: float) -> dict[str, Cell]:
    optimum = plan(program, MACHINE, feed=feed, period=period)
    row: dict[str, Cell] = {
        "part": part,
        "moves": len(program),
        "feed [mm/s]": "programmed" if feed is None else feed,
        "T [ms]": 1e3 * period,
        "optimum [s]": optimum.time,
    }
    audits = [optimum.audit().ok]
    for name, method in METHODS.items():
        other = plan(program, MACHINE, method, feed=feed, period=period)
        row[f"{name} [s]"] = other.time
        row[f"{name} gain [%]"] = 100.0 * (other.time / optimum.time - 1.0)
        audits.append(other.audit().ok)
    row["audits"] = "ok" if all(audits) else "broken"
    return row

"""Heuristic against optimal: a finishing pass by the planners of controllers and by the exact planner.

Two passes over the vase of `vase.py`, a thousand points with creases, are planned on the bundled machine
`vase` by every method that needs no other package. For each method the script prints its time, the time over
that of the fastest plan that keeps all limits, the limit of an axis that it uses most, and its computing
time. A use above 1 breaks the limit: such a plan is faster than the machine allows, and its time cannot be
compared. Methods follow different paths within the tolerance.

    python examples/3_heuristic_against_optimal.py --output out/heuristic
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

from vase import program

import feedplan

WITHOUT_JERK = (
    "bang-bang",
    "tangential",
    "arc-transition",
    "constant-velocity-transition",
    "junction-deviation",
    "linuxcnc",
)
WITH_JERK = ("jerk-limited", "ruckig", "s-curve")
LIMITS = ("velocity", "acceleration", "jerk")
BLOCKS = 1000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("out/heuristic"), help="directory")
    output = parser.parse_args().output

    machine = feedplan.Machine.load("vase")
    passes = feedplan.read_program(program(BLOCKS), machine, name="vase.ngc")

    table = []
    for title, methods in (("Without limits of jerk", WITHOUT_JERK), ("With limits of jerk", WITH_JERK)):
        rows = feedplan.compare(passes, machine, methods)
        best = min(row.time for row in rows if row.time and row.audit.ok)
        print(f"{title:28}  time [s]  beyond the best [s]  most used axis limit       computing [s]")
        for row in rows:
            worst = max(
                (check for check in row.audit.checks if check.judged and check.name in LIMITS),
                key=lambda check: check.ratio,
            )
            beyond = f"{row.time - best:.2f}" if row.audit.ok else "limit broken"
            use = f"{worst.axis} {worst.name} × {worst.ratio:.5g}"
            computing = row.plan.compute["plan"]
            print(f"{row.method:28}  {row.time:8.2f}  {beyond:>19}  {use:25}  {computing:13.3f}")
            table.append((row.method, row.time, row.audit.ok, worst.axis, worst.name, worst.ratio, computing))
        print()

    output.mkdir(parents=True, exist_ok=True)
    file = output / "methods.csv"
    with file.open("w", encoding="ascii", newline="") as stream:
        names = ("method", "time [s]", "audit", "axis", "limit", "use", "computing [s]")
        csv.writer(stream).writerows([names, *table])
    print(f"The table is in {file}; `feedplan compare` makes a page of it.")


if __name__ == "__main__":
    main()

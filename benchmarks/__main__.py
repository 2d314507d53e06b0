"""Runs benchmarks by name: each prints a table and writes a JSON file and, in some cases, a chart."""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from rich.console import Console

from benchmarks import (
    against_copp,
    against_toppra,
    audit_cost,
    batch,
    certificate_cost,
    curve_cost,
    end_to_end,
    faster_path,
    interpolators,
    interrupts,
    jerk,
    kinematics_cost,
    methods,
    planner_cost,
    results,
    service,
    size,
    time_limit,
    zhang_comparison,
)

BENCHMARKS = {
    module.NAME: module.run
    for module in (
        methods,
        planner_cost,
        curve_cost,
        certificate_cost,
        audit_cost,
        against_toppra,
        against_copp,
        end_to_end,
        zhang_comparison,
        interpolators,
        kinematics_cost,
        jerk,
        time_limit,
        size,
        faster_path,
        interrupts,
        service,
        batch,
    )
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHMARKS)} (default all)")
    parser.add_argument("--quick", action="store_true", help="small sizes, some seconds")
    parser.add_argument(
        "--output", type=Path, default=Path("out/benchmarks"), help="directory of the JSON files"
    )
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(BENCHMARKS))
    if unknown:
        parser.error(f"there is no benchmark {unknown[0]!r}: use {', '.join(BENCHMARKS)}")

    if len(arguments.names) != 1 and not arguments.quick:
        # Each benchmark has its own process, so that it begins with an empty memory.
        for name in arguments.names or BENCHMARKS:
            command = [sys.executable, "-m", "benchmarks", name, "--output", str(arguments.output)]
            if status := subprocess.run(command, check=False).returncode:
                sys.exit(status)
        return
    # Without a terminal the width is enough for every table.
    console = Console() if sys.stdout.isatty() else Console(width=160)
    for name in arguments.names or BENCHMARKS:
        result = BENCHMARKS[name](arguments.quick)
        results.show(result, console)
        results.store(result, arguments.output)
        results.draw(result, arguments.output)


if __name__ == "__main__":
    main()

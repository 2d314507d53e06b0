"""Runs benchmarks by name: each prints a table and writes a JSON file and, in some cases, a chart."""

from __future__ import annotations

import argparse
import importlib
import subprocess
import sys
from pathlib import Path

from rich.console import Console

from benchmarks import results

# Each name is a module of this package ("-" for "_") whose function `run` returns the result.
NAMES = (
    "methods",
    "planner-cost",
    "curve-cost",
    "certificate-cost",
    "audit-cost",
    "against-toppra",
    "against-copp",
    "end-to-end",
    "zhang-comparison",
    "interpolators",
    "kinematics-cost",
    "jerk",
    "time-limit",
    "size",
    "faster-path",
    "interrupts",
    "service",
    "batch",
)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)} (default all)")
    parser.add_argument("--quick", action="store_true", help="small sizes, some seconds")
    parser.add_argument(
        "--output", type=Path, default=Path("out/benchmarks"), help="directory of the JSON files"
    )
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(NAMES))
    if unknown:
        parser.error(f"there is no benchmark {unknown[0]!r}: use {', '.join(NAMES)}")

    if len(arguments.names) != 1 and not arguments.quick:
        # Each benchmark has its own process, so that it begins with an empty memory.
        for name in arguments.names or NAMES:
            command = [sys.executable, "-m", "benchmarks", name, "--output", str(arguments.output)]
            if status := subprocess.run(command, check=False).returncode:
                sys.exit(status)
        return
    # A file or pipe gets a fixed width at which every table fits.
    console = Console() if sys.stdout.isatty() else Console(width=160)
    for name in arguments.names or NAMES:
        result = importlib.import_module(f"benchmarks.{name.replace('-', '_')}").run(arguments.quick)
        results.show(result, console)
        results.store(name, result, arguments.output)
        results.draw(name, result, arguments.output)


if __name__ == "__main__":
    main()

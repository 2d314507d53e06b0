"""Plan a first program through the Python API: a rosette of arcs, engraved in an aluminium plate.

Twenty-four petals meet in sharp corners around a full circle. The planner may round the corners within the
tolerance, and this script shows what each tolerance buys: the time, the share of it at the feed, and whether
the independent audit agrees. The setpoints of the last plan are written as a table.

    python examples/first_plan.py --output out/rosette
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

import feedplan

FEED = 6000.0  # [mm/min]


def rosette(petals: int = 24, radius: float = 30.0) -> str:
    """The part program: `petals` arcs that bulge outwards from a circle of `radius` [mm], and a circle."""
    corners = [
        (radius * math.cos(2.0 * math.pi * k / petals), radius * math.sin(2.0 * math.pi * k / petals))
        for k in range(petals + 1)
    ]
    # A sixth of a circle from corner to corner: its radius is its chord.
    petal = 2.0 * radius * math.sin(math.pi / petals)
    lines = ["(Rosette)", "G21 G90 G17 G94", "S12000 M3", "G0 Z5", f"G0 X{radius:.4f} Y0", "G1 Z-0.5 F600"]
    lines.append(f"F{FEED:g}")
    lines += [f"G3 X{x:.4f} Y{y:.4f} R{petal:.4f}" for x, y in corners[1:]]
    lines += ["G0 Z5", f"G0 X{0.6 * radius:.4f} Y0", "G1 Z-0.5 F600", f"F{FEED:g}"]
    lines += [f"G2 X{0.6 * radius:.4f} Y0 I{-0.6 * radius:.4f} J0", "G0 Z5", "M5", "M30"]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("out/rosette"), help="directory")
    output = parser.parse_args().output

    output.mkdir(parents=True, exist_ok=True)
    program = output / "rosette.ngc"
    program.write_text(rosette(), encoding="ascii")
    machine = feedplan.Machine.load("mill")

    print("tolerance [mm]  time [s]  at the feed  audit")
    for tolerance in (0.002, 0.01, 0.05, 0.2):
        plan = feedplan.plan(program, machine, tolerance=tolerance)
        setpoints = plan.setpoints(period=machine.period).all()
        speed = np.linalg.norm(setpoints.velocity, axis=1)
        at_feed = np.mean(speed > 0.999 * FEED / 60.0)
        audit = "ok" if plan.audit().ok else "a limit is broken"
        print(f"{tolerance:14g}  {plan.time:8.4f}  {at_feed:11.0%}  {audit}")

    table = output / "setpoints.csv"
    columns = np.column_stack((setpoints.t, setpoints.position, speed, setpoints.line))
    heading = ",".join(["t", *setpoints.axes, "speed", "line"])
    np.savetxt(table, columns, delimiter=",", header=heading, comments="", fmt="%.9g")
    print(f"{len(setpoints)} setpoints, every {1e3 * machine.period:g} ms, in {table}")


if __name__ == "__main__":
    main()

"""A first plan: a rosette of arcs, engraved in an aluminium plate by a small milling machine.

Twenty-four petals meet in sharp corners around a full circle. The planner may round the corners within the
tolerance. For each tolerance the script prints the time, its proven lower bound, the share of the time at the
programmed feed, and the verdict of the independent audit. It writes the last plan to a folder: plan,
setpoints and report.

    python examples/1_first_plan.py --output out/rosette
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import feedplan

FEED = 6000.0  # [mm/min]


def rosette(petals: int = 24, radius: float = 30.0) -> str:
    """The part program: `petals` arcs that bulge outwards from a circle of `radius` [mm], and a circle."""
    corners = [
        (radius * math.cos(2.0 * math.pi * k / petals), radius * math.sin(2.0 * math.pi * k / petals))
        for k in range(petals + 1)
    ]
    # A petal is a sixth of a circle, so its chord is equal to its radius.
    petal = 2.0 * radius * math.sin(math.pi / petals)
    lines = ["(Rosette)", "G21 G90 G17 G94", "S12000 M3", "G0 Z5", f"G0 X{radius:.4f} Y0", "G1 Z-0.5 F600"]
    lines.append(f"F{FEED:g}")
    lines += [f"G3 X{x:.4f} Y{y:.4f} R{petal:.4f}" for x, y in corners[1:]]
    lines += ["G0 Z5", f"G0 X{0.6 * radius:.4f} Y0", "G1 Z-0.5 F600", f"F{FEED:g}"]
    lines += [f"G2 X{0.6 * radius:.4f} Y0 I{-0.6 * radius:.4f} J0", "G0 Z5", "M5", "M30"]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--output", default="out/rosette", help="directory")
    output = parser.parse_args().output

    program = feedplan.read_program(rosette(), name="rosette.ngc")
    machine = feedplan.Machine.load("mill")

    print("tolerance [mm]  time [s]  lower bound [s]  at the feed  audit")
    for tolerance in (0.002, 0.01, 0.05, 0.2):
        plan = feedplan.plan(program, machine, tolerance=tolerance)
        speed = np.linalg.norm(plan.setpoints().all().velocity, axis=1)
        at_feed = np.mean(speed > 0.999 * FEED / 60.0)
        audit = "ok" if plan.audit().ok else "a limit is broken"
        print(f"{tolerance:14g}  {plan.time:8.4f}  {plan.lower_bound:15.4f}  {at_feed:11.0%}  {audit}")

    state = plan.at(0.5 * plan.time)
    place = ", ".join(f"{axis} {x:.3f} mm" for axis, x in zip(plan.path.axes, state.position, strict=True))
    print(f"Half-way in time the tool is at {place}, in line {state.line} of the program.")

    feedplan.write_plan(plan, output, formats=["npz", "csv"])
    print(f"The plan, its {plan.setpoints().count} setpoints and report.html are in {output}.")


if __name__ == "__main__":
    main()

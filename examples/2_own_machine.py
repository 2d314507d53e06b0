"""A machine of your own: a delta printer, whose kinematics is not in feedplan.

Three carriages on vertical rails hold the nozzle by rods of equal length. The script defines the positions of
the carriages for a position of the nozzle, registers this kinematics, writes a machine file with its name,
and plans three circles. All limits are those of the carriages. The script prints the time of each circle, the
greatest speed of the nozzle, and the use of the limits by each carriage.

    python examples/2_own_machine.py --output out/delta
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import feedplan
from feedplan.machine.kinematics import Kinematics, register
from feedplan.machine.numbers import sqrt

RADIUS, ROD = 120.0, 300.0  # radius of the circle through the rails, length of a rod [mm]
FEED = 30_000.0  # [mm/min]

MACHINE = """
name = "delta"
kinematics = "delta"
period = 0.001                 # servo period [s]
chord_tolerance = 0.02         # [mm]
home = [0.0, 0.0, 100.0]       # of the nozzle [mm]
"""
CARRIAGE = """
[[axes]]
name = "{name}"
max_velocity = 300.0           # [mm/s]
max_acceleration = 4000.0      # [mm/s^2]
"""


class Delta(Kinematics):
    """Carriages T1, T2, T3 for the nozzle at X, Y, Z. Each is √(rod² − distance²) above the nozzle;
    `distance` is the horizontal one between its rail and the nozzle."""

    tip_names, joint_names = ("X", "Y", "Z"), ("T1", "T2", "T3")

    def joints(self, tip: Sequence) -> tuple:
        x, y, z = tip
        angles = (math.radians(90.0 + 120.0 * k) for k in range(3))
        rails = [(RADIUS * math.cos(angle), RADIUS * math.sin(angle)) for angle in angles]
        return tuple(z + sqrt(ROD**2 - (x - a) * (x - a) - (y - b) * (y - b)) for a, b in rails)


def circle(radius: float) -> str:
    """The part program: a full circle about the origin at z = 0."""
    return (
        f"G21 G90 G17 G94\nG0 X{radius:g} Y0 Z5\nG1 Z0 F{FEED:g}\n"
        f"G3 X{radius:g} Y0 I{-radius:g} J0\nG0 Z100\nM2\n"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("out/delta"), help="directory")
    output = parser.parse_args().output

    register("delta", lambda axes, parameters: Delta())
    output.mkdir(parents=True, exist_ok=True)
    file = output / "delta.toml"
    file.write_text(MACHINE + "".join(CARRIAGE.format(name=f"T{k}") for k in (1, 2, 3)), encoding="ascii")
    machine = feedplan.Machine.load(file)

    print("radius [mm]  time [s]  greatest speed [mm/s]  use of velocity, acceleration  audit")
    for radius in (10.0, 40.0, 80.0):
        plan = feedplan.plan(circle(radius), machine)
        way = plan.trajectory
        speed = way.speed(np.linspace(0.0, way.length, 2000)).max()
        audit = plan.audit()
        use = ", ".join(
            f"{max(check.ratio for check in audit.checks if check.name == limit):.0%}"
            for limit in ("velocity", "acceleration")
        )
        print(f"{radius:11g}  {plan.time:8.4f}  {speed:21.1f}  {use:>29}  {'ok' if audit.ok else 'failed'}")

    feedplan.write_plan(plan, output)
    print(f"The setpoints of {', '.join(plan.setpoints().axes)} for the last circle are in {output}.")


if __name__ == "__main__":
    main()

"""Cost of kinematics per point and per piece: positions, exact derivatives, proven bounds of derivatives."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.results import Cell, Result
from benchmarks.timing import best_of
from feedplan._solvers import joint_enclosures
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.machine.path_derivatives import TipPieces, derivatives, positions
from feedplan.machine.rotary import RotaryChain, ToolVector
from feedplan.machine.singularities import joint_path

SEED = 1


def run(quick: bool = False) -> Result:
    """Times cubic pieces of a few mm on one machine of each type: the best of three, on one thread."""
    count = 500 if quick else 4000
    machines: dict[str, Kinematics] = {}
    for name in bundled_machines():
        machine = Machine.load(name)
        if not machine.is_plain:
            machines[name] = machine.inverse
            if isinstance(machine.inverse, RotaryChain) and len(machine.axes) == 5:
                machines[f"{name}, I J K"] = ToolVector(machine.inverse)
    return Result(
        "Kinematics: CPU per point or piece [µs]",
        tuple({"machine": name, **_row(machine, count)} for name, machine in machines.items()),
        (
            "Derivatives are exact to rounding, all orders up to the one given, at one point of each piece.",
            "Bounds are intervals proven over a piece; an interpolant of degree 9 needs one of order 11.",
        ),
    )


def _row(kinematics: Kinematics, count: int) -> dict[str, Cell]:
    generator = np.random.default_rng(SEED)
    names = kinematics.tip_names
    start = generator.uniform(20.0, 150.0, size=(count, 1, len(names)))
    scale = np.array([0.005 if name in "IJK" else 0.5 for name in names])
    start[..., [name in "IJK" for name in names]] /= 150.0
    points = start + np.cumsum(generator.normal(size=(count, 4, len(names))), axis=1) * scale
    width, half = np.full(count, 2.0), np.full(count, 0.5)

    tips = TipPieces.of(points, width, None)

    def cost(call: Callable[[], object]) -> float:
        return 1e6 * best_of(call, 3).processor / count

    return {
        "K": cost(partial(positions, kinematics, points[:, 0])),
        "to order 3": cost(partial(derivatives, kinematics, points, width, half, 3)),
        "to order 9": cost(partial(derivatives, kinematics, points, width, half, 9)),
        "bounds to 3": cost(partial(joint_enclosures, kinematics.recorded, tips, 3)),
        "bounds to 9": cost(partial(joint_enclosures, kinematics.recorded, tips, 9)),
        "joint path": cost(partial(joint_path, kinematics, points, width)),
    }

"""Kinematics of every bundled machine, and random tips that it reaches without being singular."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan import Machine
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.machine import bundled_machines
from feedplan.machine.rotary import RotaryChain, ToolVector


def all_kinematics() -> dict[str, Kinematics]:
    """Kinematics of every bundled machine; five-axis ones also programmed by tool direction, both poses."""
    found = {name: Machine.load(name).inverse for name in bundled_machines()}
    for name, kinematics in list(found.items()):
        if isinstance(kinematics, RotaryChain) and len(kinematics.joint_names) == 5:
            found[f"{name} by direction"] = ToolVector(kinematics)
            found[f"{name} by direction, other pose"] = ToolVector(kinematics, -1.0)
    return found


def random_tips(kinematics: Kinematics, count: int, seed: int) -> NDArray[np.float64]:
    """Tips (count, axes) at X, Y from 20 to 150 mm, away from every axis of the bundled machines."""
    generator = np.random.default_rng(seed)
    tips = generator.uniform(20.0, 150.0, size=(count, len(kinematics.tip_names)))
    for column, name in enumerate(kinematics.tip_names):
        if name in "ABC":
            tips[:, column] = generator.uniform(-170.0, 170.0, size=count)
        if name in "IJK":
            tips[:, column] = generator.uniform(0.2, 1.0, size=count)
    return tips

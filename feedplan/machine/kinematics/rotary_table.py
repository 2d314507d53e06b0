"""Four-axis machines: X, Y, Z and one rotary table (C about a vertical axis, or A or B about a horizontal
one); the tip follows the part."""

from __future__ import annotations

from feedplan.machine.axis import Axis
from feedplan.machine.parameters import Parameters
from feedplan.machine.rotary import RotaryChain, build_chain


def build(axes: tuple[Axis, ...], parameters: Parameters) -> RotaryChain:
    """Keys `table` (letter, C by default), its `pivot_…` in machine coordinates and `tool_length` [mm]."""
    table = parameters.choice("table", "C", ("A", "B", "C"))
    return build_chain(axes, parameters, tables=(table,), heads=())

"""Head-table machines: the head swivels (B about Y, or A about X), the table turns (C, or the other of A, B).

Tool direction in the part, head B and table C: (sin b cos c, sin b sin c, cos b).
"""

from __future__ import annotations

from feedplan.machine.axis import Axis
from feedplan.machine.parameters import Parameters
from feedplan.machine.rotary import RotaryChain, build_chain, require_pointing


def build(axes: tuple[Axis, ...], parameters: Parameters) -> RotaryChain:
    """Keys `head`, `table` (letters, B and C by default), `tool_length`, and for each letter `pivot_…` [mm]:
    the head's from the gauge point (its pivot distance is z), the table's in machine coordinates."""
    head = parameters.choice("head", "B", ("A", "B"))
    table = parameters.choice("table", "C", ("A", "B", "C"))
    require_pointing(table, head, parameters.machine)
    return build_chain(axes, parameters, tables=(table,), heads=(head,))

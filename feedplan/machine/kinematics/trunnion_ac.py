"""Table-table machines with a trunnion A about X that carries a table C about Z: the AC trunnion.

Tool direction in the part: (sin a sin c, −sin a cos c, cos a).
"""

from __future__ import annotations

from feedplan.machine.axis import Axis
from feedplan.machine.parameters import Parameters
from feedplan.machine.rotary import RotaryChain, build_chain


def build(axes: tuple[Axis, ...], parameters: Parameters) -> RotaryChain:
    """Keys `tool_length`, `pivot_a` (a point of the trunnion's axis), `pivot_c` (of the table's) [mm]."""
    return build_chain(axes, parameters, tables=("A", "C"), heads=())

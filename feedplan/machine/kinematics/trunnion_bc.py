"""Table-table machines with a trunnion B about Y that carries a table C about Z: the BC trunnion.

Tool direction in the part: (sin b cos c, sin b sin c, cos b).
"""

from __future__ import annotations

from feedplan.machine.axis import Axis
from feedplan.machine.parameters import Parameters
from feedplan.machine.rotary import RotaryChain, build_chain


def build(axes: tuple[Axis, ...], parameters: Parameters) -> RotaryChain:
    """Keys `tool_length`, `pivot_b` (a point of the trunnion's axis), `pivot_c` (of the table's) [mm]."""
    return build_chain(axes, parameters, tables=("B", "C"), heads=())

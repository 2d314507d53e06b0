"""Head-head machines: both rotary axes carry the tool, as a fork head C with a swivel A (or B) inside it.

Tool direction, fork C and swivel A: (sin a sin c, −sin a cos c, cos a).
"""

from __future__ import annotations

from feedplan.machine.axis import Axis
from feedplan.machine.parameters import Parameters
from feedplan.machine.rotary import RotaryChain, build_chain, require_pointing


def build(axes: tuple[Axis, ...], parameters: Parameters) -> RotaryChain:
    """Keys `fork` and `swivel` (letters, C and A by default), `tool_length`, and for each letter `pivot_…`
    [mm] from the gauge point: the swivel's z is the pivot distance."""
    fork = parameters.choice("fork", "C", ("A", "B", "C"))
    swivel = parameters.choice("swivel", "A", ("A", "B"))
    require_pointing(fork, swivel, parameters.machine)
    return build_chain(axes, parameters, tables=(), heads=(fork, swivel))

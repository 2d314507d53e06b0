"""Types of the native module."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str

def read_gcode(
    source: bytes,
    name: str,
    places: NDArray[np.float64],
    machine_axes: str,
    block_delete: bool,
    max_moves: int,
) -> dict[str, Any]: ...

"""Arrays in records: types of real numbers, whole numbers and truth values, and what makes them read-only.

Docstrings give shapes and units.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Flags: TypeAlias = NDArray[np.bool_]


def lock_arrays(record: object) -> None:
    """Makes the arrays of a record read-only: whoever writes into one gets an error of NumPy."""
    for name, value in vars(record).items():
        if isinstance(value, np.ndarray) and value.flags.writeable:
            view = value.view()
            view.flags.writeable = False
            vars(record)[name] = view

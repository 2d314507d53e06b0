"""Arrays in records: types for real numbers, whole numbers and truth values; making them read-only.

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
    """Makes the arrays of a record read-only: writing into them raises NumPy's error."""
    for name, value in vars(record).items():
        if isinstance(value, np.ndarray) and value.flags.writeable:
            view = value.view()
            view.flags.writeable = False
            vars(record)[name] = view

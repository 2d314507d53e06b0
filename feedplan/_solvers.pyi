"""Types of the native module."""

import numpy as np
from numpy.typing import NDArray

__version__: str

def csv_rows(values: NDArray[np.float64], last: NDArray[np.int32]) -> bytes: ...

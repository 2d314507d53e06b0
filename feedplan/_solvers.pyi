"""Types of the native module."""

import numpy as np
from numpy.typing import NDArray

__version__: str

def fit_points(
    points: NDArray[np.float64],
    tolerance: float,
    max_chord: float,
    max_curvature: float,
    corner_angle: float,
) -> tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.uint32]
]: ...

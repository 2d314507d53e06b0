"""What planners with a limit of jerk share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.errors import InputError


def jerk_limits(problem: Problem) -> NDArray[np.float64]:
    """The jerk limits (axes,) [mm/s³]; 1 for an axis without one that does not move.

    Raises InputError for an axis that moves without one.
    """
    limits = problem.max_jerk.copy()
    for column in np.flatnonzero(~np.isfinite(limits)):
        if np.ptp(problem.curve.control_points[:, column]) > 0:
            raise InputError(
                f"axis {problem.axes[column]} has no limit of jerk: give it max_jerk in the machine file, or "
                "plan with a method that needs none, such as bang-bang"
            )
        limits[column] = 1.0
    return limits

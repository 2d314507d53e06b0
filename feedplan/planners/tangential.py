"""Speed limits as usual, acceleration limited along the path only, whatever a curve does to the axes.

The methods that Zhang et al. 2010 (section 1) argue against: trapezoids, S-curves and the like with a
tangential acceleration. Here it is the greatest that the direction of motion allows, min over the axes
of A_k/|t_k|, so that the axes keep their limits on lines and break them on curves, where v²/ρ comes on
top of it. The audit says where. Speeding up and slowing down pull an axis to opposite sides: each has the
limits A_k of those.
"""

from __future__ import annotations

import numpy as np

from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.planners._look_ahead import look_ahead
from feedplan.planners._segments import CurvePlaces, both_ways
from feedplan.profile import SpeedProfile


def plan(problem: Problem) -> SpeedProfile:
    """The fastest trapezoids. Raises SolverError, InfeasibleError as sentences."""
    return look_ahead(problem, problem.junction_speed, along_only)


def along_only(at: CurvePlaces) -> tuple[Floats, Floats]:
    """No limit across the path."""
    return both_ways(at.limits, at.tangent), np.full(len(at.tangent), np.inf)

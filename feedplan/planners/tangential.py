"""Trapezoids with the acceleration limited only along the path; the acceleration of the axes by curvature is
ignored.

These are the methods that Zhang et al. 2010 (section 1) argue against: trapezoids, S-curves and the like with
a tangential acceleration. Here it is the greatest that the direction of motion allows, min over the axes of
A_k/|t_k|. So the axes keep their limits on lines and exceed them on curves, where v²/ρ is added; the audit
names these places. Speeding up and slowing down accelerate an axis in opposite directions, so each uses the
limits A_k of its direction.
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
    """The acceleration along the path, and no limit across it."""
    return both_ways(at.limits, at.tangent), np.full(len(at.tangent), np.inf)

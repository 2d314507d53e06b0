"""Constant-velocity transition: corners of lines are passed at a speed that the axes can turn in one period.

Source: Ye & Zhao, Study on control algorithm for micro-line continuous interpolation, China Mechanical
Engineering 15(15), 1354–1356, known here by what Zhang et al. 2010 say of it (sections 1 and 5). From one
interpolation period T to the next a velocity may change by A_k T, so a corner where the unit tangent jumps by
ΔT is passed at min over the axes of A_k T/|ΔT_k|; where the limits of an axis differ by direction A_k is the
lesser of both.

The speed is constant for a period before and after the corner, so that no other acceleration adds to the
jump; a line between two corners takes two periods at least. The second differences of setpoints at the
period T then keep every limit: where a corner lies a share θ of a period beside a setpoint they hold 1 −
θ of the jump and at most θ²/2 of an acceleration beside it.

The path is the program's own. Beside curves corners are stops; on curves the acceleration is shared as on
blend arcs.
"""

from __future__ import annotations

import numpy as np

from feedplan.constraints.junction import junction_limit
from feedplan.constraints.problem import Problem
from feedplan.geometry.corners import Corners
from feedplan.planners._look_ahead import look_ahead, shared_acceleration
from feedplan.profile import SpeedProfile

CORNERS = Corners.PROGRAMMED


def plan(problem: Problem) -> SpeedProfile:
    """The fastest trapezoids that pass corners so. Raises SolverError, InfeasibleError as sentences."""
    # 0 between runs, infinite where there is no corner.
    speed = junction_limit(problem.path, problem.limits("acceleration").min(axis=0) * problem.period)
    hold = np.where(np.isfinite(speed) & (speed > 0.0), problem.period, 0.0)
    return look_ahead(problem, np.minimum(speed, problem.junction_speed), shared_acceleration, hold)

"""Constant-velocity transition: trapezoids that pass a corner at the speed at which the axis velocities can
change in one interpolation period.

Source: Ye & Zhao, Study on control algorithm for micro-line continuous interpolation, China Mechanical
Engineering 15(15), 1354–1356, as described by Zhang et al. 2010 (sections 1 and 5). From one interpolation
period T to the next the velocity of axis k may change by A_k T. So a corner where the unit tangent jumps by
Δt is passed at min over the axes of A_k T/|Δt_k|; A_k is the smaller limit where the limits of an axis differ
by direction.

The speed is constant for a period before and after the corner, so that no other acceleration adds to the
jump; so a line between two corners takes at least two periods. The second differences of setpoints at the
period T then keep every limit: if the corner is at a fraction θ of a period after a setpoint, a second
difference contains 1 − θ of the jump, and at most θ²/2 of an acceleration after the constant speed.

The path is the program itself. Next to curves, corners are stops; on curves the acceleration is divided as on
blend arcs (`shared_acceleration`).
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
    """The fastest trapezoids with these corner speeds. Raises SolverError, InfeasibleError as sentences."""
    # 0 between runs, infinite where there is no corner.
    speed = junction_limit(problem.path, problem.limits("acceleration").min(axis=0) * problem.period)
    hold = np.where(np.isfinite(speed) & (speed > 0.0), problem.period, 0.0)
    return look_ahead(problem, np.minimum(speed, problem.junction_speed), shared_acceleration, hold)

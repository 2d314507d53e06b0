"""Arc transition: trapezoids on a path where an arc within the tolerance replaces each corner of two lines.

Source: Lv, Zhang, Yang & Ye, Study on the method of increasing turning velocity during CNC continuous
machining, Manufacturing Technology & Machine Tool 2008(7), 79–83, as described by Zhang et al. 2010 (sections
1 and 5). With the turn θ and the tolerance d the radius r is d/(1/cos(θ/2) − 1), less where the lines are too
short. On the arc the centripetal acceleration v²/r limits the speed v, so that the axes keep their limits in
every direction (the smaller one where they differ by direction) and a tangential acceleration remains
possible (`shared_acceleration`).

The arcs are part of the path (`Corners.ARCS`); other curves of the path are planned by the same rule.
"""

from __future__ import annotations

from feedplan.constraints.problem import Problem
from feedplan.geometry.corners import Corners
from feedplan.planners._look_ahead import look_ahead, shared_acceleration
from feedplan.profile import SpeedProfile

CORNERS = Corners.ARCS


def plan(problem: Problem) -> SpeedProfile:
    """The fastest trapezoids over lines and arcs. Raises SolverError, InfeasibleError as sentences."""
    return look_ahead(problem, problem.junction_speed, shared_acceleration)

"""The jerk limits of a problem, lowered by the jerk error of the joints' interpolants."""

from __future__ import annotations

import numpy as np

from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.errors import SolverError
from feedplan.profile import SpeedProfile

# Third derivatives of joints are compared only at the ends of phases; inside, the error may be this factor
# greater.
INSIDE = 1.5
# Limits may be exceeded by this share without another plan.
HELD = 2e-7


def jerk_limits(problem: Problem) -> Floats:
    """The jerk limits (axes,) [mm/s³]; 1 for an axis that has no limit and does not move.

    Raises SolverError for an axis that moves and has no jerk limit.
    """
    limits = problem.max_jerk.copy()
    for column in np.flatnonzero(~np.isfinite(limits)):
        if np.ptp(problem.curve.control_points[:, column]) > 0:
            raise SolverError(
                f"axis {problem.axes[column]} has no limit of jerk: give it max_jerk in the machine file, or "
                "plan with a method that needs none, such as bang-bang"
            )
        limits[column] = 1.0
    return limits


def lowered_limits(problem: Problem, limits: Floats, profile: SpeedProfile) -> Floats | None:
    """Jerk `limits` (axes,) [mm/s³] minus the jerk error of the joints' interpolants (`Problem.joints`) on a
    profile, at least half the limits.

    None if that error is at most the share `HELD` of the limits. The interpolants' error in jerk is |error of
    the third derivative| × u̇³; their error in acceleration is negligible.
    """
    if not problem.words:
        return None
    piece = np.concatenate([profile.piece, profile.piece])
    u = np.concatenate([profile.u0, profile.u1])
    rate_sq = np.concatenate([profile.p0, profile.p1])
    rate_sq = np.where(np.isfinite(rate_sq), rate_sq, 0.0)
    error = np.abs(problem.derivatives(piece, u, 3)[3] - problem.curve.evaluate(piece, u, 3)[3])
    missed = INSIDE * np.nanmax(error * rate_sq[:, None] ** 1.5, axis=0)
    if (missed <= HELD * limits).all():
        return None
    return np.asarray(np.maximum(limits - missed, 0.5 * limits))

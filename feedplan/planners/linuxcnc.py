"""LinuxCNC's trajectory planner: trapezoids over lines with joined points and arcs at corners, with one
acceleration along the path.

Source: LinuxCNC 2.9, `emccanon.cc` (points of G1 moves that are within G64's Q of a line are left out: the
naive CAM detector), `tp.c`, `tc.c` and `blendmath.c` (R. W. Ellenberg). Each corner of two lines becomes an
arc within G64's P that touches both lines and takes at most half of each. On it, half of the acceleration is
for the direction along the path and √3/2 across it, as on the program's arcs (`on_arcs`). The speed allows
the tool to stop within the `depth` segments after the one in motion ([TRAJ] ARC_BLEND_OPTIMIZATION_DEPTH),
and no block takes less than 1.02 servo periods. `max_velocity` and `max_acceleration` are limits along the
path ([TRAJ] MAX_LINEAR_VELOCITY, MAX_LINEAR_ACCELERATION).

A segment that may overlap the next one has half of the acceleration over its whole length (`tc.c`:
`tcGetTangentialMaxAccel`). Here this is the last segment before a stop, unless a rapid and another move meet
there.

Differences from LinuxCNC: corners of arcs and splines are rounded as the path builder does. Other corners are
stops where LinuxCNC overlaps segments, as on rotary axes. G64 without P uses the tolerance of the plan, where
LinuxCNC leaves the path by up to a quarter of a line.
"""

from __future__ import annotations

import numpy as np

from feedplan.arguments import whole
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.geometry.corners import Corners
from feedplan.planners._look_ahead import look_ahead, shared_acceleration
from feedplan.planners._queue import Queue, along_path
from feedplan.planners._segments import CurvePlaces
from feedplan.profile import SpeedProfile

CORNERS = Corners.JOINED
DEPTH = 50
PERIODS = 1.02


def plan(
    problem: Problem,
    depth: int = DEPTH,
    max_velocity: float | None = None,
    max_acceleration: float | None = None,
) -> SpeedProfile:
    """Trapezoids over lines and arcs; `depth` segments are known ahead; limits along the path.

    Raises InputError for wrong values of these, SolverError and InfeasibleError, all as sentences.
    """
    whole(depth, "the depth", "a whole number from 1")
    queue = Queue(
        ahead=depth,
        velocity=along_path("velocity", max_velocity, "mm/s"),
        acceleration=along_path("acceleration", max_acceleration, "mm/s²"),
        least_time=PERIODS * problem.period,
        part=_part(problem),
    )
    return look_ahead(problem, problem.junction_speed, on_arcs, queue=queue)


def _part(problem: Problem) -> Floats:
    """The share of the acceleration along the path in each piece: 0.5 in the last segment before a stop."""
    path = problem.path
    last, rapid = path.runs[1:] - 1, np.isinf(path.feed)
    overlaps = path.tolerance[last] != 0.0
    overlaps[:-1] &= rapid[last[:-1]] == rapid[path.runs[1:-1]]
    # Pieces of the same moves are one segment.
    segment = np.cumsum((np.diff(path.move, axis=0, prepend=path.move[:1]) != 0).any(axis=1))
    return np.where(np.isin(segment, segment[last[overlaps]]), 0.5, 1.0)


def on_arcs(at: CurvePlaces) -> tuple[Floats, Floats]:
    """Across the path √3/2 of the acceleration that every direction allows; along the path what remains at
    the greatest speed.

    This is half of it (`shared_acceleration`) where the curvature limits the speed, and more where the feed
    limits it (`tc.c`: `tcUpdateCircleAccRatio`).
    """
    along, across = shared_acceleration(at)
    with np.errstate(divide="ignore"):
        used = np.minimum(at.speed**2 / at.radius, across) / (2.0 * along[0])
    return 2.0 * along * np.sqrt(1.0 - used**2), across

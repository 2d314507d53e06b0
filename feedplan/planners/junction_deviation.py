"""Trapezoids with look-ahead and junction deviation, as grbl plans.

Source: grbl 1.1, `planner.c` (S. K. Jeon). A corner is passed at the speed of a circle that touches both
lines and comes within δ of the corner, though the tool follows the lines: v² = a δ s/(1 − s), s =
cos(turn/2), with a = min over the axes of A_k/|j_k| in the direction j of the jump, A_k being the limit of
axis k towards j_k. δ is grbl's setting
$11, 0.010 mm by default. Klipper's `square_corner_velocity` is the same formula by the speed v₉₀ at
right angles: a δ = v₉₀² (√2 − 1).

The velocity jumps at the corner. No period enters, so the jump can be more than the axes do in one: the audit
says at which lines. On curves, which these controllers follow by short lines, the speed is √(a/κ) with the
acceleration in the direction of the normal, and the tangential one comes on top of it.
"""

from __future__ import annotations

import math

import numpy as np

from feedplan.arguments import number, positive
from feedplan.constraints.problem import Problem
from feedplan.geometry.corners import Corners
from feedplan.geometry.joints import end_edges, tangent_jumps
from feedplan.planners._look_ahead import look_ahead
from feedplan.planners._segments import Array, both_ways, in_direction
from feedplan.profile import SpeedProfile

CORNERS = Corners.PROGRAMMED

GRBL_DEVIATION = 0.01


def plan(
    problem: Problem, deviation: float = GRBL_DEVIATION, square_corner_velocity: float | None = None
) -> SpeedProfile:
    """The fastest trapezoids with corners by `deviation` [mm], or by `square_corner_velocity` [mm/s].

    Raises InputError for those, SolverError and InfeasibleError, all as sentences.
    """
    for name, value, unit in (
        ("junction deviation", deviation, "mm"),
        ("square corner velocity", square_corner_velocity, "mm/s"),
    ):
        if value is not None:
            number(value, f"the {name}", f"a positive number [{unit}]", positive, unit)
    return look_ahead(problem, corner_speed(problem, deviation, square_corner_velocity), each_direction)


def corner_speed(problem: Problem, deviation: float, square_corner_velocity: float | None = None) -> Array:
    """Speed (n + 1,) [mm/s] at the ends of the pieces, infinite where no corner is."""
    speed = np.full(len(problem.path) + 1, np.inf)
    if len(problem.path) < 2:
        return speed
    corner = np.flatnonzero((tangent_jumps(problem.curve) > 0.0).any(axis=1))
    start, end = end_edges(problem.curve)
    into, out = end[corner], start[corner + 1]
    jump = out / np.linalg.norm(out, axis=1)[:, None] - into / np.linalg.norm(into, axis=1)[:, None]
    size = np.linalg.norm(jump, axis=1)
    if square_corner_velocity is None:
        factor = deviation * in_direction(problem.limits("acceleration"), jump / size[:, None])
    else:
        factor = np.full(len(corner), square_corner_velocity**2 * (math.sqrt(2.0) - 1.0))
    # |jump| = 2 sin(turn/2), and 1 − s = sin²(turn/2)/(1 + s) keeps its digits at small turns.
    sine_sq = np.minimum(0.25 * size**2, 1.0)
    s = np.sqrt(1.0 - sine_sq)
    speed[corner + 1] = np.sqrt(factor * s * (1.0 + s) / sine_sq)
    return speed


def each_direction(tangent: Array, normal: Array, limits: Array) -> tuple[Array, Array]:
    """The greatest acceleration along the tangent alone, and along the normal alone."""
    return both_ways(limits, tangent), in_direction(limits, normal)

"""Trapezoids with look-ahead and junction deviation, as grbl, Klipper and Marlin plan.

Sources: grbl 1.1, `planner.c` (S. K. Jeon); Klipper, `toolhead.py` (K. O'Connor); Marlin 2.1, `planner.cpp`.
The tool follows the lines, and passes a corner at the speed that is possible on a circle that touches both
lines and comes within δ of the corner: v² = a δ s/(1 − s), s = cos(turn/2), with a = min over the axes of
A_k/|j_k|, where j is the direction of the velocity jump and A_k the acceleration limit of axis k in the
direction of j_k. δ is grbl's setting $11, 0.010 mm by default. Klipper's `square_corner_velocity` gives the
same formula by the speed v₉₀ at right angles: a δ = v₉₀² (√2 − 1). With Marlin's classic jerk, no axis
velocity jumps by more than `axis_jumps`; for an axis that reverses, the greater of its speeds before and
after counts.

In Klipper the circle touches a line of length L at most in its middle: v² ≤ a L cot(turn/2)/2. In Marlin
lines shorter than 1 mm that turn by less than 45° are chords of an arc: v² ≤ a L/turn.

Controllers divide arcs into lines, and pass from line to line by the same formula. Without `arc_tolerance` or
`arc_segment` the speed on curves is √(a/κ), with the acceleration limit a in the direction of the normal; the
tangential acceleration is added to it. They know a number of blocks ahead (`_queue`).

At a corner axis velocities jump by more than the axes can change in a period; the audit names the lines.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import get_args

import numpy as np

from feedplan.arguments import number, one_of, positive, refuse, whole
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.geometry.corners import Corners
from feedplan.geometry.joints import end_edges, tangent_jumps
from feedplan.planners._junctions import Junctions, ShortLines
from feedplan.planners._look_ahead import look_ahead
from feedplan.planners._queue import Chords, Queue, along_path
from feedplan.planners._segments import CurvePlaces, Rule, both_ways, in_direction
from feedplan.profile import SpeedProfile

CORNERS = Corners.PROGRAMMED

GRBL_DEVIATION = 0.01


def plan(
    problem: Problem,
    deviation: float = GRBL_DEVIATION,
    square_corner_velocity: float | None = None,
    axis_jumps: Sequence[float] | None = None,
    blocks: int | None = None,
    arc_tolerance: float | None = None,
    arc_segment: float | None = None,
    short_lines: ShortLines = "free",
    cruise_ratio: float = 0.0,
    max_velocity: float | None = None,
    max_acceleration: float | None = None,
) -> SpeedProfile:
    """The fastest trapezoids, with corner speeds by `square_corner_velocity` [mm/s] or by `axis_jumps` [mm/s]
    of X, Y and Z if one of these is given, else by `deviation` [mm].

    `blocks` is the number of blocks that the controller holds, including the one in motion (None: all). Arcs
    are divided into lines within `arc_tolerance` [mm], or of the length `arc_segment` [mm]. `short_lines` is
    the speed limit between short lines: none ("free"), by "half" of each line as in Klipper, or by the "arc"
    of which they are chords as in Marlin. `cruise_ratio` is the share of the distance between speeding up and
    slowing down that has constant speed. `max_velocity` [mm/s] and `max_acceleration` [mm/s²] are limits
    along the path.

    Raises InputError for wrong values of these, SolverError and InfeasibleError, all as sentences.
    """
    for name, value, unit in (
        ("junction deviation", deviation, "mm"),
        ("square corner velocity", square_corner_velocity, "mm/s"),
        ("arc tolerance", arc_tolerance, "mm"),
        ("arc segment", arc_segment, "mm"),
    ):
        if value is not None:
            number(value, f"the {name}", f"a positive number [{unit}]", positive, unit)
    if square_corner_velocity is not None and axis_jumps is not None:
        raise InputError("square_corner_velocity and axis_jumps are rules for the same corners: give one")
    if blocks is not None:
        whole(blocks, "the number of blocks", "a whole number from 2", 2)
    one_of(short_lines, "rule for short_lines", get_args(ShortLines))
    number(cruise_ratio, "the cruise ratio", "a number from 0 to less than 1", lambda given: 0 <= given < 1)
    chopped = arc_tolerance is not None or arc_segment is not None
    queue = Queue(
        ahead=None if blocks is None else blocks - 1,
        chords=Chords(arc_tolerance, arc_segment) if chopped else None,
        velocity=along_path("velocity", max_velocity, "mm/s"),
        acceleration=along_path("acceleration", max_acceleration, "mm/s²"),
        cruise=cruise_ratio,
    )
    jumps = None if axis_jumps is None else _of_axes(problem, axis_jumps)
    junctions = Junctions(deviation, square_corner_velocity, jumps, short_lines, queue.acceleration)
    rule = each_direction if queue.chords is None else _from_chord_to_chord(junctions, queue.chords)
    return look_ahead(problem, corner_speed(problem, junctions), rule, queue=queue)


def corner_speed(problem: Problem, junctions: Junctions) -> Floats:
    """The greatest speed (n + 1,) [mm/s] at the ends of the pieces, infinite where there is no corner."""
    speed = np.full(len(problem.path) + 1, np.inf)
    curve = problem.curve
    corner = np.flatnonzero((tangent_jumps(curve) > 0.0).any(axis=1))
    start, end = end_edges(curve)
    into, out = (edge / np.linalg.norm(edge, axis=1)[:, None] for edge in (end[corner], start[corner + 1]))
    control, offsets = curve.control_points, curve.offsets
    length = np.linalg.norm(control[offsets[1:] - 1] - control[offsets[:-1]], axis=1)
    square = junctions.square(into, out, length[corner], length[corner + 1], problem.limits("acceleration"))
    speed[corner + 1] = np.sqrt(square)
    return speed


def each_direction(at: CurvePlaces) -> tuple[Floats, Floats]:
    """The greatest acceleration along the tangent and along the normal, each as if the other were 0."""
    return both_ways(at.limits, at.tangent), in_direction(at.limits, at.normal)


def _from_chord_to_chord(junctions: Junctions, chords: Chords) -> Rule:
    """The rule on curves that are divided into lines: the speed from chord to chord, as an acceleration
    across the path."""

    def rule(at: CurvePlaces) -> tuple[Floats, Floats]:
        half = chords.half_turn(at.radius)
        ahead, aside = np.cos(half)[:, None] * at.tangent, np.sin(half)[:, None] * at.normal
        with np.errstate(invalid="ignore"):
            chord = 2.0 * at.radius * np.sin(half)
            square = junctions.square(ahead - aside, ahead + aside, chord, chord, at.limits)
            across = np.where(np.isinf(at.radius), np.inf, square / at.radius)
        return both_ways(at.limits, at.tangent), across

    return rule


def _of_axes(problem: Problem, jumps: Sequence[float]) -> list[float]:
    """The jumps of X, Y and Z in the order of the problem's axes, infinite for other axes. Raises InputError
    for wrong values."""
    good = isinstance(jumps, (list, tuple)) and len(jumps) == 3
    if not good:
        raise refuse("axis_jumps", jumps, "three positive numbers [mm/s], for X, Y and Z")
    given = [
        number(jump, "a jump of axis_jumps", "a positive number [mm/s]", positive, "mm/s") for jump in jumps
    ]
    return [given["XYZ".index(axis)] if axis in ("X", "Y", "Z") else math.inf for axis in problem.axes]

"""The native path builder's input besides moves: how each move is followed, and the machine's limits."""

from __future__ import annotations

from dataclasses import dataclass

from feedplan.arrays import Flags, Floats, Integers
from feedplan.curves.composite import CompositeCurve


@dataclass(frozen=True, eq=False)
class Rules:
    """How moves (n,) become a path.

    Per move: `feed` is the greatest speed along it [mm/s]; `tolerance` the distance allowed between path and
    program, 0 for the exact path, `fit_tolerance` the share of it that the fit may use [mm]; `halt`: the tool
    stands still after the move; `joints`: its coordinates are positions of joints, which have a travel.
    `splines` are the program's splines, which begin exactly at the starts of their moves and end at their
    targets; `name` is the program's name, for messages.

    `max_velocity` [mm/s] and `max_acceleration` [mm/s²] (axes,) are used to round corners, `travel` (axes, 2)
    is the range of joint positions; `jump`: corners may be passed with a velocity jump. `exact_tolerance`
    [mm] is the tolerance of arcs and helices. Chords longer than `max_chord` [mm] stay lines. Chains are
    broken where their curvature exceeds `corner_acceleration` [mm/s²] / feed², with a feed of at most
    `max_speed` [mm/s], and stay smooth where they turn by less than `corner_angle` [rad]. `corners` is a
    value of `Corners`.
    """

    name: str
    feed: Floats
    tolerance: Floats
    fit_tolerance: Floats
    halt: Flags
    joints: Flags
    max_velocity: Floats
    max_acceleration: Floats
    travel: Floats
    jump: bool
    exact_tolerance: float
    max_chord: float
    corner_acceleration: float
    max_speed: float
    corner_angle: float
    corners: str
    splines: CompositeCurve | None = None


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion along a path of the same program; a faster path is fitted to it.

    `run` (r, 2) are the first and last move of each run of that path; `start` (r + 1,) the offsets of the
    runs in `place` (m,), which are ascending fractions of a run from 0 to 1; `speed_sq` (m,) the square of
    the speed there [mm²/s²]; `second` and `third` (m, axes) the derivatives that the path should have there
    [1/mm, 1/mm²]; `max_jerk` (axes,) [mm/s³], infinite where the motion has no jerk limit.
    """

    run: Integers
    start: Integers
    place: Floats
    speed_sq: Floats
    second: Floats
    third: Floats
    max_jerk: Floats

"""What the native builder of paths needs besides moves: how each is followed, and limits of the machine."""

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
    `splines` are those of the program, from exactly where moves start to their targets; `name` is that of the
    program, for messages.

    `max_velocity` [mm/s], `max_acceleration` [mm/s²] (axes,) are for rounding corners, `travel` (axes, 2) is
    where joints may be; `jump`: corners may be passed at a speed. `exact_tolerance` [mm] is that of arcs and
    helices. Chords longer than `max_chord` [mm] stay lines; chains are broken where their curvature exceeds
    `corner_acceleration` [mm/s²] over the square of their feed, at most `max_speed` [mm/s], and are smooth
    where they turn by less than `corner_angle` [rad]. `corners` is a value of `Corners`.
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
    """A motion along a path of the same program, by which a faster path is fitted.

    `run` (r, 2) first and last move of each run of that path; `start` (r + 1,) where its places begin in
    `place` (m,), ascending parts of the run from 0 to 1; `speed_sq` (m,) the square of the speed there
    [mm²/s²]; `second` and `third` (m, axes) the derivatives that the path should have there [1/mm, 1/mm²];
    `max_jerk` (axes,) [mm/s³], infinite where the motion has no limit of jerk.
    """

    run: Integers
    start: Integers
    place: Floats
    speed_sq: Floats
    second: Floats
    third: Floats
    max_jerk: Floats

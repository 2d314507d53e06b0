"""What the native builder of paths needs besides moves: how each is followed, and limits of the machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.curves.composite import CompositeCurve

Floats = NDArray[np.float64]


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
    halt: NDArray[np.bool_]
    joints: NDArray[np.bool_]
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

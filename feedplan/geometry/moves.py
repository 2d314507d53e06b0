"""What the native builder makes a path of: moves in the axes of the path, and how to follow them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feedplan.curves.composite import CompositeCurve

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves (n,) as a `Program` has them, with what holds for each.

    `feed` is the greatest speed along the move [mm/s]; `tolerance` the distance allowed between path and
    program, 0 for the exact path, `fit_tolerance` the share of it that the fit may use [mm]; `halt`: the tool
    stands still after the move; `joints`: its coordinates are positions of joints, which have a travel.
    `arc_plane` (k, 2) are the axes of the plane of each arc, it turns from the first to the second at a
    positive angle; `arc_centre` (k, 2) the centre in the plane. `name` and `line` are for messages.
    """

    name: str
    start: Floats
    kind: NDArray[np.uint8]
    target: Floats
    feed: Floats
    line: NDArray[np.int32]
    tolerance: Floats
    fit_tolerance: Floats
    halt: NDArray[np.bool_]
    joints: NDArray[np.bool_]
    arc_move: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    arc_plane: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))
    arc_centre: Floats = field(default_factory=lambda: np.empty((0, 2)))
    arc_angle: Floats = field(default_factory=lambda: np.empty(0))
    spline_move: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    spline_pieces: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    splines: CompositeCurve | None = None
    change_move: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    change_start: Floats = field(default_factory=lambda: np.empty((0, 0)))


@dataclass(frozen=True, eq=False)
class Rules:
    """How moves become a path.

    `max_velocity` [mm/s], `max_acceleration` [mm/s²] (axes,) are for rounding corners, `travel` (axes, 2) is
    where joints may be; `jump`: corners may be passed at a speed. `exact_tolerance` [mm] is that of arcs and
    helices. Chords longer than `max_chord` [mm] stay lines; chains are broken where their curvature exceeds
    `corner_acceleration` [mm/s²] over the square of their feed, at most `max_speed` [mm/s], and are smooth
    where they turn by less than `corner_angle` [rad]. `corners` is a value of `Corners`.
    """

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

"""Speed limits where pieces meet: stops at run ends, an allowed velocity jump at corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.geometry.path import Path

# A unit tangent computed from control points of size |C| with an edge of length e carries a rounding error
# of a few eps·|C|/e; a smaller turn than this many times that is no corner.
ROUNDING_MARGIN = 32.0
SMOOTH_TURN = 1e-9


def junction_limit(path: Path, max_velocity_jump: NDArray[np.float64]) -> NDArray[np.float64]:
    """Greatest speed (n + 1,) [mm/s] at the ends of the pieces.

    0 at the ends of runs. Within a run, where the unit tangent jumps by ΔT, min over the axes of
    `max_velocity_jump` [mm/s] / |ΔT|, and infinite where it does not jump.
    """
    points = path.curve.by_piece
    edge_out, edge_in = points[:-1, 2] - points[:-1, 1], points[1:, 1] - points[1:, 0]
    length_out, length_in = np.linalg.norm(edge_out, axis=1), np.linalg.norm(edge_in, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.abs(edge_in / length_in[:, None] - edge_out / length_out[:, None])
        size = np.abs(points[1:, 0]).max(axis=1, initial=0.0)
        noise = ROUNDING_MARGIN * np.finfo(float).eps * size / np.minimum(length_in, length_out)
        turn[turn <= (SMOOTH_TURN + noise)[:, None]] = 0.0
        allowed = np.where(turn > 0, max_velocity_jump / turn, np.inf).min(axis=1)
    limit = np.full(len(path) + 1, np.inf)
    # A vanishing edge has no tangent; such a cusp is left to the planner.
    limit[1:-1] = np.where((length_in > 0) & (length_out > 0), allowed, np.inf)
    limit[path.runs] = 0.0
    return limit

"""The change of the direction of motion where the pieces of a curve meet."""

from __future__ import annotations

from functools import reduce

import numpy as np

from feedplan.arrays import Floats
from feedplan.curves.composite import CompositeCurve

# The rounding error of a unit tangent is a few eps·|C|/e, for control points of size |C| and an edge of
# length e. A turn is no corner if it is at most SMOOTH_TURN plus ROUNDING_MARGIN·eps·|C|/e.
ROUNDING_MARGIN = 32.0
SMOOTH_TURN = 1e-9

# Edges shorter than this share of the size of a control polygon, as next to a cusp, have no direction.
VANISHING_EDGE = 1e-12


def tangent_jumps(curve: CompositeCurve) -> Floats:
    """T₊ − T₋| of each axis at the joints between pieces (n − 1, axes); T are the unit tangents.

    0 where the jump may be rounding, NaN next to a piece without length. At a cusp T is the direction in
    which the motion ends or begins.
    """
    edge_in, edge_out = end_edges(curve)
    edge_out, edge_in = edge_out[:-1], edge_in[1:]
    points = curve.control_points[curve.offsets[1:-1]]
    length_out, length_in = np.linalg.norm(edge_out, axis=1), np.linalg.norm(edge_in, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        jump: Floats = np.abs(edge_in / length_in[:, None] - edge_out / length_out[:, None])
        size = _greatest(points)
        noise = ROUNDING_MARGIN * np.finfo(float).eps * size / np.minimum(length_in, length_out)
        jump[jump <= (SMOOTH_TURN + noise)[:, None]] = 0.0
    return jump


def end_edges(curve: CompositeCurve) -> tuple[Floats, Floats]:
    """The edges of the control polygons that give the tangents at both ends of each piece, each (n, axes).

    They are the first and the last edge with a length; 0 on a piece without length.
    """
    control, degree = curve.control_points, curve.degree
    first, last = curve.offsets[:-1], curve.offsets[1:] - 1
    start, end = control[first + 1] - control[first], control[last] - control[last - 1]
    if len(curve) == 0:
        return start, end
    # No piece is larger than the whole curve. So if all edges are long compared with the whole curve, the
    # size of each piece need not be computed.
    if min(_greatest(edge).min() for edge in (start, end)) > VANISHING_EDGE * (control.max() - control.min()):
        return start, end
    greatest, least = (f.reduceat(control, first) for f in (np.maximum, np.minimum))
    shortest = VANISHING_EDGE * _greatest(greatest - least)
    for edge, near, sign in ((start, first, 1), (end, last, -1)):
        rows = np.flatnonzero(_greatest(edge) <= shortest)
        for step in range(1, int(degree.max()) + 1):
            more = rows[degree[rows] > step]
            edge[more] = sign * (control[near[more] + sign * (step + 1)] - control[near[more] + sign * step])
            edge[rows[degree[rows] <= step]] = 0.0
            rows = more[_greatest(edge[more]) <= shortest[more]]
    return start, end


def _greatest(vectors: Floats) -> Floats:
    """The greatest component of each vector (n, axes); by axis, because NumPy is slow along short rows."""
    return reduce(np.maximum, np.abs(vectors.T))

"""Polynomials that stand in for a joint's motion q'(u), with a proven distance from it.

q'' is interpolated at n Chebyshev points and integrated from the exact q' at the part's start. With
c ≥ |q^(n+2)|/(n + 1)! over a part of width h in u (`along.proxy_constants`), by the interpolation error
formula

    |q'' − proxy''| ≤ ε₂ = 2 (n + 1) c (h/4)^n,   |q' − proxy'| ≤ ε₁ = h ε₂,

so a joint's acceleration q' s + q'' p is met within ε₁ |s| + ε₂ p. q'' is fitted rather than q', because
differentiating a fit loses n² of its accuracy. Parts are halved until ε₂ is small enough. What rounding adds
is not in ε: some 1e-14 of the largest |q''| of the part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan.curves.hodograph import chebyshev, from_chebyshev
from feedplan.machine.along import derivatives, proxy_constants
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.survey import DEEPEST, STRETCH_DEPTH, STRETCH_PARTS

Array = NDArray[np.float64]
Tolerance = Callable[[NDArray[np.int64], Array], Array]


@dataclass(frozen=True)
class Proxies:
    """Stand-ins on m parts, in order of the path.

    `piece` (m,) and `part` (m, 2) say of which piece which fractions; `width` (m,) is their length in u.
    `slope` (m, n + 1, joints) are the Bernstein coefficients of q' [mm or deg per unit of u], degree n;
    `slope_error` and `curvature_error` (m, joints) are ε₁ and ε₂. They are infinite on parts that could not
    be made small enough: there K is singular, or so nearly that 2^-30 of a piece is too wide.
    """

    piece: NDArray[np.int64]
    part: Array
    width: Array
    slope: Array
    slope_error: Array
    curvature_error: Array

    def __len__(self) -> int:
        return len(self.piece)


def build_proxies(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    curvature_tolerance: ArrayLike | Tolerance,
    nodes: int = 9,
    weights: Array | None = None,
) -> Proxies:
    """Stand-ins of degree `nodes` with ε₂ within a tolerance, (joints,) for all.

    Or the tolerance is a function of `piece` (m,) and `part` (m, 2) that gives it for each part, (m, joints).
    To keep accelerations within a share η of a joint's limit A, allow ε₂ = η A / p where p is the greatest u̇²
    that feed and speed limits allow there. Where it is 0 the part is halved.
    """
    piece = np.arange(len(width))
    part = np.tile([0.0, 1.0], (len(width), 1))
    done: list[tuple[NDArray[np.int64], Array, Array]] = []
    for depth in range(DEEPEST + 1):
        own = None if weights is None else weights[piece]
        c = proxy_constants(kinematics, control_points[piece], width[piece], nodes, part, own)
        length = width[piece] * (part[:, 1] - part[:, 0])
        with np.errstate(over="ignore", invalid="ignore"):
            bound = 2 * (nodes + 1) * c * (length[:, None] / 4) ** nodes * (1 + 1e-13)
        allowed = curvature_tolerance
        good = (bound <= (allowed(piece, part) if callable(allowed) else np.asarray(allowed))).all(axis=1)
        unbounded = np.isinf(c).any(axis=1)
        stretch = np.bincount(piece[unbounded], minlength=len(width))[piece] > STRETCH_PARTS
        given_up = ~good & ((unbounded & stretch & (depth >= STRETCH_DEPTH)) | (depth == DEEPEST))
        bound[given_up] = np.inf
        good |= given_up
        done.append((piece[good], part[good], bound[good]))
        piece, part = np.repeat(piece[~good], 2), part[~good]
        if not len(piece):
            break
        middle = part.mean(axis=1)
        part = np.stack([part[:, 0], middle, middle, part[:, 1]], axis=1).reshape(-1, 2)
    piece, part, bound = (np.concatenate(columns) for columns in zip(*done, strict=True))
    order = np.lexsort((part[:, 0], piece))
    piece, part, bound = piece[order], part[order], bound[order]
    length = width[piece] * (part[:, 1] - part[:, 0])
    slope = _slopes(kinematics, control_points, width, piece, part, length, nodes, weights)
    return Proxies(piece, part, length, slope, bound * length[:, None] * (1 + 1e-15), bound)


def _slopes(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    piece: NDArray[np.int64],
    part: Array,
    length: Array,
    nodes: int,
    weights: Array | None,
) -> Array:
    """Bernstein coefficients of q': q'' through its values at the Chebyshev points, integrated."""
    curvature = [
        _derivative(kinematics, control_points, width, piece, part, t, 2, weights) for t in chebyshev(nodes)
    ]
    start = _derivative(kinematics, control_points, width, piece, part, 0.0, 1, weights)
    with np.errstate(invalid="ignore"):
        coefficients = from_chebyshev(np.stack(curvature, axis=1))
        steps = coefficients * (length / nodes)[:, None, None]
        return np.concatenate([start[:, None], start[:, None] + np.cumsum(steps, axis=1)], axis=1)


def _derivative(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    piece: NDArray[np.int64],
    part: Array,
    t: float,
    order: int,
    weights: Array | None,
) -> Array:
    fraction = part[:, 0] + t * (part[:, 1] - part[:, 0])
    own = None if weights is None else weights[piece]
    values: Array = derivatives(kinematics, control_points[piece], width[piece], fraction, order, own)[order]
    return values

"""Polynomials that interpolate a joint's motion q'(u), with a proven error bound.

q'' is interpolated at n Chebyshev points and integrated from the exact q' at the part's start. With
c ≥ |q^(n+2)|/(n + 1)! over a part of width h in u, by the interpolation error formula

    |q'' − interpolant''| ≤ ε₂ = 2 (n + 1) c (h/4)^n,   |q' − interpolant'| ≤ ε₁ = h ε₂,

so the error of a joint's acceleration q' s + q'' p is at most ε₁ |s| + ε₂ p. Parts are halved until ε₂ is
small enough. Rounding is not included in ε: it adds about 1e-14 of the largest |q''| of the part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from feedplan._solvers import joint_interpolants as native_joint_interpolants
from feedplan.arrays import Flags, Floats, Integers
from feedplan.curves.speed_polynomial import SPEED_NODES, chebyshev, interpolation, to_bernstein
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.path_derivatives import TipPieces, contiguous

# The greatest relative error of interpolated squares of speeds.
SPEED_SHARE = 1e-9


@dataclass(frozen=True)
class SquareOfSpeed:
    """The square of a speed that is to be interpolated on the chosen `pieces` (n,).

    It is the speed of a motion with these control points (n, d + 1, axes), or with `turning` the rate [deg]
    at which a direction of any length turns. The weights are those of the tip.
    """

    control_points: Floats
    pieces: Flags
    turning: bool = False


@dataclass(frozen=True)
class Accuracy:
    """The required accuracy of interpolants: errors of accelerations below 1e-9 of their limits.

    For each joint: `acceleration`, the smaller limit of both directions, `least_velocity` and
    `greatest_velocity`. For each piece: `feed` [mm/s], control points `linear` (n, d + 1, k) of the tool in
    X, Y, Z, and whether the tool `moves` in them. The speeds that feed and velocities allow are estimated;
    the accuracy holds at every lower speed.
    """

    acceleration: Floats
    least_velocity: Floats
    greatest_velocity: Floats
    feed: Floats
    linear: Floats
    moves: Flags
    squares: list[SquareOfSpeed]
    speed_share: float = SPEED_SHARE

    @property
    def speed_nodes(self) -> Floats:
        """The places in [0, 1] at which squares of speeds are interpolated."""
        return chebyshev(SPEED_NODES)

    @property
    def speed_between(self) -> Floats:
        """Places halfway between them, where the error of interpolation is greatest."""
        return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(SPEED_NODES + 1) / SPEED_NODES))

    @property
    def speed_interpolation(self) -> Floats:
        """The matrix that turns values at `speed_nodes` into values at `speed_between`."""
        return np.ascontiguousarray(interpolation(SPEED_NODES, self.speed_between))


@dataclass(frozen=True)
class Interpolants:
    """Interpolants on m parts, in order of the path.

    `piece` (m,) and `part` (m, 2) are the piece of each part and its first and last fraction of it; `width`
    (m,) is the part's length in u. `slope` (m, n + 1, joints) are the Bernstein coefficients of q' [mm or deg
    per unit of u], degree n; `slope_error` and `curvature_error` (m, joints) are ε₁ and ε₂. They are infinite
    on parts that could not be made small enough, because K is singular there or 2^-30 of a piece is still too
    wide.
    """

    piece: Integers
    part: Floats
    width: Floats
    slope: Floats
    slope_error: Floats
    curvature_error: Floats

    def __len__(self) -> int:
        return len(self.piece)


def joint_interpolants(
    kinematics: Kinematics,
    control_points: ArrayLike,
    width: ArrayLike,
    tolerance: ArrayLike | Accuracy,
    nodes: int = 9,
    weights: ArrayLike | None = None,
) -> Interpolants:
    """Interpolants of degree `nodes` with ε₂ within `tolerance`: (joints,), one number, or an Accuracy."""
    tips = TipPieces.of(control_points, width, weights)
    if not isinstance(tolerance, Accuracy):
        tolerance = contiguous(np.broadcast_to(tolerance, len(kinematics.joint_names)))
    piece, part, slope, error = native_joint_interpolants(
        kinematics.recorded, tips, chebyshev(nodes), to_bernstein(nodes), tolerance
    )
    length = tips.width[piece] * (part[:, 1] - part[:, 0])
    return Interpolants(piece, part, length, slope, error * length[:, None] * (1 + 1e-15), error)

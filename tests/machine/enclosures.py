"""Proven bounds of the derivatives of joints over whole pieces, computed by the native module."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import joint_enclosures
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.path_derivatives import TipPieces, contiguous
from feedplan.machine.singularities import Bounds


@dataclass(frozen=True)
class Enclosures(Bounds):
    @property
    def bounded(self) -> NDArray[np.bool_]:
        """Where both ends are finite."""
        return np.isfinite(self.lo) & np.isfinite(self.hi)

    @property
    def magnitude(self) -> NDArray[np.float64]:
        """The greatest absolute value inside each bound."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))


def enclosures(
    kinematics: Kinematics,
    control_points: ArrayLike,
    width: ArrayLike,
    order: int,
    parts: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> Enclosures:
    """Bounds (order + 1, n, joints) of q^(k)(u)/k! for every u of each piece, rounding included.

    `parts` (n, 2) are fractions of the pieces in [0, 1]; without them the whole pieces count. A bound is
    infinite where K is singular on the part, or too near to a singularity to decide. Angles are known up to
    whole turns; over a part they are continuous.
    """
    pieces = TipPieces.of(control_points, width, weights)
    lo, hi = joint_enclosures(kinematics.recorded, pieces, order, contiguous(parts))
    return Enclosures(np.moveaxis(lo, 1, 0), np.moveaxis(hi, 1, 0))

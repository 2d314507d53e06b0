"""Joint motion along pieces of a tip path: positions, and exact derivatives at given places.

A piece is given by Bézier points (n, d + 1, axes) of the tip, in the order of `Kinematics.tip_names`, with
the parameter u in [0, width]; with weights (n, d + 1) it is rational. The recorded formula of the kinematics
is evaluated natively on Taylor series in u.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from feedplan._solvers import joint_derivatives, joint_positions
from feedplan.arrays import Floats
from feedplan.machine.kinematics import Kinematics


@dataclass(frozen=True)
class TipPieces:
    """Pieces of a tip path in the form that the native module takes."""

    control_points: Floats
    width: Floats
    weights: Floats | None

    @classmethod
    def of(cls, control_points: ArrayLike, width: ArrayLike, weights: ArrayLike | None) -> TipPieces:
        """Makes pieces from arrays of any kind."""
        return cls(contiguous(control_points), contiguous(width), contiguous(weights))


def positions(kinematics: Kinematics, tip: ArrayLike) -> Floats:
    """Joint positions (…, joints) [mm, deg] for tips (…, axes); angles as K gives them, not continuous."""
    tips = contiguous(tip)
    found = joint_positions(kinematics.recorded, tips.reshape(-1, tips.shape[-1]))
    return found.reshape(*tips.shape[:-1], -1)


def derivatives(
    kinematics: Kinematics,
    control_points: ArrayLike,
    width: ArrayLike,
    fraction: ArrayLike,
    order: int = 3,
    weights: ArrayLike | None = None,
) -> Floats:
    """q, q', …, q^(order) (order + 1, n, joints) at u = fraction · width of each piece.

    Exact up to rounding; not finite where K is singular. For several places of a piece, repeat the piece.
    """
    pieces = TipPieces.of(control_points, width, weights)
    found = joint_derivatives(kinematics.recorded, pieces, contiguous(fraction), order)
    return np.ascontiguousarray(np.moveaxis(found, 1, 0))


@overload
def contiguous(values: None) -> None: ...
@overload
def contiguous(values: ArrayLike) -> Floats: ...
def contiguous(values: ArrayLike | None) -> Floats | None:
    """A C-contiguous array of floats, as the native module needs it."""
    return None if values is None else np.ascontiguousarray(values, dtype=np.float64)

"""Joint positions along a whole tip path: continuous angles, singular places, and overrun travel ends.

Pieces are halved until interval arithmetic proves for each part that K is differentiable there and that no
angle turns by half a turn or more. Where this cannot be proven down to 2^-30 of a piece, there is a singular
place: K is singular within that distance. A travel end is overrun where the joint's proven range is beyond
it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from feedplan._solvers import joint_path as native_joint_path
from feedplan.arrays import Floats, Integers
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.path_derivatives import TipPieces, contiguous, derivatives

TURN = 360.0


@dataclass(frozen=True)
class Bounds:
    """Lower and upper bounds `lo` ≤ `hi`, arrays of the same shape; rounding is included."""

    lo: Floats
    hi: Floats

    @property
    def middle(self) -> Floats:
        """Values near the middle of the bounds; NaN where they are infinite."""
        with np.errstate(invalid="ignore"):
            return np.asarray(0.5 * self.lo + 0.5 * self.hi)


@dataclass(frozen=True)
class Place:
    """A place that the machine cannot pass, at `fraction` of piece `piece`.

    A singular place has `joint` −1, and `what` completes "the tool is at …". An overrun travel end has the
    `joint`'s index, its position `value` and the end of the travel `limit` [mm, deg].
    """

    piece: int
    fraction: float
    what: str = ""
    joint: int = -1
    value: float = 0.0
    limit: float = 0.0

    def sentence(self, kinematics: Kinematics, line: int) -> str:
        """One sentence for the user, with the source line and the remedy."""
        if self.joint < 0:
            turning = zip(kinematics.joint_names, kinematics.turning, strict=True)
            names = " and ".join(name for name, turns in turning if turns) or "the joints"
            return (
                f"line {line}: the tool is at {self.what}, where {names} cannot follow it: "
                "keep the path off it, or program that stretch in joint positions"
            )
        name = kinematics.joint_names[self.joint]
        unit = "deg" if kinematics.rotary[self.joint] else "mm"
        end = "begins" if self.value < self.limit else "ends"
        return (
            f"line {line}: {name} would go to {self.value:.6g} {unit}, its travel {end} at {self.limit:g} "
            f"{unit}: place the part elsewhere, or choose another machine"
        )


@dataclass(frozen=True)
class JointPath:
    """Parts of a path on which the joints are smooth, in order, and the places that the joints cannot pass.

    For each part: `piece`, `part` (m, 2) its fractions of the piece, `range` (m, joints) bounds of the
    joints' positions [mm, deg], with angles continued over whole turns. `places` are in the order of the
    path.
    """

    kinematics: Kinematics
    tips: TipPieces
    piece: Integers
    part: Floats
    range: Bounds
    places: tuple[Place, ...]

    def positions(self, piece: Integers, fraction: ArrayLike) -> Floats:
        """Joint positions (n, joints) [mm, deg] at fractions of pieces, angles continuous along the path."""
        fraction, tips = np.asarray(fraction), self.tips
        weights = None if tips.weights is None else tips.weights[piece]
        principal = derivatives(
            self.kinematics, tips.control_points[piece], tips.width[piece], fraction, 0, weights
        )[0]
        # The end of a part is looked up as the start of the next part: both parts are on the same turn there.
        found = np.searchsorted(self.piece + self.part[:, 0], piece + fraction, side="right") - 1
        turns = np.round((self.range.middle[found] - principal) / TURN)
        return np.asarray(principal + np.nan_to_num(turns) * np.array(self.kinematics.turning) * TURN)


def joint_path(
    kinematics: Kinematics,
    control_points: ArrayLike,
    width: ArrayLike,
    travel: Sequence[tuple[float, float]] | None = None,
    weights: ArrayLike | None = None,
    start: ArrayLike | None = None,
) -> JointPath:
    """The joints along connected pieces, given as in `feedplan.machine.path_derivatives`.

    `start` (joints,) [mm, deg] are the joint positions before: angles begin on the nearest turn. Without
    `start` they begin on the turn that keeps the whole path within `travel`, (least, greatest) of each joint,
    if there is one; else with the values of K.
    """
    tips = TipPieces.of(control_points, width, weights)
    piece, part, lo, hi, singular, overruns = native_joint_path(
        kinematics.recorded, tips, contiguous(travel), contiguous(start)
    )
    places = [_singular(kinematics, tips, *place) for place in singular]
    places += [
        Place(piece, fraction, joint=joint, value=value, limit=limit)
        for piece, fraction, joint, value, limit in overruns
    ]
    places.sort(key=lambda place: (place.piece, place.fraction))
    return JointPath(kinematics, tips, piece, part, Bounds(lo, hi), tuple(places))


def _singular(kinematics: Kinematics, tips: TipPieces, piece: int, fraction: float) -> Place:
    """A singular place; it is named after the quantity of `Kinematics.singular` that is least there."""
    weights = None if tips.weights is None else tips.weights[piece]
    curve = CompositeCurve.from_bezier(tips.control_points[piece], weights)
    point = curve.evaluate(0, fraction)[0, 0]
    with np.errstate(all="ignore"):
        measures = kinematics.singular(tuple(point))
    what = min(measures, key=lambda name: float(np.nan_to_num(measures[name])), default="")
    return Place(piece, fraction, what=what or "a singular position of the machine")

"""Joint positions along a whole tip path: continuous angles, singular places, travel ends.

Pieces are cut until interval arithmetic proves on each part that K is differentiable there and that no angle
turns by half a turn or more. Then the value of an angle at any point of the part is certain up to the part's
turn, and parts are joined at their ends. What cannot be proven down to 2^-30 of a piece is a singular place:
K is singular within that distance. A travel end is overrun where an enclosure lies beyond it as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.machine.along import HALF_TURN, enclosures, positions
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers.interval import Interval

Array = NDArray[np.float64]
TURN = 2 * HALF_TURN
DEEPEST = 30
# Past this depth, more open parts of one piece than that mean a singular stretch, not singular points.
STRETCH_DEPTH, STRETCH_PARTS = 10, 64
# Overruns that rounding of a program to four or more decimals makes are none [mm, deg].
TRAVEL_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Place:
    """Where a path asks of the machine what it cannot do: at `fraction` of piece `piece`.

    A singular place has the index of no joint (−1), and `what` completes "the tool is at …". A travel end has
    the `joint`'s index, its position `value` and the travel's end `limit` [mm, deg].
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
        return (
            f"line {line}: {name} would go to {self.value:.6g} {unit}, its travel ends at {self.limit:g} "
            f"{unit}: place the part elsewhere, or choose another machine"
        )


@dataclass(frozen=True)
class JointPath:
    """Parts of a path on which the joints are smooth, in order, and the places where they are not or leave.

    Per part: `piece`, `part` (m, 2) its fractions of the piece, `range` (m, joints) what the joints'
    positions lie within [mm, deg], angles on their turn. `places` are in order of the path.
    """

    kinematics: Kinematics
    control_points: Array
    weights: Array | None
    piece: NDArray[np.int64]
    part: Array
    range: Interval
    places: tuple[Place, ...]

    def positions(self, piece: NDArray[np.int64], fraction: Array) -> Array:
        """Joint positions (n, joints) [mm, deg] at fractions of pieces, angles continuous along the path."""
        # The end of a part is found as the start of the next: there both are on the same turn.
        found = np.searchsorted(self.piece + self.part[:, 0], piece + fraction, side="right") - 1
        principal = positions(
            self.kinematics, _points(self.control_points, self.weights, piece, np.asarray(fraction))
        )
        return _on_turn(principal, self.range[found].middle, self.kinematics)


def survey(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    travel: Sequence[tuple[float, float]] | None = None,
    weights: Array | None = None,
    start: Array | None = None,
) -> JointPath:
    """The joints along pieces joined end to end; `control_points` and `weights` as in `along`.

    `start` (joints,) [mm, deg] is where the joints are before: angles begin on the nearest turn. Without it
    they begin on the turn that keeps the whole path within `travel`, (least, greatest) of each joint, if
    there is one; else as K gives them.
    """
    piece, part, reach, singular = _smooth_parts(kinematics, control_points, width, weights)
    reach = _joined(kinematics, control_points, weights, piece, part, reach)
    reach = _on_first_turn(kinematics, reach, travel, start)
    names = [_named(kinematics, control_points, weights, *place) for place in singular]
    places = [*names]
    if travel is not None:
        limits = np.array(travel, dtype=np.float64)
        places += _overruns(kinematics, control_points, width, weights, piece, part, reach, limits)
    places.sort(key=lambda place: (place.piece, place.fraction))
    return JointPath(kinematics, control_points, weights, piece, part, reach, tuple(places))


def _smooth_parts(
    kinematics: Kinematics, control_points: Array, width: Array, weights: Array | None
) -> tuple[NDArray[np.int64], Array, Interval, list[tuple[int, float]]]:
    """Parts with bounded K and K' and no half turn of an angle; and the middles of parts that never are."""
    turning = np.array(kinematics.turning)
    piece = np.arange(len(control_points))
    part = np.tile([0.0, 1.0], (len(piece), 1))
    done: list[tuple[NDArray[np.int64], Array, Interval]] = []
    singular: list[tuple[int, float]] = []
    for depth in range(DEEPEST + 1):
        bounds = _enclosed(kinematics, control_points, width, weights, piece, part)
        good = (bounds.bounded[:2]).all(axis=(0, 2))
        good &= (np.where(turning, bounds[0].width, 0.0) < HALF_TURN).all(axis=-1)
        done.append((piece[good], part[good], bounds[0][good]))
        piece, part, open_bounds = piece[~good], part[~good], bounds[0][~good]
        if not len(piece):
            break
        stretch = np.bincount(piece, minlength=len(control_points))[piece] > STRETCH_PARTS
        given_up = stretch if depth >= STRETCH_DEPTH else np.zeros(len(piece), dtype=bool)
        if depth == DEEPEST:
            given_up[:] = True
        done.append((piece[given_up], part[given_up], open_bounds[given_up]))
        singular += zip(piece[given_up].tolist(), part[given_up].mean(axis=1).tolist(), strict=True)
        piece, part = _halves(piece[~given_up], part[~given_up])
        if not len(piece):
            break
    piece = np.concatenate([row[0] for row in done])
    part = np.concatenate([row[1] for row in done])
    reach = Interval(np.concatenate([r[2].lo for r in done]), np.concatenate([r[2].hi for r in done]))
    order = np.lexsort((part[:, 0], piece))
    return piece[order], part[order], reach[order], _one_a_stretch(singular)


def _one_a_stretch(places: list[tuple[int, float]]) -> list[tuple[int, float]]:
    """The first of each row of neighbouring singular parts."""
    kept: list[tuple[int, float]] = []
    last = (-1, 0.0)
    for piece, fraction in sorted(places):
        if piece != last[0] or fraction - last[1] > 2.0**-STRETCH_DEPTH:
            kept.append((piece, fraction))
        last = (piece, fraction)
    return kept


def _joined(
    kinematics: Kinematics,
    control_points: Array,
    weights: Array | None,
    piece: NDArray[np.int64],
    part: Array,
    reach: Interval,
) -> Interval:
    """Angles moved by whole turns so that each part begins where the one before ends."""
    middle = reach.middle
    ends = []
    for side in (0, 1):
        principal = positions(kinematics, _points(control_points, weights, piece, part[:, side]))
        # A singular part has no middle: its ends are where K says.
        ends.append(_on_turn(principal, np.where(reach.bounded, middle, principal), kinematics))
    steps = np.round((ends[1][:-1] - ends[0][1:]) / TURN) * np.array(kinematics.turning)
    turns = np.concatenate([np.zeros((1, middle.shape[1])), np.cumsum(np.nan_to_num(steps), axis=0)])
    return reach + turns * TURN


def _on_first_turn(
    kinematics: Kinematics,
    reach: Interval,
    travel: Sequence[tuple[float, float]] | None,
    start: Array | None,
) -> Interval:
    """All angles moved together: near `start`, or else into the travel."""
    shift = np.zeros(reach.shape[1])
    for joint in np.flatnonzero(kinematics.turning).tolist():
        own = reach[:, joint]
        if start is not None:
            shift[joint] = np.round((start[joint] - own.middle[0]) / TURN)
        elif travel is not None:
            lo, hi = travel[joint]
            known = own.bounded
            least, most = own.lo[known].min(initial=np.inf), own.hi[known].max(initial=-np.inf)
            first, last = (lo - least) / TURN, (hi - most) / TURN
            slack = TRAVEL_TOLERANCE / TURN
            nearest = np.clip(0.0, np.ceil(first - slack), np.floor(last + slack))
            fits = np.isfinite(nearest) and first - slack <= nearest <= last + slack
            shift[joint] = nearest if fits else 0.0
    return reach + np.nan_to_num(shift) * TURN


def _overruns(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    weights: Array | None,
    piece: NDArray[np.int64],
    part: Array,
    reach: Interval,
    limits: Array,
) -> list[Place]:
    """The first overrun of each joint in each piece, with the farthest value found in the piece."""
    lo, hi = limits[:, 0] - TRAVEL_TOLERANCE, limits[:, 1] + TRAVEL_TOLERANCE
    found: dict[tuple[int, int], tuple[float, float, float]] = {}
    for _ in range(DEEPEST):
        open_ = reach.bounded & ((reach.lo < lo) | (reach.hi > hi))
        out = reach.bounded & ((reach.hi < lo) | (reach.lo > hi))
        rows = np.flatnonzero(out.any(axis=1))
        for side in (0, 1):
            tips = _points(control_points, weights, piece[rows], part[rows, side])
            value = _on_turn(positions(kinematics, tips), reach.middle[rows], kinematics)
            over = np.maximum(lo - value, value - hi)
            for row, joint in zip(*np.nonzero(out[rows]), strict=True):
                key = (int(piece[rows[row]]), int(joint))
                fraction, worst, most = found.get(key, (1.0, 0.0, 0.0))
                if over[row, joint] > most:
                    worst, most = float(value[row, joint]), float(over[row, joint])
                found[key] = (min(fraction, float(part[rows[row], 0])), worst, most)
        keep = (open_ & ~out).any(axis=1)
        if not keep.any():
            break
        near = np.repeat(reach[keep].middle, 2, axis=0)
        piece, part = _halves(piece[keep], part[keep])
        reach = _enclosed(kinematics, control_points, width, weights, piece, part)[0]
        turns = np.round((near - reach.middle) / TURN) * np.array(kinematics.turning)
        reach = reach + np.nan_to_num(turns) * TURN
    return [
        Place(i, fraction, joint=j, value=value, limit=float(limits[j, 0 if value < lo[j] else 1]))
        for (i, j), (fraction, value, _) in found.items()
    ]


def _named(
    kinematics: Kinematics, control_points: Array, weights: Array | None, piece: int, fraction: float
) -> Place:
    """A singular place by the name of what vanishes there."""
    point = _points(control_points, weights, np.array([piece]), np.array([fraction]))
    with np.errstate(all="ignore"):
        measures = kinematics.singular(tuple(point[0]))
    what = min(measures, key=lambda name: float(np.nan_to_num(measures[name])), default="")
    return Place(piece, fraction, what=what or "a singular position of the machine")


def _enclosed(
    kinematics: Kinematics,
    control_points: Array,
    width: Array,
    weights: Array | None,
    piece: NDArray[np.int64],
    part: Array,
) -> Interval:
    own = None if weights is None else weights[piece]
    return enclosures(kinematics, control_points[piece], width[piece], 2, part, own)


def _halves(piece: NDArray[np.int64], part: Array) -> tuple[NDArray[np.int64], Array]:
    middle = part.mean(axis=1)
    halves = np.stack([part[:, 0], middle, middle, part[:, 1]], axis=1).reshape(-1, 2)
    return np.repeat(piece, 2), halves


def _points(control_points: Array, weights: Array | None, piece: NDArray[np.int64], fraction: Array) -> Array:
    """Tips (n, axes) at fractions of pieces, by de Casteljau."""
    level = control_points[piece]
    if weights is not None:
        own = weights[piece][..., None]
        level = np.concatenate([level * own, own], axis=-1)
    t = fraction[:, None, None]
    while level.shape[1] > 1:
        level = (1 - t) * level[:, :-1] + t * level[:, 1:]
    point: Array = level[:, 0]
    return point if weights is None else point[:, :-1] / point[:, -1:]


def _on_turn(principal: Array, near: Array, kinematics: Kinematics) -> Array:
    """Angles known up to whole turns moved next to `near`."""
    turns = np.nan_to_num(np.round((near - principal) / TURN)) * np.array(kinematics.turning)
    moved: Array = principal + turns * TURN
    return moved

"""Where the joints are along a path, and how fast they move with it: by the kinematics' positions alone.

Slopes by the path's parameter are differences of positions over seven places, exact to the sixth degree. The
step between the places is chosen by what two of them, one an eighth of the other, agree on: near a singular
place it has to be small, elsewhere it may be wide, which leaves rounding less to say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import audit_places
from feedplan.constraints.problem import Problem
from feedplan.lazy import cached_property
from feedplan.machine.meaning import Meaning

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

TURN = 360.0

# Roundings, in units of EPS of the magnitude, that a position may carry: tip, sines and sums lie on the way.
ROUNDINGS = 16.0
EPS = float(np.finfo(np.float64).eps)

# Places of a difference, and derivative of the polynomial through them: coefficients by powers of the place.
NODES = np.arange(-3.0, 4.0)

# Steps as shares of the piece: the widest, by how much each next one is smaller, and how many.
WIDEST, SMALLER, STEPS = 2.0**-7, 8.0, 6
# What is left of the error of a difference by a step an eighth as wide; 8⁻⁶ by the theory.
LEFT = 1.0 / 512.0


def _weights() -> Array:
    rows = []
    for j, node in enumerate(NODES):
        others = np.delete(NODES, j)
        basis = np.polynomial.polynomial.polyfromroots(others) / np.prod(node - others)
        rows.append(np.polynomial.polynomial.polyder(basis))
    return np.array(rows)


WEIGHTS = _weights()


@dataclass(frozen=True)
class JointPath:
    """The joints of a problem whose path is that of the tool tip.

    Angles known up to whole turns are compared the short way round: between two places that are compared they
    turn by less than half a turn.
    """

    problem: Problem

    @cached_property
    def run(self) -> Numbers:
        """The run of each piece (n,)."""
        return np.repeat(np.arange(len(self.problem.path.runs) - 1), np.diff(self.problem.path.runs))

    @cached_property
    def turning(self) -> NDArray[np.bool_]:
        """Which joints are known up to whole turns, of each run (r, joints)."""
        return np.array([words.kinematics.turning for words in self.problem.words], dtype=bool)

    @cached_property
    def _group(self) -> Numbers:
        """Runs with the same kinematics have the same number."""
        numbers: dict[int, int] = {}
        return np.array([numbers.setdefault(id(words), len(numbers)) for words in self.problem.words])

    @cached_property
    def feed_axes(self) -> NDArray[np.bool_]:
        """The axes that the feed of a piece is along (n, axes): X, Y, Z where these move, else the others."""
        curve = self.problem.path.curve
        first = np.repeat(curve.control_points[curve.offsets[:-1]], np.diff(curve.offsets), axis=0)
        moves = np.logical_or.reduceat(curve.control_points != first, curve.offsets[:-1], axis=0)
        linear = np.array([name in ("X", "Y", "Z") for name in self.problem.path.axes])
        return np.where((moves & linear).any(axis=1)[:, None], linear, ~linear)

    def tip(self, piece: Numbers, u: Array) -> tuple[Array, Array]:
        """C and C' (n, axes) at places."""
        return audit_places(self.problem.path.curve, piece, np.ascontiguousarray(u))

    @cached_property
    def _turned(self) -> NDArray[np.bool_]:
        """The pieces on which only the tool's direction I, J, K turns (n,): the feed is in degrees of it."""
        meaning = np.array([words.meaning is Meaning.VECTOR for words in self.problem.words])
        return np.asarray(meaning[self.run] & ~(self.feed_axes & self._of("XYZ")).any(axis=1))

    def _of(self, letters: str) -> NDArray[np.bool_]:
        """The axes of the path with these letters (axes,)."""
        return np.array([name in tuple(letters) for name in self.problem.path.axes])

    def feed_slope(self, piece: Numbers, u: Array) -> Array:
        """Way that the feed is about, per u (n,), at places."""
        place, slope = self.tip(piece, u)
        way = np.linalg.norm(np.where(self.feed_axes[piece], slope, 0.0), axis=1)
        rows = np.flatnonzero(self._turned[piece])
        if len(rows):
            direction, change = (value[np.ix_(rows, self._of("IJK"))] for value in (place, slope))
            across = np.linalg.norm(np.cross(direction, change), axis=1)
            way[rows] = np.degrees(across / (direction**2).sum(axis=1))
        return np.asarray(way)

    def feed_way(self, piece: Numbers, start: Array, end: Array) -> Array:
        """Way that the feed is about (n,), straight from one point of a piece (n, axes) to another."""
        way = np.linalg.norm(np.where(self.feed_axes[piece], end - start, 0.0), axis=1)
        rows = np.flatnonzero(self._turned[piece])
        if len(rows):
            first, last = (point[np.ix_(rows, self._of("IJK"))] for point in (start, end))
            across = np.linalg.norm(np.cross(first, last), axis=1)
            way[rows] = np.degrees(np.arctan2(across, (first * last).sum(axis=1)))
        return np.asarray(way)

    def way_slope(self, piece: Numbers, u: Array) -> Array:
        """Way along the path in all its axes, per u (n,), at places."""
        return self.way_of(self.tip(piece, u)[1])

    def way_of(self, slope: Array) -> Array:
        """The same (n,) from C' (n, axes)."""
        scale = 1.0 if self.problem.way_scale is None else self.problem.way_scale
        return np.asarray(np.sqrt(((slope * scale) ** 2).sum(axis=1)))

    def joints(self, piece: Numbers, tip: Array) -> Array:
        """Positions (n, joints) [mm, deg] for points of pieces, angles as the kinematics gives them."""
        group = self._group[self.run[piece]]
        result = np.empty((len(piece), len(self.problem.axes)))
        for number in np.unique(group):
            mine = group == number
            words = self.problem.words[int(np.argmax(self._group == number))]
            columns = tuple(np.moveaxis(words.tip(tip[mine]), -1, 0))
            with np.errstate(all="ignore"):
                joints = words.kinematics.joints(columns)
            result[mine] = np.stack(np.broadcast_arrays(*joints), axis=-1)
        return result

    def at(self, piece: Numbers, u: Array) -> Array:
        """Positions (n, joints) at places."""
        return self.joints(piece, self.tip(piece, u)[0])

    def between(self, piece: Numbers, before: Array, after: Array, other: Numbers | None = None) -> Array:
        """From one position to another (n, …, joints), both of the piece or the first of an `other` one.

        Joints that turn on one of them go the short way round."""
        way = after - before
        turning = self.turning[self.run[piece]]
        if other is not None:
            turning = turning | self.turning[self.run[other]]
        turning = turning.reshape(len(piece), *([1] * (way.ndim - 2)), way.shape[-1])
        with np.errstate(invalid="ignore"):
            return np.where(turning, way - TURN * np.round(way / TURN), way)

    def slopes(self, piece: Numbers, u: Array) -> tuple[Array, Array, Array]:
        """dq/du (n, joints), at most how wrong each is, and what is not known of q (n, joints)."""
        count, joints = len(piece), len(self.problem.axes)
        best, error = np.zeros((count, joints)), np.full((count, joints), np.inf)
        unknown = np.zeros((count, joints))
        rows = np.arange(count)
        step = WIDEST
        coarse, coarse_rounding, rounding = self._difference(piece, u, step)
        for _ in range(STEPS - 1):
            step /= SMALLER
            fine, fine_rounding, rounding = self._difference(piece[rows], u[rows], step)
            unknown[rows] = rounding
            with np.errstate(invalid="ignore"):
                apart = np.abs(fine - coarse)
                for value, bound in (
                    (coarse, apart + coarse_rounding),
                    (fine, LEFT * apart + fine_rounding),
                ):
                    better = bound < error[rows]
                    best[rows] = np.where(better, value, best[rows])
                    error[rows] = np.where(better, bound, error[rows])
                open_ = ~(apart <= coarse_rounding + fine_rounding).all(axis=1)
            if not open_.any():
                break
            rows, coarse, coarse_rounding = rows[open_], fine[open_], fine_rounding[open_]
        return best, error, unknown

    def _difference(self, piece: Numbers, u: Array, share: float) -> tuple[Array, Array, Array]:
        """dq/du by places a share of the piece apart, what of it may be rounding, and that of q."""
        width = self.problem.path.width[piece]
        step = share * width
        centre = np.clip(u, 3.0 * step, width - 3.0 * step)
        weights = ((u - centre) / step)[:, None] ** np.arange(WEIGHTS.shape[1]) @ WEIGHTS.T
        places = centre[:, None] + step[:, None] * NODES
        many = np.repeat(piece, len(NODES))
        tip, slope = self.tip(many, places.ravel())
        q = self.joints(many, tip).reshape(len(piece), len(NODES), len(self.problem.axes))
        way = self.between(piece, q[:, 3:4], q)
        difference = np.einsum("nj,njk->nk", weights, way) / step[:, None]
        # A joint feels the rounding of the tip as much as it moves with it.
        size = np.abs(tip).max(axis=1).reshape(len(piece), len(NODES)).max(axis=1)
        speed = np.linalg.norm(slope, axis=1).reshape(len(piece), len(NODES)).max(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            felt = np.nan_to_num(np.abs(difference) * (size / speed)[:, None], posinf=0.0)
        rounding = ROUNDINGS * EPS * (np.abs(q).max(axis=(1, 2))[:, None] + felt)
        return difference, rounding * np.abs(weights).sum(axis=1)[:, None] / step[:, None], rounding

"""Computes the derivative of a path's least time with respect to the path's second and third derivatives.

Along C(u) with p = u̇² the acceleration and the jerk of an axis are

    C'' p + C' p'/2    and    √p (C''' p + 3/2 C'' p' + 1/2 C' p'').

The least time ∫ p^(−1/2) du depends on C'' and C''' through these limits, and its derivative follows from
their Lagrange multipliers. The multipliers are those of a quadratic program in the change of p, with the time
to second order and the limits to first order about the plan; p is a quadratic spline, or a linear one without
jerk limits. Where no axis is near its greatest acceleration or jerk, p is kept, because the shape of the path
does not matter there. Terms with C' are left out: with them, steps saved less time on five of seven polylines
and the same on two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.problem import Problem, feed_square
from feedplan.errors import SolverError
from feedplan.profile import SpeedProfile

# Number of cells of the spline in each piece, and the places in a cell at which limits hold.
_CELLS, _PLACES = 3, (0.05, 0.95)
# A limit that is used by less than this share has no row in the quadratic program.
_NEAR = 0.5
# p is kept where all uses of acceleration and jerk limits are below _IDLE, and where the use of a speed limit
# exceeds _AT_SPEED.
_IDLE, _AT_SPEED = 0.9, 0.999
# Upper bound of a multiplier, in units of the time at its place: where p cannot change, multipliers are not
# determined.
_DEAREST = 3.0
# p is also kept near rest, where it is less than this share of the greatest p of the run.
_REST = 2e-3


@dataclass(frozen=True, eq=False)
class PathGradient:
    """Places (m,) on pieces `piece` at `u`, each for a `width` of the parameter [mm].

    At each place: `p` [mm²/s²], the derivatives `second` and `third` (m, axes) of the path, and the
    derivatives of the least time with respect to them per length of the parameter, `by_second` [s] and
    `by_third` [s mm].
    """

    piece: Integers
    u: Floats
    width: Floats
    p: Floats
    second: Floats
    third: Floats
    by_second: Floats
    by_third: Floats


def path_gradient(problem: Problem, profile: SpeedProfile, max_jerk: Floats) -> PathGradient:
    """The gradient for a plan whose joints are the axes of its path.

    `max_jerk` (axes,) [mm/s³] is infinite where the plan has no jerk limit.
    """
    path = problem.path
    size = path.width / _CELLS
    piece = np.repeat(np.arange(len(path)), _CELLS * len(_PLACES))
    part = (np.arange(_CELLS)[:, None] + np.array(_PLACES)).ravel()
    u = (size[:, None] * part).ravel()
    width = size[piece] / len(_PLACES)
    _, _, velocity, acceleration, jerk, *_ = profile.sampler(problem).along(piece.astype(np.uint32), u)
    _, slope, second, third = path.curve.evaluate(piece, u, 3)
    square = (slope**2).sum(axis=1)
    p = (velocity**2).sum(axis=1) / square
    rise = 2.0 * ((acceleration - second * p[:, None]) * slope).sum(axis=1) / square
    root = np.sqrt(p)

    run = np.searchsorted(path.runs, piece, side="right") - 1
    greatest = np.maximum.reduceat(p, np.searchsorted(piece, path.runs[:-1]))
    moves = p > _REST * greatest[run]
    uses = {2: (problem.use("acceleration", acceleration), problem.limit("acceleration", acceleration))}
    if np.isfinite(max_jerk).all():
        uses[3] = (np.abs(jerk) / max_jerk, np.broadcast_to(max_jerk, jerk.shape))
    busy = np.max([use.max(axis=1) for use, _ in uses.values()], axis=0) >= _IDLE
    feed = np.sqrt(feed_square(problem, piece, u) * p) / problem.feed[piece]
    fast = np.maximum(feed, problem.use("velocity", velocity).max(axis=1)) > _AT_SPEED

    spline = _Spline.of(path.runs, size, piece, part, degree=max(uses) - 1)
    program = _Program(spline, p, width, free=moves & busy, known=~moves)
    moves &= program.touched
    stays = np.flatnonzero(moves & (fast | ~busy))
    program.limit(stays, spline.value[stays], np.zeros(len(stays)))
    changes = np.zeros((2, *second.shape))
    asked = []
    for order, (use, limit) in uses.items():
        for axis in range(use.shape[1]):
            at = np.flatnonzero(moves & (use[:, axis] > _NEAR))
            sign = np.sign((acceleration if order == 2 else jerk)[at, axis]) / limit[at, axis]
            bend, turn, way = (each[at, axis, None] for each in (third, second, slope))
            if order == 2:
                row = turn * spline.value[at] + 0.5 * way * spline.slope[at]
            else:
                row = (0.5 * jerk[at, axis] / p[at])[:, None] * spline.value[at] + root[at, None] * (
                    bend * spline.value[at] + 1.5 * turn * spline.slope[at] + 0.5 * way * spline.bend[at]
                )
            program.limit(at, sign[:, None] * row, np.maximum(1.0 - use[at, axis], 0.0))
            asked.append((order, axis, at, sign))
    for (order, axis, at, sign), multiplier in zip(asked, program.multipliers()[1:], strict=True):
        force = sign * multiplier / width[at]
        if order == 2:
            changes[0, at, axis] += force * p[at]
        else:
            changes[0, at, axis] += force * 1.5 * root[at] * rise[at]
            changes[1, at, axis] += force * root[at] ** 3
    return PathGradient(piece, u, width, p, second, third, *changes)


@dataclass(frozen=True, eq=False)
class _Spline:
    """For each place (m, degree + 1): `column` are the indices of the spline's coefficients that are not
    multiplied by 0 there, `value` their basis functions, `slope` and `bend` the derivatives of these."""

    column: Integers
    value: Floats
    slope: Floats
    bend: Floats

    @classmethod
    def of(cls, runs: Integers, size: Floats, piece: Integers, part: Floats, degree: int) -> _Spline:
        """A spline for each run, with cells of `size` (pieces,), at fractions `part` of the cells of each
        piece."""
        cell = _CELLS * piece + np.tile(part.astype(np.int64), len(size))
        run = np.searchsorted(runs, piece, side="right") - 1
        column = (cell + degree * run)[:, None] + np.arange(degree + 1)
        h, x = size[piece], np.tile(part % 1.0, len(size))
        if degree == 1:
            rise = np.stack([-1.0 / h, 1.0 / h], axis=1)
            return cls(column, np.stack([1.0 - x, x], axis=1), rise, np.zeros_like(rise))
        # The neighbouring cells; beyond the ends of a run their size is 0.
        sizes = np.repeat(size, _CELLS)
        before, after = np.roll(sizes, 1), np.roll(sizes, -1)
        before[_CELLS * runs[:-1]] = 0.0
        after[_CELLS * runs[1:] - 1] = 0.0
        low, high = h / (h + before[cell]), h / (h + after[cell])

        def three(first: Floats, last: Floats, total: float) -> Floats:
            return np.stack([first, total - first - last, last], axis=1)

        return cls(
            column,
            three(low * (1.0 - x) ** 2, high * x**2, 1.0),
            three(-2.0 * low * (1.0 - x) / h, 2.0 * high * x / h, 0.0),
            three(2.0 * low / h**2, 2.0 * high / h**2, 0.0),
        )


class _Program:
    """Minimises the time, to second order in the change of p, under linear limits."""

    def __init__(self, spline: _Spline, p: Floats, width: Floats, free: Flags, known: Flags) -> None:
        """A coefficient is free if it counts at a `free` place and at no `known` place."""
        self._column = spline.column
        count = int(spline.column.max()) + 1
        self._unit = np.zeros(count)
        np.maximum.at(self._unit, spline.column, p[:, None])
        may = np.zeros(count, bool)
        may[spline.column[free]] = True
        may[spline.column[known]] = False
        self._index = np.where(may, np.cumsum(may) - 1, -1)
        self._free = int(may.sum())
        # The places at which p may change.
        self.touched = (self._index[spline.column] >= 0).any(axis=1)
        self._limits: list[tuple[Any, Floats, Floats]] = []
        self._most = _DEAREST * width / np.sqrt(np.maximum(p, 1e-300))
        moving = np.flatnonzero(~known)
        time = width[moving] / np.sqrt(p[moving])
        self._time = float(time.sum())
        # In units of the total time, and of the greatest p near each coefficient.
        matrix = self._matrix(moving, spline.value[moving])
        self._cost = matrix.T @ (-0.5 * time / p[moving]) / self._time
        self._curvature = matrix.T @ matrix.multiply((0.75 * time / p[moving] ** 2 / self._time)[:, None])

    def _matrix(self, at: Integers, values: Floats) -> Any:
        from scipy import sparse

        column = self._column[at]
        index, row = self._index[column], np.broadcast_to(np.arange(len(at))[:, None], column.shape)
        kept = index >= 0
        entries = (values * self._unit[column])[kept], (row[kept], index[kept])
        return sparse.coo_matrix(entries, shape=(len(at), self._free)).tocsr()

    def limit(self, at: Integers, values: Floats, most: Floats) -> None:
        """Adds the limit Σ values · (change of the coefficients) ≤ `most` at each place `at`."""
        self._limits.append((self._matrix(at, values), most, self._most[at]))

    def multipliers(self) -> list[Floats]:
        """The multipliers of the limits [s], one array for each call of `limit`."""
        import clarabel
        from scipy import sparse

        counts = [len(most) for _, most, _ in self._limits]
        if not self._free:
            return [np.zeros(count) for count in counts]
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        rows = sum(counts)
        # Slack variables, by which limits may be exceeded at a cost that bounds the multipliers.
        way, none = sparse.identity(rows), sparse.csr_matrix((rows, rows))
        limits = sparse.vstack([matrix for matrix, _, _ in self._limits])
        found = clarabel.DefaultSolver(
            sparse.block_diag([sparse.triu(self._curvature), none]).tocsc(),
            np.concatenate([self._cost, *(most / self._time for _, _, most in self._limits)]),
            sparse.bmat([[limits, -way], [None, -way]]).tocsc(),
            np.concatenate([*(most for _, most, _ in self._limits), np.zeros(rows)]),
            [clarabel.NonnegativeConeT(2 * rows)],
            settings,
        ).solve()
        multiplier = np.array(found.z)[:rows]
        if not np.isfinite(multiplier).all():
            raise SolverError(f"Clarabel finds no gradient of the time along the path: {found.status}")
        return np.split(self._time * multiplier, np.cumsum(counts)[:-1])

"""The mesh of planners that discretise: subruns between stops are divided into cells, and the limits are
evaluated at places of each cell.

A subrun is a part of a run without a stop inside. A cell never crosses the end of a piece, because q'' may
jump there. Each cell has q', q'' and the greatest p at `PLACES`, which include both ends.

The mesh of a piece uses its own parameter u. At a cusp (q' = 0) the tool stops, and the subrun ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.problem import Problem, feed_square, speed_square
from feedplan.planners._faults import end_error

# Places of a cell in [0, 1]: both ends, and the extremes of the Legendre polynomial between them.
_DEGREE = 10
PLACES = np.concatenate(
    [[0.0], 0.5 + 0.5 * np.sort(legendre.legroots(legendre.legder([0.0] * _DEGREE + [1.0]))), [1.0]]
)

# Where |q'| is at most this share of its size on the piece, there is a cusp.
_CUSP = 1e-9


def _integration() -> Floats:
    """The matrix from values at `PLACES` to integrals from 0 to each place, exact up to degree 10."""
    powers = np.arange(_DEGREE + 1)
    values = PLACES[:, None] ** powers
    integrals = PLACES[:, None] ** (powers + 1) / (powers + 1)
    return np.asarray(np.linalg.solve(values.T, integrals.T).T)


INTEGRATION = _integration()

# Matrix from values at `PLACES` to the last two Legendre coefficients of the polynomial through them, which
# estimate the error between the places.
TAIL = np.linalg.inv(legendre.legvander(2.0 * PLACES - 1.0, _DEGREE))[-2:]

# Matrix from values at `PLACES` to values at 33 equally spaced places, which show peaks between them.
EVEN = (np.arange(33) / 32)[:, None] ** np.arange(_DEGREE + 1) @ np.linalg.inv(
    PLACES[:, None] ** np.arange(_DEGREE + 1)
)


@dataclass(frozen=True)
class Subrun:
    """The pieces from `first` up to (not including) `last` of a problem, without a stop inside.

    `start` and `end` are the squares of the speeds at its ends [mm²/s²]; None at a cusp, where the speed is 0
    for every p.
    """

    first: int
    last: int
    start: float | None
    end: float | None


@dataclass(frozen=True)
class Mesh:
    """The n cells of a subrun.

    For each cell: `piece`; `ends` (2, n) its parameter u at both ends; `width` (n,) their difference. At
    PLACES: `slope` q' and `bend` q'' (places, n, joints), `speed` (places, n, joints + 2) the squared use per
    p of the limits of velocity, feed and chord error, `way` (places, n, joints) the displacement of the
    joints from the start of the cell. `gain` (n,) is p at the start of the cell divided by p at the end of
    the cell before. `cap` (n + 1,) is the greatest p at the stations, in the parameter of the cell before (at
    the first station: of the cell after). `fixed` is the given p at both ends of the subrun, or None.
    """

    piece: Integers
    ends: Floats
    width: Floats
    slope: Floats
    bend: Floats
    speed: Floats
    way: Floats
    gain: Floats
    cap: Floats
    fixed: tuple[float | None, float | None]

    def __len__(self) -> int:
        return len(self.piece)

    @property
    def turn(self) -> Floats:
        """The change of q' within each cell divided by the greatest |q'| there (n,)."""
        change = np.linalg.norm(self.slope[-1] - self.slope[0], axis=1)
        return np.asarray(change / np.linalg.norm(self.slope, axis=2).max(axis=0))


def subruns(problem: Problem) -> Iterator[list[Subrun]]:
    """The subruns of each run."""
    count, width = len(problem.path), problem.path.width
    start, middle, end = (
        np.linalg.norm(problem.derivatives(np.arange(count), share * width, 1)[1], axis=1)
        for share in (0.0, 0.5, 1.0)
    )
    still = _CUSP * np.maximum(middle, np.maximum(start, end))
    begins_in_cusp, ends_in_cusp = start <= still, end <= still
    stop = problem.junction_speed == 0.0
    stop[1:-1] |= ends_in_cusp[:-1] | begins_in_cusp[1:]
    start_speed, end_speed = np.zeros(count), np.zeros(count)
    start_speed[0], end_speed[-1] = problem.start_speed, problem.end_speed
    for run, next_run in pairwise(problem.path.runs.tolist()):
        cuts = [run, *(run + 1 + np.flatnonzero(stop[run + 1 : next_run])).tolist(), next_run]
        yield [
            Subrun(
                first,
                last,
                None if begins_in_cusp[first] else float(start_speed[first]) ** 2,
                None if ends_in_cusp[last - 1] else float(end_speed[last - 1]) ** 2,
            )
            for first, last in pairwise(cuts)
        ]


@dataclass(frozen=True)
class Cuts:
    """The cells of a subrun: `piece` of each (n,), and its fractions at which the cell begins and ends."""

    piece: Integers
    lower: Floats
    upper: Floats

    def __len__(self) -> int:
        return len(self.piece)

    def bisected(self, marked: Flags) -> Cuts:
        """These cells, with the `marked` ones (n,) cut in two."""
        count = 1 + marked.astype(np.int64)
        lower, upper = np.repeat(self.lower, count), np.repeat(self.upper, count)
        second = (np.cumsum(count) - 1)[marked]
        lower[second] = upper[second - 1] = 0.5 * (self.lower[marked] + self.upper[marked])
        return Cuts(np.repeat(self.piece, count), lower, upper)


def even_cuts(subrun: Subrun, cells: int) -> Cuts:
    """The given number of `cells` in each piece, of equal width except in pieces next to a stop.

    There the width of cells grows with the distance from the stop, where the speed is least smooth.
    """
    pieces = np.arange(subrun.first, subrun.last)
    even = np.arange(cells + 1) / cells
    shares = np.tile(even, (len(pieces), 1))
    at_stop = [speed_sq is None or speed_sq == 0.0 for speed_sq in (subrun.start, subrun.end)]
    if len(pieces) == 1 and all(at_stop):
        shares[0] = 0.5 - 0.5 * np.cos(np.pi * even)
    else:
        if at_stop[0]:
            shares[0] = 1.0 - np.cos(0.5 * np.pi * even)
        if at_stop[1]:
            shares[-1] = np.sin(0.5 * np.pi * even)
    shares[:, -1] = 1.0
    return Cuts(np.repeat(pieces, cells), shares[:, :-1].ravel(), shares[:, 1:].ravel())


def mesh(problem: Problem, subrun: Subrun, cuts: Cuts) -> Mesh:
    """The mesh of a subrun, with the limits at the places of its cells.

    Raises InfeasibleError where a given speed at an end exceeds the limits at that place.
    """
    piece, lower, upper = cuts.piece, cuts.lower, cuts.upper
    local = lower + (upper - lower) * PLACES[:, None]
    whole = problem.path.width[piece]
    u = whole * local
    width = whole * (upper - lower)
    places = np.tile(piece, len(PLACES)), u.ravel()
    _, slope, bend = problem.derivatives(*places, 2).reshape(3, *u.shape, -1)
    square = speed_square(problem, *places).reshape(u.shape)
    by_feed = feed_square(problem, *places).reshape(u.shape) / problem.feed[piece] ** 2
    by_chord = square / _chord_speed_square(problem, *places).reshape(u.shape)
    use = problem.use("velocity", slope) ** 2
    per_p = np.concatenate([use, by_feed[..., None], by_chord[..., None]], axis=2)
    with np.errstate(divide="ignore"):
        most = 1.0 / per_p.max(axis=2)
    way = width[:, None] * np.einsum("ij,jck->ick", INTEGRATION, slope)
    first = np.flatnonzero(np.diff(piece, prepend=-1))
    gain = np.ones(len(piece))
    before, after = slope[-1, first[1:] - 1], slope[0, first[1:]]
    gain[first[1:]] = (before**2).sum(axis=1) / (after**2).sum(axis=1)
    cap = np.concatenate([most[0, :1], np.minimum(most[-1], np.append(most[0, 1:] / gain[1:], np.inf))])
    at_junction = problem.junction_speed[piece[first[1:]]] ** 2 / square[-1, first[1:] - 1]
    cap[first[1:]] = np.minimum(cap[first[1:]], at_junction)
    fixed = []
    for side, (known, station) in enumerate(((subrun.start, 0), (subrun.end, -1))):
        p = None if known is None else known / float(square[side * -1, station])
        if p is not None and p > cap[station] * (1.0 + 1e-12):
            most = float(np.sqrt(cap[station] * square[side * -1, station]))
            why = f"at most {most:.6g} {problem.unit}/s is allowed there: "
            raise end_error(problem, side == 0, int(problem.path.line[piece[station]]), why, most)
        fixed.append(p)
    ends = np.stack([u[0], u[-1]])
    ends[:, :] = np.where(np.stack([lower, upper]) == 1.0, whole, ends)
    return Mesh(piece, ends, width, slope, bend, per_p, way, gain, cap, (fixed[0], fixed[1]))


def _chord_speed_square(problem: Problem, piece: Integers, u: Floats) -> Floats:
    """(2/T)²·(2ρδ − δ²) at places (m,) [mm²/s²]; ρ ≥ δ is the radius of curvature of the tool's path."""
    if not np.isfinite(problem.chord_tolerance):
        return np.full(len(u), np.inf)
    _, tangent, second = (problem.tip_curve or problem.path.curve).evaluate(piece, u, 2)
    square = (tangent**2).sum(axis=1)
    along = (tangent * second).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    across = np.linalg.norm(second - along[:, None] * tangent, axis=1)
    tolerance = problem.chord_tolerance
    radius = np.where(across > 0.0, square / np.where(across > 0.0, across, 1.0), np.inf)
    # Where the tool stands still while other axes turn, there is no chord error.
    radius = np.where(square > 0.0, np.maximum(radius, tolerance), np.inf)
    return np.asarray((2.0 / problem.period) ** 2 * tolerance * (2.0 * radius - tolerance))

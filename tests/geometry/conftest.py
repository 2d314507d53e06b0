"""Programs written by hand, and a check of paths that is independent of how they are built."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from feedplan.geometry.path import Path
from feedplan.program.program import MoveKind, PathControl, Program

Array = NDArray[np.float64]
ProgramMaker = Callable[..., Program]
Check = Callable[[Program, Path], tuple[float, float]]


def _make_program(
    points: ArrayLike, axes: str = "XYZ", arcs: dict[int, Any] | None = None, **columns: Any
) -> Program:
    """G1 moves at 50 mm/s in G64 along `points`; missing coordinates are 0.

    `arcs` maps moves to (centre, normal, angle). Other columns are given as one value or as one per move.
    """
    given = np.array(points, dtype=float, ndmin=2)
    full = np.zeros((len(given), len(axes)))
    full[:, : given.shape[1]] = given
    count = len(full) - 1
    arcs = arcs or {}
    default: dict[str, Any] = {
        "kind": [MoveKind.ARC if i in arcs else MoveKind.LINE for i in range(count)],
        "feed": 50.0,
        "line": np.arange(10, 10 + count),
        "control": PathControl.TOLERANCE,
        "blend_tolerance": np.nan,
        "fit_tolerance": np.nan,
        "stop": np.arange(count) == count - 1,
        "dwell": 0.0,
    }
    types = {"kind": np.uint8, "line": np.int32, "control": np.uint8, "stop": np.bool_}
    table = {
        key: np.array(np.broadcast_to(columns.pop(key, value), count), dtype=types.get(key, np.float64))
        for key, value in default.items()
    }
    table["feed"][table["kind"] == MoveKind.RAPID] = np.inf
    rows = [arcs[i] for i in sorted(arcs)]
    return Program(
        name="test.ngc",
        axes=tuple(axes),
        start=full[0],
        target=full[1:].copy(),
        **table,
        arc_move=np.array(sorted(arcs), dtype=np.int64),
        arc_centre=np.array([row[0] for row in rows], dtype=float).reshape(len(rows), 3),
        arc_normal=np.array([row[1] for row in rows], dtype=np.uint8),
        arc_angle=np.array([row[2] for row in rows], dtype=float),
        **columns,
    )


def _curve(control: Array, weight: Array, t: Array) -> Array:
    """Points (n, axes) on quadratics (n, 3, axes) with middle weights (n,), at one t each."""
    s, w = t[:, None], weight[:, None]
    b0, b1, b2 = (1 - s) ** 2, 2 * w * s * (1 - s), s**2
    found: Array = (b0 * control[:, 0] + b1 * control[:, 1] + b2 * control[:, 2]) / (b0 + b1 + b2)
    return found


def _weights(path: Path) -> Array:
    """Middle weights (n,) of the path's conics, whose end weights are 1."""
    if path.curve.weights is None:
        return np.ones(len(path))
    weights = path.curve.weights.reshape(-1, 3)
    np.testing.assert_array_equal(weights[:, [0, 2]], 1.0)
    return weights[:, 1]


class _Moves:
    """The programmed path: lines, and arcs whose radius and remaining axes are linear in the angle."""

    def __init__(self, program: Program, axes: tuple[str, ...]) -> None:
        columns = [program.axes.index(name) for name in axes]
        places = np.vstack([program.start, program.target])
        self.start, self.end = places[:-1, columns], places[1:, columns]
        self.turns = np.zeros(len(program))
        self.turns[program.arc_move] = np.abs(program.arc_angle) / (2 * np.pi)
        self.plane = np.zeros((len(program), 2), dtype=int)
        self.centre, self.polar, self.sweep = (np.zeros((len(program), 2)) for _ in range(3))
        for row, move in enumerate(program.arc_move):
            normal = int(program.arc_normal[row])
            letters = [(normal + 1) % 3, (normal + 2) % 3]
            self.plane[move] = [axes.index("XYZ"[k]) for k in letters]
            self.centre[move] = program.arc_centre[row][letters]
            first, last = (
                side[move, self.plane[move]] - self.centre[move] for side in (self.start, self.end)
            )
            self.polar[move] = np.hypot(*first), np.arctan2(first[1], first[0])
            self.sweep[move] = np.hypot(*last) - np.hypot(*first), program.arc_angle[row]

    def points(self, move: NDArray[np.intp], share: Array) -> Array:
        """Points (n, axes) at a share in [0, 1] of one move each."""
        found: Array = self.start[move] + share[:, None] * (self.end[move] - self.start[move])
        rows = np.flatnonzero(self.turns[move] > 0)
        radius, angle = (self.polar[move[rows]] + share[rows, None] * self.sweep[move[rows]]).T
        for k, turned in enumerate((np.cos(angle), np.sin(angle))):
            found[rows, self.plane[move[rows], k]] = self.centre[move[rows], k] + radius * turned
        return found


def _nearest(points: Array, curve: Callable[[Array], Array], grid: int) -> Array:
    """Distance (n,) of each point from its own curve(x), x in [0, 1]; the curve may be closed.

    The best point of a grid in each half of the curve is refined by golden section search.
    """

    def distance(x: Array) -> Array:
        found: Array = np.linalg.norm(curve(x) - points, axis=1)
        return found

    halves = []
    for begin in (0.0, 0.5):
        best, least, step = np.zeros(len(points)), np.full(len(points), np.inf), 0.5 / grid
        for x in begin + step * np.arange(grid + 1):
            here = distance(np.full(len(points), x))
            best, least = np.where(here < least, x, best), np.minimum(here, least)
        low, high = np.maximum(best - step, 0.0), np.minimum(best + step, 1.0)
        for _ in range(70):
            a, b = low + 0.382 * (high - low), low + 0.618 * (high - low)
            left = distance(a) < distance(b)
            low, high = np.where(left, low, a), np.where(left, b, high)
        halves += [least, distance(low), distance(high)]
    return np.minimum.reduce(halves)


def _deviations(program: Program, path: Path) -> tuple[Array, Array]:
    """Distance of each piece from the moves it follows, and of each move from the pieces that follow it."""
    moves = _Moves(program, path.axes)
    counts = path.move[:, 1] - path.move[:, 0] + 1
    # All pairs of a piece and a move that it follows, with samples on both.
    piece = np.repeat(np.arange(len(path)), counts)
    move = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts) + path.move[piece, 0]
    found = []
    for owner in (piece, move):
        samples = 21
        share = np.tile(np.linspace(0, 1, samples), len(piece))
        rows, nearest = np.repeat(np.arange(len(piece)), samples), np.zeros(len(share))
        own_piece, own_move = piece[rows], move[rows]
        for turns in np.unique(moves.turns[move]):
            chosen = moves.turns[own_move] == turns
            of_chosen = own_piece[chosen]
            on_piece = partial(_curve, path.curve.by_piece[of_chosen], _weights(path)[of_chosen])
            on_move = partial(moves.points, own_move[chosen])
            if owner is piece:
                nearest[chosen] = _nearest(on_piece(share[chosen]), on_move, 2 + int(100 * turns))
            else:
                nearest[chosen] = _nearest(on_move(share[chosen]), on_piece, 4)
        # A sample counts with its nearest partner.
        table = np.full((owner.max() + 1, samples), np.inf)
        np.minimum.at(table, (owner[rows], np.tile(np.arange(samples), len(piece))), nearest)
        found.append(table.max(axis=1))
    return found[0], found[1]


def _check(program: Program, path: Path) -> tuple[float, float]:
    """Asserts what every path without velocity jumps must satisfy; returns the greatest distances found, from
    pieces to moves and from moves to pieces."""
    control, columns = path.curve.by_piece, [program.axes.index(name) for name in path.axes]
    rounding = 1e-13 + 1e-14 * np.abs(control).max()
    assert np.isfinite(control).all()
    assert (path.width > 0).all()
    # Pieces meet exactly, from the programmed start to the programmed end.
    np.testing.assert_array_equal(control[1:, 0], control[:-1, 2])
    np.testing.assert_array_equal(control[0, 0], program.start[columns])
    np.testing.assert_array_equal(control[-1, 2], program.target[-1, columns])
    # All moves are followed, in order, and no piece is faster than the feeds of its moves.
    assert path.move[0, 0] == 0
    assert path.move[-1, 1] == len(program) - 1
    assert (np.diff(path.move, axis=0) >= 0).all()
    assert (path.move[1:, 0] <= path.move[:-1, 1] + 1).all()
    np.testing.assert_array_equal(path.line, program.line[path.move[:, 0]])
    slowest = [program.feed[first : last + 1].min() for first, last in path.move]
    if set(path.axes) <= set("XYZ"):
        assert (path.feed <= np.array(slowest)).all()
    # The direction is continuous within runs, up to the rounding of coordinates.
    out, into = control[:-1, 2] - control[:-1, 1], control[1:, 1] - control[1:, 0]
    lengths = np.linalg.norm(out, axis=1), np.linalg.norm(into, axis=1)
    turn = np.linalg.norm(out / lengths[0][:, None] - into / lengths[1][:, None], axis=1)
    noise = 32 * np.finfo(float).eps * np.abs(control[1:, 0]).max(axis=1, initial=0) / np.minimum(*lengths)
    inner = np.ones(len(turn), dtype=bool)
    inner[path.runs[1:-1] - 1] = False
    assert (turn[inner] <= 1e-9 + noise[inner]).all()
    # Runs end at every halt of the program; they may end elsewhere too.
    assert path.runs[0] == 0
    assert path.runs[-1] == len(path)
    assert (np.diff(path.runs) > 0).all()
    assert len(path.dwell) == len(path.runs) - 1
    halts = np.flatnonzero(program.stop | (program.dwell > 0) | (program.control == PathControl.EXACT_STOP))
    assert set(halts) <= set(path.move[path.runs[1:] - 1, 1])
    assert path.dwell.sum() == program.dwell.sum()
    # The distances are within the promised ones, both ways.
    pieces, moves = _deviations(program, path)
    assert (pieces <= path.tolerance * (1 + 1e-9) + rounding).all()
    assert pieces.max() <= path.fit.deviation + rounding
    assert moves.max() <= path.fit.deviation * (1 + 1e-9) + rounding
    assert path.fit.deviation <= path.tolerance.max() * (1 + 1e-9)
    return float(pieces.max()), float(moves.max())


@pytest.fixture(scope="session")
def make_program() -> ProgramMaker:
    """`make_program(points, axes="XYZ", arcs={move: (centre, normal, angle)}, **columns)`."""
    return _make_program


@pytest.fixture(scope="session")
def check() -> Check:
    """Asserts all that a path promises; returns the greatest distances found, path to program and back."""
    return _check

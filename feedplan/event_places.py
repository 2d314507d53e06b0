"""Finds where a program's events are on the followed path, and when a profile reaches these places.

An event belongs to the end of the move before it. If the program stops there, this is the end of a run, and
the events there follow each other, each dwell taking its time. Otherwise the place is where the path changes
from one move to the next. Where one piece follows both moves, as at a rounded corner or along fitted points,
it is the place of the piece that is nearest to the programmed point.
"""

from __future__ import annotations

import numpy as np

from feedplan._solvers import Sampler
from feedplan.arrays import Floats, Integers
from feedplan.events import PlacedEvents, TimedEvents
from feedplan.geometry.path import Path
from feedplan.program.actions import actions
from feedplan.program.program import Program

# Number of places tried on a piece, and of Gauss-Newton steps from the nearest of them to the nearest place.
_TRIED, _STEPS = 9, 8
# A step shorter than this share of a piece ends the search.
_FOUND = 1e-9
# Number of pairs of a programmed point and a piece that are searched at once.
_AT_ONCE = 100_000


class PlannedEvents:
    """The events of a program on the path of its plan."""

    def __init__(self, program: Program, path: Path) -> None:
        self._program, self._path = program, path
        self._placed: list[PlacedEvents] = []

    def __call__(self, motion: Sampler) -> PlacedEvents:
        """The events by the runs of the path, computed once; `motion` samples the plan, at any period."""
        if not self._placed:
            self._placed.append(place_events(self._program, self._path, motion))
        return self._placed[0]


def place_events(program: Program, path: Path, motion: Sampler) -> PlacedEvents:
    """The events of a program on the path that follows it; `motion` samples the planned motion."""
    events = program.events
    starts, _, times = motion.runs.T
    moves, of_move = np.unique(events.move, return_inverse=True)
    run, piece, u = _places(program, path, moves)
    at_stop = piece < 0
    after = np.where(at_stop & (run >= 0), times[run], 0.0)
    passing = ~at_stop
    reached = motion.along(piece[passing].astype(np.uint32), u[passing])[0]
    after[passing] = reached - starts[run[passing]]
    done = actions(events)
    # Dwells are at stops; an event comes after the dwells before it at the same stop.
    waits = np.where(done.kind == "dwell", done.value, 0.0)
    passed = np.cumsum(waits) - waits
    passed -= passed[np.searchsorted(events.move, moves)][of_move]
    run, after = run[of_move], after[of_move] + passed
    # Nearest places may be slightly out of order where the path is close to itself: no event is moved back.
    time = np.concatenate(([0.0], starts))[run + 1] + after
    is_latest = time == np.maximum.accumulate(time)
    source = np.maximum.accumulate(np.where(is_latest, np.arange(len(time)), 0))
    texts, _ = events.said()
    placed = TimedEvents(
        np.zeros(len(events)), events.line, done.kind, done.channel, done.value, done.stops, tuple(texts)
    )
    return PlacedEvents(placed, run[source], after[source], starts)


def _places(program: Program, path: Path, moves: Integers) -> tuple[Integers, Integers, Floats]:
    """Run, piece and parameter (k,) at which the path has followed the first `moves` (k,), sorted.

    The piece is −1 at a stop, which is the end of the run, or the start of the path for run −1.
    """
    first, last = path.move[:, 0], path.move[:, 1]
    # Pieces from `low` on also follow later moves; pieces from `high` on only follow later moves.
    low = np.searchsorted(last, moves - 1, side="right")
    high = np.searchsorted(first, moves - 1, side="right")
    shared = (low < high) & (moves > 0)
    # Where no piece follows moves on both sides, the place is the end of the piece before.
    run = np.searchsorted(path.runs[1:], np.maximum(low - 1, 0), side="right")
    ends = ~shared & ((moves == 0) | (low == path.runs[1:][np.minimum(run, len(path.runs) - 2)]))
    piece = np.where(ends, -1, low - 1)
    u = np.where(ends, 0.0, path.width[np.maximum(low - 1, 0)])
    run = np.where(moves == 0, -1, run)
    columns = [program.axes.index(name) for name in path.axes]
    points = program.target[moves[shared] - 1][:, columns]
    piece[shared], u[shared] = nearest(path, points, low[shared], high[shared])
    run[shared] = np.searchsorted(path.runs[1:], piece[shared], side="right")
    return run, piece, u


def nearest(path: Path, points: Floats, low: Integers, high: Integers) -> tuple[Integers, Floats]:
    """The places nearest to points (k, axes), each on the pieces from `low` to before `high` (k,)."""
    piece, u = np.empty(len(points), np.int64), np.empty(len(points))
    offsets = np.concatenate(([0], np.cumsum(high - low)))
    start = 0
    while start < len(points):
        stop = max(start + 1, int(np.searchsorted(offsets, offsets[start] + _AT_ONCE, side="right")) - 1)
        own = slice(start, stop)
        piece[own], u[own] = _nearest_of(path, points[own], low[own], (high - low)[own])
        start = stop
    return piece, u


def _nearest_of(path: Path, points: Floats, low: Integers, count: Integers) -> tuple[Integers, Floats]:
    owner = np.repeat(np.arange(len(points)), count)
    begins = np.concatenate(([0], np.cumsum(count)[:-1]))
    pieces = low[owner] + np.arange(len(owner)) - begins[owner]
    shares = np.linspace(0.0, 1.0, _TRIED)
    tried = (path.width[pieces][:, None] * shares).ravel()
    places = path.curve.evaluate(np.repeat(pieces, _TRIED), tried)[0]
    away = np.linalg.norm(places - np.repeat(points[owner], _TRIED, axis=0), axis=1).reshape(-1, _TRIED)
    nearest = away.argmin(axis=1)
    away = away.min(axis=1)
    # For each point, the first of its pieces with the least distance.
    least = np.minimum.reduceat(away, begins)
    leading = np.flatnonzero(away == least[owner])
    best = leading[np.searchsorted(owner[leading], np.arange(len(points)))]
    piece, u = pieces[best], tried[best * _TRIED + nearest[best]]
    width, found = path.width[piece], u
    for _ in range(_STEPS):
        place, tangent = path.curve.evaluate(piece, u, 1)
        square = (tangent**2).sum(axis=1)
        step = np.divide(
            ((points - place) * tangent).sum(axis=1), square, out=np.zeros_like(u), where=square > 0
        )
        if (np.abs(step) <= _FOUND * width).all():
            break
        u = np.clip(u + step, 0.0, width)
        away = np.linalg.norm(path.curve.evaluate(piece, u)[0] - points, axis=1)
        found, least = np.where(away < least, u, found), np.minimum(away, least)
    return piece, found

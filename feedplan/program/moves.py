"""Collects lines, arcs and curves as the moves of a program, for the readers of drawings and path files."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from feedplan.arrays import Floats
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.axis import AXIS_LETTERS
from feedplan.program.program import MoveKind, PathControl, Program

# Ends closer than this are the same point [mm, deg]: they may be rounded to four decimals.
TOUCHING = 2e-4

# The feed [mm/s] of moves without one: above the speed of every machine, but finite, because these moves are
# no rapids.
NO_FEED = 1e6


class Moves:
    """Moves of a program in `axes`, which are in the order XYZABCUVW and include X, Y and Z.

    `feed` [mm/s, deg/s] is the feed of moves that have none; by default the feed does not limit them.
    """

    def __init__(self, axes: tuple[str, ...], feed: float | None = None) -> None:
        self.axes = axes
        self._feed = NO_FEED if feed is None else feed
        self._start: Floats | None = None
        self._position: Floats = np.zeros(len(axes))
        self._rows: list[tuple[MoveKind, float, int]] = []
        self._targets: list[Floats] = []
        self._arcs: list[tuple[int, Floats, float]] = []
        self._splines: list[tuple[int, CompositeCurve]] = []

    def gap(self, point: Floats) -> float:
        """The greatest difference in one coordinate [mm, deg] between a point and the end of the last move; 0
        before the first move."""
        return 0.0 if self._start is None else float(np.abs(point - self._position).max())

    def go_to(self, point: Floats, line: int) -> None:
        """Adds a rapid to a point (axes,), unless the tool is there already; the first point is the start."""
        if self._start is None:
            self._start = self._position = point
        elif self.gap(point) > TOUCHING:
            self._move(MoveKind.RAPID, point, np.inf, line)

    def line(self, target: Floats, feed: float | None, line: int) -> None:
        """Adds a straight move, unless it has no length."""
        if self.gap(target) > 0.0:
            self._move(MoveKind.LINE, target, feed, line)

    def arc(self, target: Floats, centre: ArrayLike, angle: float, feed: float | None, line: int) -> None:
        """Adds an arc in XY about `centre` (3,) through `angle` [rad], positive counter-clockwise."""
        self._arcs.append((len(self._rows), np.asarray(centre, dtype=np.float64), angle))
        self._move(MoveKind.ARC, target, feed, line)

    def spline(self, curve: CompositeCurve, feed: float | None, line: int) -> None:
        """Adds a curve in all axes, unless all its points coincide; its first point is set exactly to the
        tool's position."""
        control = curve.control_points.copy()
        control[0] = self._position
        if (control == control[0]).all():
            return
        self._splines.append(
            (len(self._rows), CompositeCurve(control, curve.weights, curve.offsets, curve.width))
        )
        self._move(MoveKind.SPLINE, control[-1], feed, line)

    def _move(self, kind: MoveKind, target: Floats, feed: float | None, line: int) -> None:
        self._rows.append((kind, self._feed if feed is None else feed, line))
        self._targets.append(target)
        self._position = target

    def __len__(self) -> int:
        return len(self._rows)

    def program(self, name: str, warnings: tuple[str, ...]) -> Program:
        """The program; it ends with a full stop."""
        count = len(self._rows)
        kind, feed, line = (np.array(column) for column in zip(*self._rows, strict=True))
        stop = np.zeros(count, dtype=np.bool_)
        stop[-1] = True
        nan = np.full(count, np.nan)
        curves = [curve for _, curve in self._splines]
        pieces = np.concatenate([[0], np.cumsum([len(curve) for curve in curves], dtype=np.int64)])
        return Program(
            name=name,
            axes=self.axes,
            start=np.zeros(len(self.axes)) if self._start is None else self._start,
            kind=kind.astype(np.uint8),
            target=np.array(self._targets),
            feed=feed.astype(np.float64),
            line=line.astype(np.int32),
            control=np.full(count, PathControl.TOLERANCE, dtype=np.uint8),
            blend_tolerance=nan,
            fit_tolerance=nan.copy(),
            stop=stop,
            dwell=np.zeros(count),
            arc_move=np.array([row for row, _, _ in self._arcs], dtype=np.int64),
            arc_centre=np.array([centre for _, centre, _ in self._arcs]).reshape(-1, 3),
            arc_normal=np.full(len(self._arcs), 2, dtype=np.uint8),
            arc_angle=np.array([angle for _, _, angle in self._arcs], dtype=np.float64),
            spline_move=np.array([row for row, _ in self._splines], dtype=np.int64),
            spline_pieces=pieces.astype(np.int64),
            splines=CompositeCurve.joined(curves, gap=np.inf) if curves else None,
            warnings=warnings,
        )


def program_axes(letters: tuple[str, ...]) -> tuple[str, ...]:
    """The given letters together with X, Y, Z, in the order of a program."""
    return tuple(letter for letter in AXIS_LETTERS if letter in {*letters, "X", "Y", "Z"})

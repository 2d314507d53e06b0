"""A part program as moves: the result of every reader, and the input of the path builder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import Moves
from feedplan.arrays import Flags, Floats, Integers
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.native import OfNative
from feedplan.program.events import Events
from feedplan.units import counted

LINEAR_AXES = "XYZ"


class MoveKind(IntEnum):
    """The kind of a move."""

    RAPID = 0
    LINE = 1
    ARC = 2
    SPLINE = 3


class StopCause(IntEnum):
    """The cause of a full stop after a move; if there are several, the one with the greatest number."""

    NONE = 0
    CHANGE = 1  # of the coordinate mode or the tool length
    SWITCH = 2  # of spindle, coolant and the like
    DWELL = 3
    PAUSE = 4  # M0, M1, M60
    TOOL = 5  # M6
    END = 6


class PathControl(IntEnum):
    """How closely the programmed path is followed: G61.1, G61, G64."""

    EXACT_STOP = 0
    EXACT_PATH = 1
    TOLERANCE = 2


# Types of the columns that native code takes.
_DTYPES = {
    **dict.fromkeys(("start", "target", "feed", "blend_tolerance", "fit_tolerance", "dwell"), np.float64),
    **dict.fromkeys(("arc_centre", "arc_angle", "change_start"), np.float64),
    **dict.fromkeys(("arc_move", "spline_move", "spline_pieces", "change_move"), np.int64),
    **dict.fromkeys(("kind", "control", "arc_normal"), np.uint8),
    "line": np.int32,
    "stop": np.bool_,
}


@dataclass(frozen=True, eq=False)
class Program(OfNative[Moves]):
    """Moves of a part program in order, in machine coordinates [mm, deg].

    `axes` are the letters of its columns: readers give X, Y, Z and all others that the program uses, in the
    order XYZABCUVWIJK. `start` (axes,) is the position where the first move begins, after a pause of
    `start_dwell` [s].

    Each of the n moves has

    - `kind` (MoveKind), `line` (1-based source line) and `target` (n, axes), its end position;
    - `feed` [mm/s], infinite on rapids only. It counts along X, Y, Z where one of these moves, else along U,
      V, W, else it is in deg/s of the rotary axes; on an arc it counts along the circle or helix;
    - `control` (PathControl), `blend_tolerance` and `fit_tolerance` (G64 P and Q [mm], NaN without them);
    - `stop`: a full stop follows, because of an M word, a dwell or the end; `stop_cause` (StopCause; None
      where only the end stops) and `dwell` [s] after it.

    Each of the k arcs has `arc_move` (index of its move), `arc_centre` (k, 3) in X, Y, Z, `arc_normal` (0, 1,
    2: the axis of rotation X, Y, Z) and `arc_angle` [rad], positive counter-clockwise seen from the tip of
    the normal; it may exceed a turn. All other axes are linear in the angle, and so is the radius, which may
    differ at both ends because coordinates are rounded.

    Each of the k splines has `spline_move` (index of its move) and the pieces of `splines` from
    `spline_pieces` (k + 1,): a curve in all `axes` from the move's start to its target.

    `coordinate_mode` (n,) is the meaning of the axis words, a `CoordinateMode`; `tool_length` (n,) [mm] is
    the tool in the modes TIP and VECTOR, NaN for that of the machine file; both are None where the machine
    has only one mode. In the mode VECTOR the last columns are I, J, K, the unit vector from the tip to the
    spindle; the feed of a move of these alone is the rate at which the tool turns [deg/s]. Columns that a
    mode does not use do not change. A change of mode is a full stop and moves no joint: `change_move` (c,)
    are the first moves in a new mode, and `change_start` (c, axes) their starts in the new words.

    `events` happen between the moves: spindle, coolant, tools, outputs, dwells, stops, messages. `warnings`
    are sentences for the user. For a program that was read, `text` is its file, or its bytes, and `sha256`
    the hash of its bytes; `reading` are the arguments with which `read_program` reads it again as G-code.

    The arrays of the moves' geometry are read-only views of a native object.
    """

    name: str
    axes: tuple[str, ...]
    start: Floats
    kind: NDArray[np.uint8]
    target: Floats
    feed: Floats
    line: NDArray[np.int32]
    control: NDArray[np.uint8]
    blend_tolerance: Floats
    fit_tolerance: Floats
    stop: Flags
    dwell: Floats
    arc_move: Integers = field(default_factory=lambda: np.empty(0, np.int64))
    arc_centre: Floats = field(default_factory=lambda: np.empty((0, 3)))
    arc_normal: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, np.uint8))
    arc_angle: Floats = field(default_factory=lambda: np.empty(0))
    start_dwell: float = 0.0
    spline_move: Integers = field(default_factory=lambda: np.empty(0, np.int64))
    spline_pieces: Integers = field(default_factory=lambda: np.zeros(1, np.int64))
    splines: CompositeCurve | None = None
    coordinate_mode: NDArray[np.uint8] | None = None
    tool_length: Floats | None = None
    change_move: Integers = field(default_factory=lambda: np.empty(0, np.int64))
    change_start: Floats = field(default_factory=lambda: np.empty((0, 0)))
    warnings: tuple[str, ...] = ()
    sha256: str | None = None
    text: FilePath | bytes | None = None
    stop_cause: NDArray[np.uint8] | None = None
    events: Events = field(default_factory=Events.none)
    reading: Mapping[str, Any] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name, dtype in _DTYPES.items():
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype))
        self._hold(Moves(self))

    def __len__(self) -> int:
        return len(self.kind)

    def __repr__(self) -> str:
        return f"<Program {self.name}: {counted(len(self), 'move')} of {' '.join(self.axes)}>"

    def starts(self) -> Floats:
        """The start of each move, in the words of that move (n, axes) [mm, deg]."""
        starts = np.concatenate([self.start[None, :], self.target[:-1]])
        starts[self.change_move] = self.change_start
        return starts

    def moving(self) -> Flags:
        """Whether each move moves each axis (n, axes); an arc moves both axes of its plane."""
        moves = np.empty(self.target.shape, dtype=np.bool_)
        moves[:1] = self.target[:1] != self.start
        moves[1:] = self.target[1:] != self.target[:-1]
        moves[self.change_move] = self.target[self.change_move] != self.change_start
        for column, name in enumerate(LINEAR_AXES):
            if name in self.axes:
                moves[self.arc_move[self.arc_normal != column], self.axes.index(name)] = True
        if self.splines is not None and len(self.spline_move):
            # A move's control points are from the offset of its first piece to that of the next move's.
            points = self.splines.offsets[self.spline_pieces[:-1]]
            control = self.splines.control_points[: self.splines.offsets[self.spline_pieces[-1]]]
            greatest, least = np.maximum.reduceat(control, points), np.minimum.reduceat(control, points)
            moves[self.spline_move] |= greatest > least
        return moves

    def along(self, axes: tuple[str, ...]) -> Program:
        """These moves in the given axes only, in that order.

        Raises InputError if the program lacks one of these axes, or moves another one.
        """
        if axes == self.axes:
            return self
        missing = [name for name in axes if name not in self.axes]
        if missing:
            raise InputError(f"{self.name} has no axis {missing[0]}: it has {', '.join(self.axes)}")
        others = np.array([name not in axes for name in self.axes])
        moved = np.argwhere(self.moving() & others)
        if len(moved):
            move, column = moved[0]
            raise InputError(
                f"{self.name}, line {self.line[move]}: axis {self.axes[column]} moves, and only "
                f"{', '.join(axes)} may: name {self.axes[column]} as well"
            )
        columns = [self.axes.index(name) for name in axes]
        splines = self.splines
        if splines is not None:
            splines = replace(splines, control_points=splines.control_points[:, columns])
        return replace(
            self,
            axes=axes,
            start=self.start[columns],
            target=self.target[:, columns],
            splines=splines,
            change_start=self.change_start[:, columns],
        )

"""A path: polynomial and rational Bézier pieces, grouped into runs between full stops."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import build_path
from feedplan.arguments import instance, is_whole, list_of_names, number, refuse, shown
from feedplan.array_arguments import point_array, refuse_where, within
from feedplan.arrays import Flags, Floats, Integers, lock_arrays
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.errors import InputError
from feedplan.geometry.corners import Corners
from feedplan.geometry.feed_groups import group_feeds, moving_axes
from feedplan.geometry.fit_settings import FitSettings, tolerance_of
from feedplan.geometry.joints import tangent_jumps
from feedplan.geometry.rules import Rules
from feedplan.lazy import cached_property
from feedplan.machine.axis import AXIS_NAME, DIRECTION, NAME_REMEDY
from feedplan.program.program import MoveKind, PathControl, Program
from feedplan.units import counted

DEFAULT_AXES = "XYZABC"

# The greatest distance [mm] between the ends of neighbouring pieces: larger gaps are not rounding.
MAX_GAP = 1e-6

# A speed [mm/s] and an acceleration [mm/s²] with which only the tolerance limits the size of corners.
_ANY_SPEED, _ANY_ACCELERATION = 1e6, 1.0


@dataclass(frozen=True)
class FitSummary:
    """Result of the fit: numbers of G1 `points`, B-`splines` and `polynomials`, and the path's `deviation`
    [mm].

    `points` counts the G1 moves of the fitted chains. Lines that stayed lines are included, and each also
    counts as one spline and one polynomial. `splines` and `polynomials` count what the fit made, before
    pieces are cut at changes of feed and at corners. `deviation` is a certified upper bound of the distance
    between the whole path (arcs and corners too) and the programmed one, in both directions.

    The last three are None except for smooth paths (`Corners.SMOOTH`). They are distances [mm] from the
    program, positive on the outside, away from the centre of curvature. `mean_offset` is the mean over all
    bends (arcs, and points that turn by less than 30°) away from corners: the error of the radius of a hole
    or a boss. `inside` and `outside` are the greatest distances on each side, corners included, at the
    programmed points and at places between them.
    """

    points: int = 0
    splines: int = 0
    polynomials: int = 0
    deviation: float = 0.0
    mean_offset: float | None = None
    inside: float | None = None
    outside: float | None = None

    @classmethod
    def of(
        cls, points: int, splines: int, polynomials: int, deviation: float, offsets: list[float] | None
    ) -> FitSummary:
        """Makes a summary from the numbers of the native fit; `offsets` are the mean offset and the greatest
        distances inside and outside."""
        return cls(points, splines, polynomials, deviation, *(offsets or (None, None, None)))

    @property
    def spline_ratio(self) -> float:
        """Line segments approximated by one B-spline."""
        return self.points / self.splines if self.splines else 1.0

    @property
    def polynomial_ratio(self) -> float:
        """Line segments approximated by one polynomial."""
        return self.points / self.polynomials if self.polynomials else 1.0


@dataclass(frozen=True, eq=False)
class Cut:
    """The curve from which a path was cut: piece i of the path is the fractions `part[i]` (n, 2) of
    `piece[i]` (n,) of the curve.

    Derivatives are computed from `curve`, because differences of a short part's control points lose digits.
    """

    curve: CompositeCurve
    piece: Integers
    part: Floats

    @cached_property
    def even(self) -> CompositeCurve:
        """The curve with all pieces of one degree."""
        return self.curve.elevated(int(self.curve.degree.max()))


@dataclass(frozen=True, eq=False)
class Path:
    """Pieces C_i(u), u in [0, width_i], joined end to end, in runs between full stops.

    `axes` names the columns of `curve` [mm, deg]; its n pieces are polynomial or rational and may differ in
    degree. Within a run the tangent is continuous, unless corners are passed with a velocity jump.

    Each piece has

    - `move` (n, 2), the first and the last program move that it follows, `line` (n,) the source line of the
      first, and `tolerance` (n,), its allowed distance from the program [mm];
    - `feed` (n,), the commanded feed [mm/s], infinite on rapids. Where axes of several groups move,
      `group_feed` (n, 3) has the greatest speeds along X, Y, Z, along U, V, W [mm/s], and of all other axes
      together [deg/s], infinite where none is commanded; more than one is finite on a blend of moves whose
      feeds count along different axes, and then `feed` is the first finite one. None where all axes are one
      group.

    Each of the r runs has

    - `runs` (r + 1,), offsets in the pieces: the tool stands still at the start and the end of each run;
    - `dwell` (r,), the pause after it [s]; `start_dwell` [s] is the pause before the first run;
    - `coordinate_mode` (r,) and `tool_length` (r,) as in a `Program`; None where the machine has one mode;
    - `new_words` (r,): mode or tool length change before the run. The same joint positions are written in
      other words, so the path may jump there.

    `fit` is the result of the fit, `corners` the treatment of the program's corners, and `warnings` are
    sentences for the user. Arrays are read-only: `dataclasses.replace` makes a path with other arrays.
    """

    axes: tuple[str, ...]
    curve: CompositeCurve
    feed: Floats
    move: Integers
    line: NDArray[np.int32]
    runs: Integers
    dwell: Floats
    tolerance: Floats
    fit: FitSummary = field(default_factory=FitSummary)
    start_dwell: float = 0.0
    coordinate_mode: NDArray[np.uint8] | None = None
    tool_length: Floats | None = None
    new_words: Flags = field(default_factory=lambda: np.zeros(0, dtype=bool))
    corners: Corners = Corners.ROUNDED
    warnings: tuple[str, ...] = ()
    group_feed: Floats | None = None

    def __post_init__(self) -> None:
        dtypes = {"feed": float, "move": np.int64, "line": np.int32, "runs": np.int64, "dwell": float}
        for name, dtype in {**dtypes, "tolerance": float}.items():
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=dtype))
        if len(self.new_words) == 0:
            object.__setattr__(self, "new_words", np.zeros(len(self.runs) - 1, dtype=bool))
        lock_arrays(self)

    @classmethod
    def from_curve(
        cls, curve: CompositeCurve, *, axes: Sequence[str] | None = None, feed: float = math.inf
    ) -> Path:
        """The path along a curve [mm, deg].

        `axes` are the names of its coordinates, by default the first of XYZABC: up to nine names of a
        machine's axes (see `Axis`). `feed` [mm/s] is the greatest speed along X, Y and Z on pieces that move
        one of these, else along U, V and W, else of all other axes together [deg/s], as in a program; by
        default only the limits of the axes hold. Gaps up to 1e-6 mm are closed.

        Straight pieces, of any degree and with any weights, become lines of degree 1, cut where they turn
        back. Neighbours on one line become one, unless both had degree 1. Curved pieces are cut in their
        cusps. Pieces without length are left out. The path has the same shape and parameter intervals as
        `curve`; only on lines |C'| becomes constant.

        Differences of up to 16 units in the last place of the greatest coordinate count as 0. A piece is
        straight if its control points are within this distance of a line. A curved piece that turns back
        within this distance has a cusp; control points within 1e-9 of the greatest coordinate from the cusp
        are moved into it.

        Runs end at corners, where the path turns back, and in cusps; these are stops. `path.move` gives the
        first and the last piece of `curve` that a piece follows, and all source lines are 0.
        Raises InputError for gaps, and for axes or a feed that cannot be used.
        """
        instance(curve, CompositeCurve, "the curve", "a CompositeCurve")
        names, speed = _names(axes, curve.axes), _feed(feed)
        moving = np.flatnonzero(curve.has_length)
        native, piece, rests = _closed_gaps(curve.take(moving)).native.regular()
        if len(piece) == 0:
            raise InputError("the curve has no length: give control points that differ")
        moves = moving_axes(curve)
        curve = CompositeCurve.of(native)
        stops = (tangent_jumps(curve) > 0).any(axis=1) | rests[:-1, 1] | rests[1:, 0]
        runs = np.concatenate([[0], np.flatnonzero(stops) + 1, [len(curve)]])
        return cls._of(names, curve, speed, runs, moves, moving[piece])

    @classmethod
    def from_bezier(
        cls,
        control_points: ArrayLike,
        weights: ArrayLike | None = None,
        *,
        axes: Sequence[str] | None = None,
        feed: float = math.inf,
    ) -> Path:
        """The path along a Bézier curve; see `CompositeCurve.from_bezier` and `from_curve`.

        The parameter interval is the length of the control polygon.
        """
        return cls._scaled(CompositeCurve.from_bezier(control_points, weights), axes, feed)

    @classmethod
    def from_bspline(
        cls,
        control_points: Any,
        knots: ArrayLike | None = None,
        degree: int | None = None,
        *,
        periodic: bool = False,
        axes: Sequence[str] | None = None,
        feed: float = math.inf,
    ) -> Path:
        """The path along a B-spline; see `CompositeCurve.from_bspline` and `from_curve`.

        The parameter intervals are those of the knots, scaled to the length of the control polygon.
        """
        curve = CompositeCurve.from_bspline(control_points, knots, degree, periodic=periodic)
        return cls._scaled(curve, axes, feed)

    @classmethod
    def from_nurbs(
        cls,
        control_points: ArrayLike,
        knots: ArrayLike,
        degree: int,
        weights: ArrayLike | None = None,
        *,
        periodic: bool = False,
        axes: Sequence[str] | None = None,
        feed: float = math.inf,
    ) -> Path:
        """The path along a NURBS curve; see `CompositeCurve.from_nurbs` and `from_curve`.

        The parameter intervals are those of the knots, scaled to the length of the control polygon.
        """
        curve = CompositeCurve.from_nurbs(control_points, knots, degree, weights, periodic=periodic)
        return cls._scaled(curve, axes, feed)

    @classmethod
    def from_points(
        cls,
        points: ArrayLike,
        tolerance: float,
        *,
        axes: Sequence[str] | None = None,
        feed: float = math.inf,
        settings: FitSettings | None = None,
        corners: Corners = Corners.ROUNDED,
    ) -> Path:
        """The path through `points` (n, axes) [mm, deg], the same as for a program of G1 moves in G64.

        It stays within `tolerance` [mm] of the polygon, both ways: chains are fitted by B-splines, corners
        rounded as far as the tolerance allows, or as `corners` says (ROUNDED, ARCS or SMOOTH); 0 means exact
        lines with stops. `move` counts the chords; `feed` counts along the axes that a chord moves as in
        `from_curve`.
        Raises InputError for points that are too few, repeated or not finite.
        """
        array, _ = point_array(points, None)
        names, speed = _names(axes, array.shape[1]), _feed(feed)
        settings = (
            FitSettings() if settings is None else instance(settings, FitSettings, "settings", "FitSettings")
        )
        if len(array) < 2:
            raise InputError(f"a path of {len(array)} points: give two or more")
        tolerance = tolerance_of(tolerance)
        instance(corners, Corners, "corners", "one of Corners")
        finite: Flags = np.logical_and.reduce(np.isfinite(array), axis=1)
        refuse_where(~finite, lambda i: f"point {i} is not finite: correct its coordinates")
        same: Flags = (array[1:] == array[:-1]).all(axis=1)
        refuse_where(same, lambda i: f"points {i} and {i + 1} coincide: remove one of them")
        with np.errstate(over="ignore"):
            step = np.linalg.norm(np.diff(array, axis=0), axis=1)
        beyond: Flags = ~((step > 0.0) & (step < math.inf))
        refuse_where(
            beyond, lambda i: f"the distance of points {i} and {i + 1} is no number above 0: scale the points"
        )
        count, width = len(array) - 1, array.shape[1]
        lines = Program(
            name="points",
            axes=names,
            start=array[0],
            kind=np.full(count, MoveKind.LINE, dtype=np.uint8),
            target=array[1:],
            feed=np.full(count, speed),
            line=np.zeros(count, dtype=np.int32),
            control=np.full(count, PathControl.TOLERANCE, dtype=np.uint8),
            blend_tolerance=np.full(count, tolerance),
            fit_tolerance=np.full(count, settings.fit_share * tolerance),
            stop=np.zeros(count, dtype=np.bool_),
            dwell=np.zeros(count),
        )
        rules = Rules(
            name=lines.name,
            feed=lines.feed,
            tolerance=lines.blend_tolerance,
            fit_tolerance=lines.fit_tolerance,
            halt=lines.stop,
            joints=np.ones(count, dtype=np.bool_),
            max_velocity=np.full(width, _ANY_SPEED),
            max_acceleration=np.full(width, _ANY_ACCELERATION),
            travel=np.tile([-np.inf, np.inf], (width, 1)),
            jump=False,
            exact_tolerance=settings.exact_tolerance,
            max_chord=settings.max_chord,
            corner_acceleration=math.inf,
            max_speed=_ANY_SPEED,
            corner_angle=math.radians(settings.corner_angle),
            corners=corners.value,
        )
        (curve, _, move, allowed, runs), summary, _, _ = build_path(lines, rules)
        moving = np.diff(array, axis=0) != 0.0
        path = cls._of(names, CompositeCurve.of(curve), speed, runs, moving, move)
        return replace(path, tolerance=allowed, fit=FitSummary.of(*summary), corners=corners)

    @classmethod
    def _of(
        cls,
        axes: tuple[str, ...],
        curve: CompositeCurve,
        feed: float,
        runs: Integers,
        moving: Flags,
        move: Integers,
    ) -> Path:
        """The path along a curve at one feed; `moving` (m, axes) says which axes each move moves."""
        count = len(curve)
        return cls(
            axes=axes,
            curve=curve,
            feed=np.full(count, feed),
            move=move,
            group_feed=group_feeds(axes, moving, np.full(len(moving), feed), curve, move),
            line=np.zeros(count, dtype=np.int32),
            runs=runs,
            dwell=np.zeros(len(runs) - 1),
            tolerance=np.zeros(count),
        )

    @classmethod
    def _scaled(cls, curve: CompositeCurve, axes: Sequence[str] | None, feed: float) -> Path:
        """The path along a curve, with all parameter widths scaled by one factor to sum to about its
        length."""
        edges = np.linalg.norm(np.diff(curve.control_points, axis=0), axis=1)
        edges[curve.offsets[1:-1] - 1] = 0.0
        length = float(edges.sum())
        factor = length / float(curve.width.sum())
        return cls.from_curve(
            curve.with_width(curve.width * factor) if length > 0 else curve, axes=axes, feed=feed
        )

    def __len__(self) -> int:
        return len(self.curve)

    def __repr__(self) -> str:
        pieces, runs = counted(len(self), "piece"), counted(len(self.runs) - 1, "run")
        return f"<Path of {' '.join(self.axes)}: {pieces} in {runs}>"

    @property
    def width(self) -> Floats:
        """The width of each piece's parameter interval (n,) [mm: about the length]."""
        return self.curve.width

    @property
    def length(self) -> float:
        """Length along all axes [mm; for joints in their unit]."""
        return self.lengths.total

    def evaluate(self, s: ArrayLike, order: int = 0) -> Floats:
        """The position at one length or at lengths (n,) from the start: (axes,) or (n, axes) [mm, deg].

        `order` 1 gives the unit tangent there, 2 the curvature vector [1/mm]; NaN where they do not exist.
        Raises InputError for a length that is not on the path, and for another order.
        """
        if not is_whole(order, 0, 2):
            raise InputError(f"the derivative by length is of order {shown(order)}: give 0, 1 or 2")
        lengths = within(s, "length", self.length, "mm")
        values = self.curve.evaluate(*self.lengths.locate(np.atleast_1d(lengths)), order)
        row = 0 if lengths.ndim == 0 else slice(None)
        if order == 0:
            return np.asarray(values[0][row])
        with np.errstate(divide="ignore", invalid="ignore"):
            speed = np.linalg.norm(values[1], axis=1)[:, None]
            tangent = values[1] / speed
            if order == 1:
                return np.asarray(tangent[row])
            along = (values[2] * tangent).sum(axis=1)[:, None]
            return np.asarray(((values[2] - along * tangent) / speed**2)[row])

    @cached_property
    def lengths(self) -> CurveLength:
        """The length along all axes from the start, as a function of piece and u."""
        return CurveLength(self.curve)

    def cut(self, curve: CompositeCurve, piece: Integers) -> Path:
        """This path with its pieces cut: `curve` has the parts in order, part i of piece `piece[i]`."""
        return replace(
            self,
            curve=curve,
            feed=self.feed[piece],
            group_feed=None if self.group_feed is None else self.group_feed[piece],
            move=self.move[piece],
            line=self.line[piece],
            runs=np.searchsorted(piece, self.runs),
            tolerance=self.tolerance[piece],
        )

    @property
    def pauses(self) -> float:
        """Total time of the pauses before the first run and after each run [s]."""
        return self.start_dwell + math.fsum(self.dwell)


def _closed_gaps(curve: CompositeCurve) -> CompositeCurve:
    """The curve, changed so that each piece starts exactly where the piece before it ends. Raises InputError
    for gaps above `MAX_GAP`."""
    control = curve.control_points.copy()
    start, end = curve.offsets[1:-1], curve.offsets[1:-1] - 1
    gap = np.linalg.norm(control[start] - control[end], axis=1)
    refuse_where(
        gap > MAX_GAP,
        lambda i: (
            f"piece {i + 1} starts {gap[i]:g} mm from the end of piece {i}: at most {MAX_GAP:g} mm is "
            "allowed; add a line between them, or give them as two paths"
        ),
    )
    control[start] = control[end]
    return CompositeCurve(control, curve.weights, curve.offsets, curve.width)


def _names(axes: Sequence[str] | None, count: int) -> tuple[str, ...]:
    if axes is None:
        if count > len(DEFAULT_AXES):
            raise InputError(
                f"{count} coordinates and no names: name the axes, as by axes=('j1', 'j2', …) "
                f"(without names there are the first of {DEFAULT_AXES})"
            )
        return tuple(DEFAULT_AXES[:count])
    names = list_of_names(
        tuple(axes) if isinstance(axes, str) else axes,
        "axes",
        f"a list of names, such as {tuple(DEFAULT_AXES[:count])}",
    )
    for name in names:
        if name not in DIRECTION and not AXIS_NAME.fullmatch(name):
            raise refuse("an axis name", name, f"{NAME_REMEDY} but for a direction")
    if len(names) != count or len(set(names)) != count:
        raise InputError(f"the axes are {' '.join(names)} for points of {count} coordinates: name each once")
    return names


def _feed(feed: float) -> float:
    remedy = "a positive feed, or none for the axes' limits alone"
    return number(feed, "feed", remedy, lambda given: given > 0, "mm/s")

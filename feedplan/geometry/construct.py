"""Paths without a program: of Bézier curves, B-splines, NURBS, any curve, and points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import build_path as native_build_path
from feedplan.arguments import instance, list_of_names, number
from feedplan.arguments import refuse as refuse_value
from feedplan.curves._arrays import points, refuse
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.build import FitSettings, tolerance_of
from feedplan.geometry.corners import Corners
from feedplan.geometry.feed_groups import group_feeds, moving_axes
from feedplan.geometry.joints import tangent_jumps
from feedplan.geometry.moves import Moves, Rules
from feedplan.geometry.path import FitSummary, Path
from feedplan.machine.machine import AXIS_NAME, NAME_REMEDY
from feedplan.program.program import MoveKind

DEFAULT_AXES = "XYZABC"

# The ends of neighbouring pieces may be this far apart [mm]: it is what rounding makes of one point.
MAX_GAP = 1e-6

# A speed [mm/s] and an acceleration [mm/s²] for which no corner is too long: the tolerance alone decides.
_ANY_SPEED, _ANY_ACCELERATION = 1e6, 1.0


def path_of_curve(curve: CompositeCurve, axes: Sequence[str] | None, feed: float) -> Path:
    """See `Path.from_curve`."""
    instance(curve, CompositeCurve, "the curve", "a CompositeCurve")
    names, speed = _names(axes, curve.axes), _feed(feed)
    moving = np.delete(np.arange(len(curve)), curve.zero_length)
    native, piece, rests = _closed_gaps(curve.take(moving)).native.regular()
    if len(piece) == 0:
        raise InputError("the curve has no length: give control points that differ")
    moves = moving_axes(curve)
    curve = CompositeCurve.of(native)
    stops = (tangent_jumps(curve) > 0).any(axis=1) | rests[:-1, 1] | rests[1:, 0]
    runs = np.concatenate([[0], np.flatnonzero(stops) + 1, [len(curve)]])
    return _path(names, curve, speed, runs, moves, moving[piece])


def path_of_points(
    given: ArrayLike,
    tolerance: float,
    axes: Sequence[str] | None,
    feed: float,
    settings: FitSettings | None,
    corners: Corners,
) -> Path:
    """See `Path.from_points`."""
    array, _ = points(given, None)
    names, speed = _names(axes, array.shape[1]), _feed(feed)
    settings = (
        FitSettings() if settings is None else instance(settings, FitSettings, "settings", "FitSettings")
    )
    if len(array) < 2:
        raise InputError(f"a path of {len(array)} points: give two or more")
    tolerance = tolerance_of(tolerance)
    instance(corners, Corners, "corners", "one of Corners")
    finite: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(array), axis=1)
    refuse(~finite, lambda i: f"point {i} is not finite: correct its coordinates")
    same: NDArray[np.bool_] = (array[1:] == array[:-1]).all(axis=1)
    refuse(same, lambda i: f"points {i} and {i + 1} coincide: remove one of them")
    count, width = len(array) - 1, array.shape[1]
    moves = Moves(
        name="points",
        start=array[0].copy(),
        kind=np.full(count, MoveKind.LINE, dtype=np.uint8),
        target=array[1:].copy(),
        feed=np.full(count, speed),
        line=np.zeros(count, dtype=np.int32),
        tolerance=np.full(count, float(tolerance)),
        fit_tolerance=np.full(count, settings.fit_share * tolerance),
        halt=np.zeros(count, dtype=np.bool_),
        joints=np.ones(count, dtype=np.bool_),
    )
    rules = Rules(
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
    (curve, _, move, allowed, runs), summary, _, _ = native_build_path(moves, rules)
    moving = np.diff(array, axis=0) != 0.0
    path = _path(names, CompositeCurve.of(curve), speed, runs, moving, move, allowed, FitSummary.of(*summary))
    return replace(path, corners=corners)


def _path(
    axes: tuple[str, ...],
    curve: CompositeCurve,
    feed: float,
    runs: NDArray[np.int64],
    moving: NDArray[np.bool_],
    move: NDArray[np.int64] | None = None,
    tolerance: NDArray[np.float64] | None = None,
    fit: FitSummary | None = None,
) -> Path:
    count = len(curve)
    number = np.arange(count)
    move = np.stack([number, number], axis=1) if move is None else move
    return Path(
        axes=axes,
        curve=curve,
        feed=np.full(count, feed),
        move=move,
        group_feed=group_feeds(axes, moving, np.full(len(moving), feed), curve, move),
        line=np.zeros(count, dtype=np.int32),
        runs=runs,
        dwell=np.zeros(len(runs) - 1),
        tolerance=np.zeros(count) if tolerance is None else tolerance,
        fit=fit or FitSummary(),
    )


def _closed_gaps(curve: CompositeCurve) -> CompositeCurve:
    """The curve with each piece starting exactly where the one before ends."""
    control = curve.control_points.copy()
    start, end = curve.offsets[1:-1], curve.offsets[1:-1] - 1
    gap = np.linalg.norm(control[start] - control[end], axis=1)
    refuse(
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
        if name not in ("I", "J", "K") and not AXIS_NAME.fullmatch(name):
            raise refuse_value("an axis name", name, f"{NAME_REMEDY} but for a direction")
    if len(names) != count or len(set(names)) != count:
        raise InputError(f"the axes are {' '.join(names)} for points of {count} coordinates: name each once")
    return names


def _feed(feed: float) -> float:
    remedy = "a positive feed, or none for the axes' limits alone"
    return number(feed, "feed", remedy, lambda given: given > 0, "mm/s")

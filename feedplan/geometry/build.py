"""Builds the path of a program on a machine: lines, circles, splines, fitted chains, rounded corners,
runs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from feedplan._solvers import build_path as native_build_path
from feedplan.arrays import Flags, Floats, Integers
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError, ProgramError
from feedplan.geometry.corners import Corners
from feedplan.geometry.feed_groups import group_feeds, leading_feed, leading_group, told_apart
from feedplan.geometry.fit_settings import FitSettings, tolerance_of
from feedplan.geometry.joined import joined
from feedplan.geometry.path import FitSummary, Path
from feedplan.geometry.path_words import path_words
from feedplan.geometry.rules import Motion, Rules
from feedplan.machine.axis import usual_units
from feedplan.machine.machine import Machine
from feedplan.program.program import PathControl, Program
from feedplan.progress import Listener, part, tell

# The greatest distance [mm] between the ends of a spline and of its move; they differ only by rounding.
_SPLINE_GAP = 1e-6
# Share of the progress reached when the native builder is done.
_BUILT = 0.9


def build_path(
    program: Program,
    machine: Machine,
    tolerance: float | None = None,
    corners: Corners = Corners.ROUNDED,
    motion: Motion | None = None,
    progress: Listener | None = None,
) -> Path:
    """The path that the machine follows.

    The path-control mode of each move decides how exactly it is followed:

    - G61.1 stops after every move.
    - G61 follows lines and splines exactly, arcs (with rounded ends) and helices within
      `FitSettings.exact_tolerance`, and stops where the direction jumps. A turn of less than a degree beside
      an arc or a spline comes from rounded coordinates: it is smoothed within the same tolerance.
    - G64 stays within a tolerance [mm] of the program, and the program within it of the path: chains of G1
      moves are fitted, and corners are rounded, those of rapids too. The tolerance is `tolerance`, else the
      program's P, else `FitSettings.default_tolerance`; 0 means exact lines with stops. Q limits the fit
      only.

    Where G64 meets G61 the stricter mode holds. On a blend of a rapid and a feed move the feed holds on the
    side of the feed move, up to the place nearest to the corner. Arcs become true circles. Splines keep their
    shape; their parameter widths are scaled to about their length, and pieces without length are left out.
    Only at corners are their ends cut and bent, like those of lines and arcs.

    `corners` chooses another treatment of corners:

    - ARCS: nothing is fitted, and corners of two lines become true arcs within the tolerance. JOINED: as
      ARCS, but first points of G1 moves are left out that are within Q, else the tolerance, of a line.
    - PROGRAMMED: nothing is fitted or rounded, and the path passes corners without a stop.
    - SMOOTH: all moves between two stops, arcs and splines too, are one curve with continuous fourth
      derivative within the tolerance; Q is ignored. Exact moves, with the lines that they touch, are followed
      within `exact_tolerance`. Lines longer than `max_chord` are straight in the middle. Arcs, splines and
      bends of points keep their size. The path stops where a rapid meets a feed below 1e-4 of the machine's
      speed, where an exact path meets another one, and where it turns back by more than 135°. Where it goes
      back along its own line, and nothing else requires a stop, it rests within a run. Where no curve is
      found, corners are rounded one by one between stops, and `Path.warnings` says so. With a `motion` along
      a path of the same program the curve is fitted to its speed: arcs and bends are cut up to the tolerance,
      and turns up to 178° are no stops.

    Corners that cannot be rounded are stops, unless every axis that moves has a `max_velocity_jump`. The tool
    also stops where the coordinate mode or the tool length changes.

    The axes of the path are those that the program names; axes that it names and never moves may be missing
    on the machine. In the mode JOINTS they are in the machine's order, and positions stay within its travel.
    In other modes they are in the order of the kinematics, and travel is checked on the joints afterwards.

    A feed counts along X, Y and Z where a move moves one of these, else along U, V and W, else along the
    rotary axes. A blend of moves whose feeds count along different axes keeps both (`Path.group_feed`); in
    other modes than JOINTS it is a stop. A fitted chain continues across changes of feed: its pieces are cut
    there, so that none is faster than the feed of a block that it follows.

    `progress` is called with the finished share. Raises MachineError (an axis is missing), ProgramError (a
    move has no length, an arc no radius, a spline does not fit its move), InputError (a position outside the
    travel, a negative tolerance).
    """
    settings = FitSettings()
    if tolerance is not None:
        tolerance = tolerance_of(tolerance)
    words = path_words(program, machine)
    tell(progress, 0.0)
    program = program.along(words.names)
    names, splines = program.axes, _splines(program)
    limit, fit_limit = _tolerances(program, tolerance, settings, corners)
    exact = settings.exact_tolerance if not tolerance else min(tolerance, settings.exact_tolerance)
    halt = program.stop | (program.dwell > 0) | (program.control == PathControl.EXACT_STOP)
    halt[:-1] |= words.changes
    moving = program.moving()
    if not words.joints.all():
        halt[:-1] |= _changes_of_group(names, moving)

    taken, left_out, joints = np.arange(len(program)), np.zeros(len(program)), words.joints
    if corners is Corners.JOINED:
        program, taken = joined(program, fit_limit, halt)
        limit, halt, joints = limit[taken], halt[taken], joints[taken]
        left_out, fit_limit = fit_limit[taken], np.zeros(len(taken))
        moving = program.moving()

    tell(progress, 0.0)
    rules = Rules(
        name=program.name,
        feed=told_apart(names, moving, program.feed),
        tolerance=limit,
        fit_tolerance=fit_limit,
        halt=halt,
        joints=joints,
        splines=splines,
        max_velocity=words.max_velocity,
        max_acceleration=words.max_acceleration,
        travel=words.travel,
        jump=words.may_jump or (corners is Corners.PROGRAMMED and bool(words.joints.all())),
        exact_tolerance=exact,
        max_chord=settings.max_chord,
        corner_acceleration=settings.alpha * float(np.linalg.norm(words.max_acceleration)),
        max_speed=float(np.linalg.norm(words.max_velocity)),
        corner_angle=math.radians(settings.corner_angle),
        corners=(Corners.ARCS if corners is Corners.JOINED else corners).value,
    )
    built, summary, outside, rough = native_build_path(program, rules, motion, part(progress, 0.0, _BUILT))
    native, feed, move, allowed, runs = built
    tell(progress, 1.0)
    if outside is not None:
        index, axis, position = outside
        least, greatest = words.travel[axis]
        end, bound = ("begins", least) if position < least else ("ends", greatest)
        (unit,) = usual_units((names[axis],))
        raise InputError(
            f"{program.name}, line {program.line[index]}: {names[axis]} reaches {position:.6g} {unit}, "
            f"its travel {end} at {bound:.6g} {unit}: move the work, or correct the travel of the machine"
        )
    first = move[runs[:-1], 0]
    followed = CompositeCurve.of(native)
    by_group = group_feeds(names, moving, program.feed, followed, move)
    return Path(
        axes=names,
        curve=followed,
        feed=feed if by_group is None else leading_feed(by_group, feed),
        group_feed=by_group,
        move=np.stack([(np.append(0, taken[:-1] + 1))[move[:, 0]], taken[move[:, 1]]], axis=1),
        line=program.line[move[:, 0]],
        runs=runs,
        dwell=program.dwell[move[runs[1:] - 1, 1]],
        tolerance=allowed + np.maximum(left_out[move[:, 0]], left_out[move[:, 1]]),
        fit=FitSummary.of(*summary),
        start_dwell=program.start_dwell,
        coordinate_mode=None if program.coordinate_mode is None else program.coordinate_mode[first],
        tool_length=None if program.tool_length is None else program.tool_length[first],
        new_words=_new_words(program, first),
        corners=corners,
        warnings=_rough_places(program, *rough),
    )


def _new_words(program: Program, first: Integers) -> Flags:
    """Whether mode or tool length change before each run (r,), whose first move is `first` (r,)."""
    changes = np.searchsorted(program.change_move, first, side="right")
    new: Flags = np.diff(changes, prepend=changes[:1]) > 0
    if program.coordinate_mode is not None:
        new[1:] |= np.diff(program.coordinate_mode[first]) != 0
    if program.tool_length is not None:
        new[1:] |= np.diff(np.nan_to_num(program.tool_length[first], nan=-1.0)) != 0
    return new


def _changes_of_group(names: tuple[str, ...], moving: Flags) -> Flags:
    """(m − 1,) whether the feed of the next move counts along other axes than that of the move before."""
    leading = leading_group(names, moving)
    return np.asarray((leading[1:] != leading[:-1]) & (leading[1:] >= 0) & (leading[:-1] >= 0))


def _rough_places(program: Program, reversals: Integers, zones: Integers) -> tuple[str, ...]:
    """Sentences on the stops of a smooth path that the program does not require."""
    sentences = []
    if len(reversals):
        sentences.append(
            f"{_lines(program, reversals)}: the path turns back by more than 135°, and stops: no curve "
            "within the tolerance goes around it"
        )
    if len(zones):
        sentences.append(
            f"{_lines(program, zones[:, 0])}: no smooth curve was found within the tolerance: corners are "
            "rounded one by one there, between stops; allow more tolerance"
        )
    return tuple(sentences)


def _lines(program: Program, moves: Integers, most: int = 5) -> str:
    """The source lines of some moves, the first ones by number."""
    lines = list(dict.fromkeys(program.line[moves].tolist()))
    shown = ", ".join(str(line) for line in lines[:most])
    rest = f" and {len(lines) - most} more" if len(lines) > most else ""
    return f"line {shown}{rest}"


def _splines(program: Program) -> CompositeCurve | None:
    """The program's splines, with their end points set exactly to the starts and targets of their moves."""
    if program.splines is None or len(program.spline_move) == 0:
        return None
    curve, move, pieces = program.splines, program.spline_move, program.spline_pieces
    control = curve.control_points.copy()
    # Every piece starts where the one before ends, and the first one where its move starts.
    first, last = curve.offsets[:-1], curve.offsets[1:] - 1
    given = control[first].copy()
    control[first[1:]] = control[last[:-1]]
    control[first[pieces[:-1]]] = program.starts()[move]
    ends = program.target[move]
    end_missed = np.abs(control[last[pieces[1:] - 1]] - ends).max(axis=1, initial=0.0)
    control[last[pieces[1:] - 1]] = ends
    start_missed = np.abs(control[first] - given).max(axis=1, initial=0.0)
    for missed, owner in (
        (start_missed, np.searchsorted(pieces, np.arange(len(first)), side="right") - 1),
        (end_missed, np.arange(len(move))),
    ):
        apart = missed > _SPLINE_GAP
        if apart.any():
            line = int(program.line[move[owner[int(apart.argmax())]]])
            raise ProgramError(
                f"{program.name}, line {line}: the spline leaves a gap of {missed[apart][0]:.3g} mm: "
                f"at most {_SPLINE_GAP:g} mm is allowed; correct its points",
                line,
            )
    return replace(curve, control_points=control)


def _tolerances(
    program: Program, tolerance: float | None, settings: FitSettings, corners: Corners
) -> tuple[Floats, Floats]:
    """For each move the allowed deviation, and the part of it for the fit [mm]; 0 where the path is exact."""
    if tolerance is None:
        limit = np.where(
            np.isnan(program.blend_tolerance), settings.default_tolerance, program.blend_tolerance
        )
        fit_limit = np.where(np.isnan(program.fit_tolerance), np.inf, program.fit_tolerance)
    else:
        limit = np.full(len(program), tolerance)
        fit_limit = np.full(len(program), np.inf)
    may_leave = (program.control == PathControl.TOLERANCE) & (corners is not Corners.PROGRAMMED)
    limit = np.where(may_leave, limit, 0.0)
    if corners is Corners.JOINED:
        return limit, np.where(np.isinf(fit_limit), limit, np.where(may_leave, fit_limit, 0.0))
    if corners is not Corners.ROUNDED:  # other treatments of corners fit no chains
        return limit, np.zeros(len(program))
    return limit, np.minimum(fit_limit, settings.fit_share * limit)

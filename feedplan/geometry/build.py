"""A program on a machine becomes a path: lines, arcs, fitted chains of G1 moves, corners and runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import build_path as native_build_path
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError, MachineError
from feedplan.geometry.path import FitSummary, Path
from feedplan.machine.machine import Machine
from feedplan.program.program import MoveKind, PathControl, Program

LINEAR_AXES = "XYZ"
PARALLEL_AXES = "UVW"


@dataclass(frozen=True)
class FitSettings:
    """How closely and how smoothly a program is followed.

    `default_tolerance` [mm] holds in G64 stretches without a P, and where a program says nothing: a hundredth
    is what machining tolerances leave to a controller.
    `exact_tolerance` [mm] is what "exactly" means for arcs, which become quadratics; lines are exact in G61
    and G61.1. It bounds the arcs of G64 as well: halving it costs one sixth more pieces.
    `fit_share` is the part of the tolerance that the fit may use: where the program gives no Q, and at most.
    Corners are rounded by what the fit leaves.
    `max_chord` [mm]: longer G1 chords stay lines. A long chord among short ones was meant as a line.
    `alpha`: chains are broken where their curvature exceeds alpha·a_max/F² (Zhang et al. 2010, eq. 2; they
    take 4 or 9), a_max being the combined acceleration of the axes and F the greatest feed of the chain.
    `corner_angle` [deg]: a chain that turns less at a breaking point stays smooth there. A polygon of 14 or
    more equal chords is read as a curve, a twelve-sided one as corners.
    """

    default_tolerance: float = 0.01
    exact_tolerance: float = 0.001
    fit_share: float = 0.5
    max_chord: float = 5.0
    alpha: float = 4.0
    corner_angle: float = 27.5

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0:
                raise InputError(f"fit setting {field.name} is {value}: give a positive number")
        if self.fit_share >= 1:
            raise InputError(f"fit setting fit_share is {self.fit_share}: give a number below 1")


def build_path(
    program: Program,
    machine: Machine,
    tolerance: float | None = None,
    settings: FitSettings | None = None,
) -> Path:
    """The path that the machine follows.

    G61.1 stops after every move. G61 follows lines exactly and arcs within `settings.exact_tolerance`, and
    stops where the direction breaks; only where rounded coordinates leave an arc and its neighbour a turn of
    less than a degree is that smoothed, within the same tolerance. G64 stays within its tolerance, both ways:
    chains of G1 moves are fitted and corners are rounded. The tolerance [mm] is `tolerance`, else the
    program's P, else `settings.default_tolerance`; 0 means exact lines with stops. Q bounds the fit alone.
    Where G64 meets G61 the joint belongs to the stricter of them. Rapids are lines of their own.

    Corners that cannot be rounded are stops, unless every axis that moves has a `max_velocity_jump`. Axes
    that the program moves must be there; axes that it names and never moves are left out.
    A fitted chain is followed across changes of feed; its pieces are cut there, so that none is faster than
    a block it covers. Where rotary axes move along with X, Y and Z, a feed counts along X, Y and Z and is
    handed on as the speed in all axes that gives it.

    Raises MachineError (an axis is missing), ProgramError (a move has no length, an arc no radius),
    InputError (a position outside the travel, a negative tolerance).
    """
    settings = settings or FitSettings()
    if tolerance is not None and not 0 <= tolerance < math.inf:
        raise InputError(
            f"the tolerance is {tolerance}: give 0 (exact lines with stops) or a positive number [mm]"
        )
    columns = _path_columns(program, machine)
    names = tuple(program.axes[column] for column in columns)
    axes = [machine.axis(name) for name in names]
    start = np.ascontiguousarray(program.start[columns])
    target = np.ascontiguousarray(program.target[:, columns])
    moving = (np.diff(target, axis=0, prepend=start[None]) != 0).any(axis=0)
    arc_plane = _arc_planes(program, names)
    moving[np.unique(arc_plane)] = True
    limit, fit_limit = _tolerances(program, tolerance, settings)
    max_velocity = np.array([axis.max_velocity for axis in axes])
    max_acceleration = np.array([axis.max_acceleration for axis in axes])
    exact = settings.exact_tolerance if not tolerance else min(tolerance, settings.exact_tolerance)
    halt = program.stop | (program.dwell > 0) | (program.control == PathControl.EXACT_STOP)

    (control, width, feed, move, allowed, runs), summary, outside = native_build_path(
        program.name,
        start,
        program.kind,
        target,
        _feed_in_all_axes(program, start, target, names),
        program.line,
        limit,
        fit_limit,
        halt,
        program.arc_move,
        arc_plane,
        np.ascontiguousarray(np.take_along_axis(program.arc_centre, _plane_letters(program), axis=1)),
        program.arc_angle,
        max_velocity,
        max_acceleration,
        np.array([axis.travel for axis in axes]),
        all(axis.max_velocity_jump > 0 for axis, moves in zip(axes, moving, strict=True) if moves),
        exact,
        settings.max_chord,
        settings.alpha * float(np.linalg.norm(max_acceleration)),
        float(np.linalg.norm(max_velocity)),
        math.radians(settings.corner_angle),
    )
    if outside is not None:
        index, axis, position = outside
        least, greatest = axes[axis].travel
        end, bound = ("begins", least) if position < least else ("ends", greatest)
        raise InputError(
            f"{program.name}, line {program.line[index]}: {names[axis]} reaches {position:.6g} mm, "
            f"its travel {end} at {bound:.6g} mm: move the work, or correct the travel of the machine"
        )
    points, splines, polynomials, deviation = summary
    return Path(
        axes=names,
        curve=CompositeCurve.from_pieces(control, width),
        feed=feed,
        move=move,
        line=program.line[move[:, 0]],
        runs=runs,
        dwell=program.dwell[move[runs[1:] - 1, 1]],
        tolerance=allowed,
        fit=FitSummary(points, splines, polynomials, deviation),
        start_dwell=program.start_dwell,
    )


def _path_columns(program: Program, machine: Machine) -> list[int]:
    """Columns of the program's axes that the machine has, in the machine's order."""
    for column, name in enumerate(program.axes):
        if name in machine.axis_names:
            continue
        moves = np.diff(program.target[:, column], prepend=program.start[column]) != 0
        if name in LINEAR_AXES:
            moves[program.arc_move[program.arc_normal != LINEAR_AXES.index(name)]] = True
        if moves.any():
            line = program.line[int(moves.argmax())]
            raise MachineError(
                f"{program.name}, line {line}: axis {name} moves and machine {machine.name} has none: "
                f"choose a machine with {name}, or add it to the machine file"
            )
    columns = [program.axes.index(name) for name in machine.axis_names if name in program.axes]
    if not columns:
        raise MachineError(f"{program.name} moves no axis of machine {machine.name}: choose another machine")
    return columns


def _plane_letters(program: Program) -> NDArray[np.int64]:
    """(k, 2) the axes of the plane of each arc, turning from the first to the second at a positive angle."""
    normal = program.arc_normal.astype(np.int64)
    return np.stack([(normal + 1) % 3, (normal + 2) % 3], axis=1)


def _arc_planes(program: Program, names: tuple[str, ...]) -> NDArray[np.int64]:
    """(k, 2) the columns of the path for the plane of each arc."""
    columns = np.array([names.index(name) if name in names else -1 for name in LINEAR_AXES])
    return np.ascontiguousarray(columns[_plane_letters(program)])


def _tolerances(
    program: Program, tolerance: float | None, settings: FitSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Per move the allowed deviation and the fit's share of it [mm]; 0 where the path is exact."""
    if tolerance is None:
        limit = np.where(
            np.isnan(program.blend_tolerance), settings.default_tolerance, program.blend_tolerance
        )
        fit_limit = np.where(np.isnan(program.fit_tolerance), np.inf, program.fit_tolerance)
    else:
        limit = np.full(len(program), tolerance)
        fit_limit = np.full(len(program), np.inf)
    limit = np.where(program.control == PathControl.TOLERANCE, limit, 0.0)
    return limit, np.minimum(fit_limit, settings.fit_share * limit)


def _feed_in_all_axes(
    program: Program, start: NDArray[np.float64], target: NDArray[np.float64], names: tuple[str, ...]
) -> NDArray[np.float64]:
    """Feeds as speeds in all axes together: the speed at which the axes that a feed counts along have it."""
    groups = [
        [column for column, name in enumerate(names) if name in letters]
        for letters in (LINEAR_AXES, PARALLEL_AXES)
    ]
    if len(groups[0]) == len(names):
        return program.feed
    step = np.diff(target, axis=0, prepend=start[None])
    length_sq = step**2
    # Along an arc the plane axes move by more than the chord says.
    arc = program.arc_move
    linear = [program.axes.index(letter) for letter in LINEAR_AXES]
    arc_start = np.vstack([program.start, program.target])[arc][:, linear]
    spoke = np.take_along_axis(arc_start - program.arc_centre, _plane_letters(program), axis=1)
    radius = np.linalg.norm(spoke, axis=1)
    planes = _arc_planes(program, names)
    length_sq[arc, planes[:, 0]] = (radius * program.arc_angle) ** 2
    length_sq[arc, planes[:, 1]] = 0.0
    counted = np.zeros(len(program))
    for group in (*groups, list(range(len(names)))):
        counted = np.where(counted > 0, counted, length_sq[:, group].sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        speed: NDArray[np.float64] = program.feed * np.sqrt(length_sq.sum(axis=1) / counted)
    return np.where((program.kind == MoveKind.RAPID) | (counted == 0), program.feed, speed)

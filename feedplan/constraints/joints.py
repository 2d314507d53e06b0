"""Joint motion along a path: one polynomial piece of the joints for each piece of the tool's path.

K is the map from tool to joints. Where K is affine, the control points of the joints are K of the control
points of the tool. Elsewhere q'' is interpolated with a proven error (`feedplan.machine.joint_interpolants`),
and the tool's pieces are cut at the same places. At every speed that the other limits allow, the acceleration
error of an axis is some 1e-9 of its limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.tool_motion import linear_motion
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.speed_polynomial import SpeedPolynomial, interpolated_squares
from feedplan.errors import InputError
from feedplan.geometry.path import Cut, Path
from feedplan.machine.axis import DIRECTION, size_of
from feedplan.machine.axis_words import AxisWords, axis_words
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.joint_interpolants import (
    SPEED_SHARE,
    Accuracy,
    Interpolants,
    SquareOfSpeed,
    joint_interpolants,
)
from feedplan.machine.machine import Machine
from feedplan.machine.path_derivatives import positions
from feedplan.machine.singularities import JointPath, joint_path

# Joint positions that differ by less than this count as equal [mm, deg].
MEETING = 1e-6
# Number of Chebyshev points of q'': it gives the joints' pieces the greatest degree that a curve may have.
NODES = 8


def way_scale(axes: tuple[str, ...], machine: Machine) -> Floats:
    """The weight of each axis of a path in the path's length (axes,), 1 for linear axes.

    A degree of a rotary axis counts as the distance [mm] that the slowest linear axis covers while the rotary
    axis turns by one degree, both at full speed. A tool direction (I, J, K) counts by the angle that it
    turns, at the speed of the slowest rotary axis.
    """
    linear = [size_of(axis.max_velocity) for axis in machine.axes if axis.kind == "linear"]
    rotary = {axis.name: size_of(axis.max_velocity) for axis in machine.axes if axis.kind == "rotary"}
    speed = min(linear, default=1.0)
    direction = math.degrees(speed / min(rotary.values(), default=1.0))
    scale = [direction if name in DIRECTION else speed / rotary.get(name, speed) for name in axes]
    return np.array(scale)


def joint_motion(path: Path, machine: Machine, feed: Floats) -> tuple[Path, dict[str, Any]]:
    """The path, cut so that each of its pieces matches one piece of the joints' motion, and the fields of a
    `Problem` that describe this motion.

    `feed` (n,) [mm/s] is the greatest speed of each piece. Raises InputError with the source line where the
    tool passes a singular position or a joint leaves its travel.
    """
    motions: list[_Motion] = []
    words: list[AxisWords] = []
    start = None
    for own, group in groupby(_words(path, machine)):
        first = len(words)
        words += group
        pieces = np.arange(path.runs[first], path.runs[len(words)])
        motion = _posed(_Task(path, machine, own, pieces, feed, start))
        if start is not None:
            _require_meeting(machine, int(path.line[pieces[0]]), start, motion)
        words[first:] = [motion.words] * (len(words) - first)
        motions.append(motion)
        start = motion.origin[-1] + motion.joints.control_points[-1]
    whole = _Motion.joined(motions)
    return path.cut(whole.tool, whole.piece), {
        "joints": whole.joints,
        "joint_origin": whole.origin,
        "joint_axes": machine.axis_names,
        "tip_speed": whole.speed,
        "way_scale": way_scale(path.axes, machine),
        "words": tuple(words),
        "cut": Cut(path.curve, whole.piece, whole.part),
    }


def _require_meeting(machine: Machine, line: int, start: Floats, motion: _Motion) -> None:
    """Raises InputError unless the joints of `motion` begin at `start`, where the motion before ended: a
    change of mode must not move a joint."""
    begin = motion.origin[0] + motion.joints.control_points[0]
    apart = np.abs(begin - start)
    k = int(apart.argmax())
    if apart[k] > MEETING:
        axis = machine.axes[k]
        raise InputError(
            f"line {line}: {axis.name} is to begin at {begin[k]:.6g} {axis.unit}, and the path before ends "
            f"at {start[k]:.6g}: its rounded corners pass a singular position on another side than the "
            "blocks do; lower the tolerance there, or stop between these blocks (G61)"
        )


@dataclass(frozen=True)
class _Task:
    """Pieces of consecutive runs with the same kinematics; `start` are the joint positions before them, None
    at the start of the path."""

    path: Path
    machine: Machine
    words: AxisWords
    pieces: Integers
    feed: Floats
    start: Floats | None

    def line(self, piece: int) -> int:
        """Source line of one of the pieces."""
        return int(self.path.line[self.pieces[piece]])

    def linear(self, curve: CompositeCurve) -> CompositeCurve:
        """The motion in X, Y and Z alone."""
        return linear_motion(curve, self.path.axes)

    def direction(self, curve: CompositeCurve) -> CompositeCurve:
        """The motion in I, J and K alone."""
        columns = [self.path.axes.index(name) for name in DIRECTION]
        return replace(curve, control_points=curve.control_points[:, columns])


@dataclass(frozen=True)
class _Motion:
    """Joint motion on n parts of pieces of the path under one kinematics.

    For each part: `piece` (n,) is its piece of the path, `part` (n, 2) its first and last fraction of that
    piece, `tool` its curve in the path, `joints` its curve in the joints, relative to `origin` (n, joints)
    [mm, deg], and `speed` the square of the tool's speed.
    """

    words: AxisWords
    piece: Integers
    part: Floats
    tool: CompositeCurve
    joints: CompositeCurve
    origin: Floats
    speed: SpeedPolynomial

    @classmethod
    def joined(cls, motions: Sequence[_Motion]) -> _Motion:
        """Several motions as one, in the order of their pieces; the result has the `words` of the first."""
        piece = np.concatenate([motion.piece for motion in motions])
        order = np.argsort(piece, kind="stable")
        return cls(
            motions[0].words,
            piece[order],
            np.concatenate([motion.part for motion in motions])[order],
            CompositeCurve.joined([motion.tool for motion in motions], math.inf).take(order),
            CompositeCurve.joined([motion.joints for motion in motions], math.inf).take(order),
            np.concatenate([motion.origin for motion in motions])[order],
            SpeedPolynomial.joined([motion.speed for motion in motions]).take(order),
        )


def _words(path: Path, machine: Machine) -> list[AxisWords]:
    """The axis words of each run; runs with equal mode and tool length share one object."""
    same: list[Any] = [None] * (len(path.runs) - 1)
    modes = same if path.coordinate_mode is None else map(CoordinateMode, path.coordinate_mode.tolist())
    lengths = same if path.tool_length is None else path.tool_length.tolist()
    keys = [(mode, None if length != length else length) for mode, length in zip(modes, lengths, strict=True)]
    known = {
        (mode, length): axis_words(machine, path.axes, mode, tool_length=length)
        for mode, length in dict.fromkeys(keys)
    }
    return [known[key] for key in keys]


def _posed(task: _Task) -> _Motion:
    """The joint motion of a task. For a tool direction, which two poses can give, it takes the pose whose
    rotary joints are nearest to `start`; at the start of the path, the first pose that is possible."""
    make = _affine if task.words.kinematics.affine else _curved
    words, start = task.words, task.start
    if words.coordinate_mode is not CoordinateMode.VECTOR:
        return make(task)
    poses = [words, words.other_pose]
    if start is not None:
        curve = task.path.curve
        tip = words.tip(curve.control_points[curve.offsets[task.pieces[0]]][None])
        rotary = np.array(words.kinematics.rotary)
        turns = [(positions(pose.kinematics, tip)[0] - start)[rotary] for pose in poses]
        away = [float(np.abs((turn + 180.0) % 360.0 - 180.0).sum()) for turn in turns]
        return make(replace(task, words=poses[int(np.argmin(away))]))
    try:
        return make(task)
    except InputError as fault:
        try:
            return make(replace(task, words=poses[1]))
        except InputError:
            raise fault from None


def _affine(task: _Task) -> _Motion:
    """Joint motion for affine kinematics: the joints' control points are weighted sums of the path's.

    Rational pieces are interpolated by polynomials (`_curved`), so that |C'|² and the joints have the same
    parameter.
    """
    tool, words, machine = task.path.curve.take(task.pieces), task.words, task.machine
    rational = tool.rational
    if rational.any():
        curved = _curved(replace(task, pieces=task.pieces[rational]))
        if rational.all():
            return curved
        straight = _affine(replace(task, pieces=task.pieces[~rational]))
        return _Motion.joined([straight, curved])
    tool = replace(tool, weights=None)
    tips = replace(tool, control_points=words.tip(tool.control_points))
    joints = replace(tool, control_points=positions(words.kinematics, tips.control_points))
    travel = np.array([axis.travel for axis in machine.axes])
    if ((joints.control_points < travel[:, 0]) | (joints.control_points > travel[:, 1])).any():
        _route(task, tips)
    linear = task.linear(tool)
    speed = _either(SpeedPolynomial.of(linear), SpeedPolynomial.of(tool), linear.has_length)
    origin = joints.control_points[joints.offsets[:-1]]
    local = joints.control_points - np.repeat(origin, np.diff(joints.offsets), axis=0)
    whole = np.tile([0.0, 1.0], (len(tool), 1))
    return _Motion(words, task.pieces, whole, tool, replace(joints, control_points=local), origin, speed)


def _route(task: _Task, tips: CompositeCurve) -> JointPath:
    """The joint positions along the tips, elevated to one degree; raises InputError for the first place that
    the joints cannot pass."""
    tips = tips.elevated(int(tips.degree.max()))
    kinematics, travel = task.words.kinematics, [axis.travel for axis in task.machine.axes]
    route = joint_path(kinematics, tips.by_piece, tips.width, travel, tips.weights_by_piece, task.start)
    if route.places:
        place = route.places[0]
        raise InputError(place.sentence(kinematics, task.line(place.piece)))
    return route


def _curved(task: _Task) -> _Motion:
    """Joint motion by polynomials that interpolate K of the tool's pieces, for all other pieces."""
    kinematics, curve = task.words.kinematics, task.path.curve.take(task.pieces)
    tips = replace(curve, control_points=task.words.tip(curve.control_points))
    tips = tips.elevated(int(tips.degree.max()))
    control, width, weights = tips.by_piece, tips.width, tips.weights_by_piece
    route = _route(task, tips)
    moves = task.linear(curve).has_length
    interpolants = joint_interpolants(
        kinematics, control, width, _accuracy(task, curve, moves), NODES, weights
    )
    near = np.isinf(interpolants.curvature_error).any(axis=1)
    if near.any():
        line = task.line(int(interpolants.piece[near.argmax()]))
        raise InputError(
            f"line {line}: the tool passes so near a singular position of machine {task.machine.name} that "
            "its joints cannot be followed: keep the path farther off it"
        )
    tool = curve.split(interpolants.piece, interpolants.part[:, 0] * width[interpolants.piece]).with_width(
        interpolants.width
    )
    joints = _joint_pieces(interpolants)
    origin = route.positions(interpolants.piece, interpolants.part[:, 0])
    speed = _tool_speed(task.linear(tool))
    if not moves.all():
        speed = _either(speed, _turning_speed(task, tool, joints), moves[interpolants.piece])
    return _Motion(
        task.words, task.pieces[interpolants.piece], interpolants.part, tool, joints, origin, speed
    )


def _turning_speed(task: _Task, tool: CompositeCurve, joints: CompositeCurve) -> SpeedPolynomial:
    """The squared speed of the rotary joints or of the tool direction; the feed limits it where X, Y, Z
    rest."""
    if task.words.coordinate_mode is CoordinateMode.VECTOR:
        square = interpolated_squares(_turning_of(task.direction(tool)), np.arange(len(tool)), tool.width)
        return SpeedPolynomial((1 + SPEED_SHARE) * square.ravel(), np.arange(len(tool) + 1) * square.shape[1])
    rotary = np.array(task.words.kinematics.rotary)
    columns = rotary if rotary.any() else ~rotary
    return SpeedPolynomial.of(replace(joints, control_points=joints.control_points[:, columns]))


def _accuracy(task: _Task, curve: CompositeCurve, moves: Flags) -> Accuracy:
    """The accuracy that the interpolants need: the machine's limits, and squared speeds that are no
    polynomials."""
    even = curve.elevated(int(curve.degree.max()))
    squares = []
    if curve.weights is not None:
        scale = way_scale(task.path.axes, task.machine)
        squares += [
            SquareOfSpeed(task.linear(even).by_piece, curve.rational & moves),
            SquareOfSpeed(np.ascontiguousarray(even.by_piece * scale), curve.rational),
        ]
    if task.words.coordinate_mode is CoordinateMode.VECTOR:
        squares.append(SquareOfSpeed(task.direction(even).by_piece, ~moves, turning=True))
    slowest, fastest = np.array([axis.velocity_range for axis in task.machine.axes]).T
    return Accuracy(
        acceleration=np.array([size_of(axis.max_acceleration) for axis in task.machine.axes]),
        least_velocity=np.ascontiguousarray(slowest),
        greatest_velocity=np.ascontiguousarray(fastest),
        feed=task.feed[task.pieces],
        linear=task.linear(even).by_piece,
        moves=moves,
        squares=squares,
    )


def _turning_of(curve: CompositeCurve) -> Callable[[Integers, Floats], Floats]:
    """A function of piece and u for (dθ/du)² [deg²], θ being the angle by which the direction turns; the
    direction may have any length."""

    def square(piece: Integers, u: Floats) -> Floats:
        direction, slope = curve.evaluate(piece, u, 1)
        across = (np.cross(direction, slope) ** 2).sum(axis=1)
        return np.asarray(np.degrees(1.0) ** 2 * across / (direction**2).sum(axis=1) ** 2)

    return square


def _joint_pieces(interpolants: Interpolants) -> CompositeCurve:
    """The integrals of the slopes, each from 0: second differences of small numbers lose fewer digits."""
    slope, count = interpolants.slope, len(interpolants)
    degree = slope.shape[1]
    steps = np.cumsum(slope, axis=1) * (interpolants.width / degree)[:, None, None]
    points = np.concatenate([np.zeros_like(steps[:, :1]), steps], axis=1)
    return CompositeCurve.from_pieces(points.reshape(count, degree + 1, -1), interpolants.width)


def _tool_speed(linear: CompositeCurve) -> SpeedPolynomial:
    """|C'|²: exact for polynomial pieces; for rational pieces an interpolation, raised so that it is
    never below the true value."""
    speed = SpeedPolynomial.of(linear)
    above = np.repeat(np.where(linear.rational, 1 + SPEED_SHARE, 1.0), np.diff(speed.offsets))
    return replace(speed, coefficients=speed.coefficients * above)


def _either(first: SpeedPolynomial, second: SpeedPolynomial, chosen: Flags) -> SpeedPolynomial:
    """Piece by piece the polynomial of `first` where `chosen` is true, else that of `second`."""
    if chosen.all():
        return first
    pieces = np.arange(len(chosen))
    return SpeedPolynomial.joined([first, second]).take(np.where(chosen, pieces, len(chosen) + pieces))

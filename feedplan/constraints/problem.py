"""The planning problem: a path and every limit that holds on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import Problem as NativeProblem
from feedplan.arguments import not_negative, number
from feedplan.arrays import Floats, Integers, lock_arrays
from feedplan.constraints.feed import FeedRequest, feed_limit, feed_share
from feedplan.constraints.junction import junction_limit
from feedplan.constraints.tool_motion import ToolMotion, linear_motion
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.speed_polynomial import SpeedPolynomial
from feedplan.geometry.corners import Corners
from feedplan.geometry.feed_groups import feed_groups
from feedplan.geometry.path import Cut, Path
from feedplan.lazy import cached_property
from feedplan.machine.axis import Axis, size_of, sizes_of, usual_units
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.units import shared_unit

if TYPE_CHECKING:
    from feedplan.machine.axis_words import AxisWords

Limited = Literal["velocity", "acceleration"]
_BY_AXIS = ("max_velocity", "max_acceleration", "max_jerk", "least_velocity", "least_acceleration")
# The feed of rapids on paths where only the joints limit their speed: faster than any tool [mm/s].
NO_FEED = 1e9


@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise the time along `path` under these limits.

    Each joint (`axes` are the names, `units` the units that replace mm) has `max_velocity` [mm/s],
    `max_acceleration` [mm/s²] and `max_jerk` [mm/s³], which may be infinite. `least_velocity` and
    `least_acceleration` are the limits in the negative direction, empty if they are the negative of the
    others.

    `feed` (n,) [mm/s] is the greatest |(share_k q'_k)| u̇ on each of the n pieces, finite. `feed_share` (n,
    axes) is the factor of each axis in that speed, None where all are 1. `junction_speed` (n + 1,) is the
    greatest speed [mm/s] at the ends of the pieces: 0 at a stop, infinite where only the other limits hold.
    `chord_tolerance` δ [mm] (infinite: no limit) and `period` T [s] limit the speed on a curve of radius ρ to
    (2/T)·√(2ρδ − δ²). `start_speed` and `end_speed` [mm/s] are those at the ends of the path. `velocity_jump`
    (axes,) [mm/s] is the jump that each axis velocity may make at a corner; None means the machine's own.
    `request` are the user's changes to the programmed feeds.

    Where the joints are not the axes of the path,

    - `joints` is their motion [mm, deg]: for each piece of the path one polynomial piece with the same
      parameter, relative to `joint_origin` (n, joints), which is 0 if None; `joint_axes` are their names;
    - `tip_speed` is (v/u̇)² for the speed v that feed and junctions limit;
    - `way_scale` (path axes,) is the weight of each axis in the path's length [mm per mm, deg, or unit of a
      direction], 1 by default;
    - `words` (one a run) are the kinematics from path to joints, and `cut` relates the path's pieces to the
      path before it was cut to match the joints' pieces.
    """

    path: Path
    max_velocity: Floats
    max_acceleration: Floats
    max_jerk: Floats
    feed: Floats
    junction_speed: Floats
    chord_tolerance: float
    period: float
    start_speed: float = 0.0
    end_speed: float = 0.0
    velocity_jump: Floats | None = None
    joint_axes: tuple[str, ...] = ()
    joint_units: tuple[str, ...] = ()
    least_velocity: Floats = field(default_factory=lambda: np.zeros(0))
    least_acceleration: Floats = field(default_factory=lambda: np.zeros(0))
    joints: CompositeCurve | None = None
    joint_origin: Floats | None = None
    tip_speed: SpeedPolynomial | None = None
    way_scale: Floats | None = None
    words: tuple[AxisWords, ...] = ()
    cut: Cut | None = None
    feed_share: Floats | None = None
    request: FeedRequest = field(default_factory=FeedRequest)

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration"):
            if np.array_equal(getattr(self, f"least_{name}"), -np.asarray(getattr(self, f"max_{name}"))):
                object.__setattr__(self, f"least_{name}", np.zeros(0))
        for name in (*_BY_AXIS, "feed", "junction_speed"):
            column = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, column)
        if self.feed_share is not None:
            object.__setattr__(self, "feed_share", np.ascontiguousarray(self.feed_share, dtype=np.float64))
        lock_arrays(self)

    def __repr__(self) -> str:
        return f"<Problem of the joints {' '.join(self.axes)} on {self.path!r}>"

    @property
    def min_velocity(self) -> Floats:
        """The velocity limit of each axis in the negative direction (axes,), at most 0 [mm/s]."""
        return self.least_velocity if len(self.least_velocity) else -self.max_velocity

    @property
    def min_acceleration(self) -> Floats:
        """The acceleration limit of each axis in the negative direction (axes,), at most 0 [mm/s²]."""
        return self.least_acceleration if len(self.least_acceleration) else -self.max_acceleration

    def limits(self, name: Limited) -> Floats:
        """The limits as absolute values (2, axes): those of positive values, then those of negative ones."""
        return np.stack([getattr(self, f"max_{name}"), -getattr(self, f"min_{name}")])

    def limit(self, name: Limited, values: Floats) -> Floats:
        """The limits of values (…, axes) as absolute values, each by the sign of its value."""
        up, down = self.limits(name)
        return np.asarray(np.where(values < 0.0, down, up))

    def use(self, name: Limited, values: Floats) -> Floats:
        """Use of the limits by values (…, axes): |value| / |limit|, where the value's sign selects the
        limit."""
        least, most = getattr(self, f"min_{name}"), getattr(self, f"max_{name}")
        return np.asarray(values / np.where(values < 0.0, least, most))

    @property
    def even(self) -> Problem:
        """The problem with the smaller limit of both directions; itself if no limit differs by direction."""
        if not len(self.least_velocity) and not len(self.least_acceleration):
            return self
        return replace(
            self,
            max_velocity=self.limits("velocity").min(axis=0),
            max_acceleration=self.limits("acceleration").min(axis=0),
            least_velocity=np.zeros(0),
            least_acceleration=np.zeros(0),
        )

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the joints that the limits belong to."""
        return self.joint_axes or self.path.axes

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the positions of `axes`."""
        return self.joint_units or usual_units(self.axes)

    @property
    def way_units(self) -> tuple[str, str]:
        """Units of the path's length: on pieces that move X, Y, Z or U, V, W, and on all other pieces."""
        units = self.units if self.joints is None else usual_units(self.path.axes)
        leads = np.logical_or.reduce(feed_groups(self.path.axes)[:-1])
        named = list(zip(units, leads.tolist(), strict=True))
        return (
            shared_unit((unit for unit, lead in named if lead), "mm"),
            shared_unit((unit for unit, lead in named if not lead), "deg"),
        )

    @property
    def unit(self) -> str:
        """The unit of the path's length: that of turning if no piece moves the tool."""
        return self.tool_motion.unit

    @cached_property
    def native(self) -> NativeProblem:
        """The problem in the form that the native kernels take; made once."""
        return NativeProblem(self)

    def __getstate__(self) -> dict[str, Any]:
        return {own.name: getattr(self, own.name) for own in fields(self)}

    @property
    def curve(self) -> CompositeCurve:
        """The motion of the joints."""
        return self.path.curve if self.joints is None else self.joints

    def derivatives(self, piece: NDArray[np.integer], u: Floats, order: int) -> Floats:
        """q, q', … of the joints, derivatives by u, at places (m,): (order + 1, m, joints), order ≤ 3.

        Exact to rounding, because they are computed from the uncut path by the kinematics, not from `joints`;
        angles may differ by whole turns.
        """
        if not self.words:
            return self.path.curve.evaluate(piece, u, order)
        from feedplan.machine.path_derivatives import derivatives

        first = self._first_run[np.searchsorted(self.path.runs, piece, side="right") - 1]
        result = np.empty((order + 1, len(u), len(self.axes)))
        curve, whole = self._uncut.even, self._uncut.piece[piece]
        start, end = self._uncut.part[piece].T
        fraction = start + (end - start) * (u / self.path.width[piece])
        control, weights = curve.by_piece, curve.weights_by_piece
        for run in np.unique(first).tolist():
            words, own = self.words[run], np.flatnonzero(first == run)
            result[:, own] = derivatives(
                words.kinematics,
                words.tip(control[whole[own]]),
                curve.width[whole[own]],
                fraction[own],
                order,
                None if weights is None else weights[whole[own]],
            )
        return result

    @cached_property
    def _first_run(self) -> Integers:
        """The first run that has the same words as each run (r,)."""
        first: dict[AxisWords, int] = {}
        return np.array([first.setdefault(words, run) for run, words in enumerate(self.words)])

    @cached_property
    def _uncut(self) -> Cut:
        count = len(self.path)
        return self.cut or Cut(self.path.curve, np.arange(count), np.tile([0.0, 1.0], (count, 1)))

    @cached_property
    def tool_motion(self) -> ToolMotion:
        """The tool's motion along the path, with its length."""
        return ToolMotion.along(self.path, self.way_units)

    @cached_property
    def way_curve(self) -> CompositeCurve | None:
        """The path with its axes scaled [mm], where the joints have pieces of their own.

        Profiles with jerk limits use its length: its speed is 0 only where all joints rest, while the tool's
        speed in X, Y, Z is also 0 where the tool only turns.
        """
        if self.joints is None:
            return None
        curve = self.path.curve
        scale = 1.0 if self.way_scale is None else self.way_scale
        return replace(curve, control_points=curve.control_points * scale)

    @cached_property
    def way_speed(self) -> SpeedPolynomial | None:
        """(v/u̇)² for the speed v along `way_curve`."""
        return None if self.way_curve is None else SpeedPolynomial.of(self.way_curve)

    @cached_property
    def tip_curve(self) -> CompositeCurve | None:
        """The tool's motion in X, Y, Z where the joints have pieces of their own."""
        return None if self.joints is None else linear_motion(self.path.curve, self.path.axes)


def build_problem(
    path: Path,
    machine: Machine,
    *,
    feed: float | None = None,
    feed_override: float = 1.0,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
) -> Problem:
    """Builds the problem of a path on a machine.

    `feed` [mm/s] replaces the programmed feeds, `feed_override` multiplies them (rapids keep the axes'
    limits), `start_speed` and `end_speed` [mm/s] hold at the ends of the whole path. On a path with
    `Corners.PROGRAMMED`, corners are passed with the velocity jump that the machine allows, or with
    acceleration × servo period if that is more. On linear axes the allowed jump is at most chord tolerance /
    period, so that the line between two setpoints cuts the corner by less than the chord tolerance. Raises
    InputError for a value out of range, and for a place that the joints cannot pass.
    """
    remedy = "a finite speed of 0 or more"
    start_speed = number(start_speed, "start speed", remedy, not_negative, "mm/s")
    end_speed = number(end_speed, "end speed", remedy, not_negative, "mm/s")
    request = FeedRequest(feed, feed_override)
    if has_joints_of_its_own(path, machine):
        # Imported here, so that kinematics are loaded only if needed.
        from feedplan.constraints.joints import joint_motion

        axes, greatest, jump = list(machine.axes), NO_FEED, None
        path, others = joint_motion(path, machine, feed_limit(path, greatest, request))
    else:
        axes = [machine.axis(name) for name in path.axes]
        greatest = 2.0 * float(np.linalg.norm([sizes_of(axis.max_velocity)[1] for axis in axes]))
        jump = _velocity_jump(path, machine, axes)
        others = {"feed_share": feed_share(path, greatest, request)}
    min_velocity, max_velocity = np.array([axis.velocity_range for axis in axes]).T
    min_acceleration, max_acceleration = np.array([axis.acceleration_range for axis in axes]).T
    # Where the joints are not the axes of the path (`jump` is None), corners are stops.
    junction_speed = junction_limit(path, np.zeros(len(path.axes)) if jump is None else jump)
    junction_speed[0], junction_speed[-1] = start_speed, end_speed
    return Problem(
        path=path,
        max_velocity=max_velocity,
        max_acceleration=max_acceleration,
        max_jerk=np.array([axis.max_jerk for axis in axes]),
        feed=feed_limit(path, greatest, request),
        junction_speed=junction_speed,
        chord_tolerance=machine.chord_tolerance,
        period=machine.period,
        start_speed=start_speed,
        end_speed=end_speed,
        velocity_jump=jump,
        joint_units=tuple(axis.unit for axis in axes),
        least_velocity=min_velocity,
        least_acceleration=min_acceleration,
        request=request,
        **others,
    )


def has_joints_of_its_own(path: Path, machine: Machine) -> bool:
    """Whether the joints are not the axes of the path."""
    if machine.is_plain:
        return False
    mode = path.coordinate_mode
    return machine.inverse.always or (mode is not None and bool((mode != CoordinateMode.JOINTS).any()))


def _velocity_jump(path: Path, machine: Machine, axes: Sequence[Axis]) -> Floats:
    """The greatest jump of each axis velocity at a corner (axes,) [mm/s]."""
    cut = machine.chord_tolerance / machine.period
    most = [cut if axis.kind == "linear" else np.inf for axis in axes]
    jump = np.minimum([axis.max_velocity_jump for axis in axes], most)
    if path.corners is Corners.PROGRAMMED:
        jump = np.maximum(jump, [size_of(axis.max_acceleration) * machine.period for axis in axes])
    return jump


def feed_square(problem: Problem, piece: NDArray[np.integer], u: Floats) -> Floats:
    """The square of the speed that the feed limits, divided by p = u̇², at places (n,)."""
    if problem.feed_share is None:
        return speed_square(problem, piece, u)
    slope = problem.curve.evaluate(piece, u, 1)[1]
    return np.asarray(((problem.feed_share[piece] * slope) ** 2).sum(axis=1))


def speed_square(problem: Problem, piece: NDArray[np.integer], u: Floats) -> Floats:
    """The square of the tool's speed, divided by p = u̇², at places (n,)."""
    tip = problem.tip_speed
    if tip is None:
        return np.asarray((problem.curve.evaluate(piece, u, 1)[1] ** 2).sum(axis=1))
    return tip.evaluate(piece, u / problem.path.width[piece])

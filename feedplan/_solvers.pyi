"""Types of the native module."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from feedplan.audit import _Limits
from feedplan.constraints.problem import Problem
from feedplan.machine.expression import Expression
from feedplan.machine.joint_interpolants import Accuracy
from feedplan.machine.path_derivatives import TipPieces
from feedplan.planners._parts import Part, PartOfProfile
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program

__all__ = [
    "CurveLength",
    "JointSetpointAudit",
    "PlanError",
    "Sampler",
    "SetpointAudit",
    "__version__",
    "audit_joints",
    "audit_plan",
    "bound_jerk_limited",
    "build_path",
    "check_control_points",
    "csv_rows",
    "curve_cusps",
    "curve_elevate",
    "curve_evaluate",
    "curve_joints",
    "curve_regular",
    "curve_reverse",
    "curve_split",
    "feed_between",
    "fit_points",
    "joint_constants",
    "joint_derivatives",
    "joint_enclosures",
    "joint_interpolants",
    "joint_path",
    "joint_positions",
    "look_ahead",
    "lower_bound",
    "path_segments",
    "plan_bang_bang",
    "plan_jerk_limited",
    "plan_s_curve",
    "profile_of_sections",
    "read_gcode",
    "spline_insert",
    "spline_pieces",
    "turn_pieces",
]

__version__: str

class PlanError(Exception): ...

# Columns of `feedplan.profile.SpeedProfile`.
_Profile = tuple[
    NDArray[np.uint32],
    NDArray[np.uint8],
    NDArray[np.uint8],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.int64],
    NDArray[np.uint32],
]

# Its accelerations at both ends of the arcs, and `kinked`.
_Changes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.uint32]]

# Who is told how far the work is, 0 to 1; what it raises ends the work and is raised.
_Progress = Callable[[float], None]

def plan_bang_bang(problem: Problem, progress: _Progress | None = None) -> _Profile: ...
def plan_jerk_limited(
    problem: Problem | Part,
    jerk: NDArray[np.float64],
    resolution: float,
    tolerance: float,
    time_limit: float | None = None,
    progress: _Progress | None = None,
) -> tuple[_Profile, _Changes, tuple[bool, NDArray[np.float64]]]: ...
def bound_jerk_limited(
    problem: Problem | Part,
    jerk: NDArray[np.float64],
    profile: SpeedProfile | PartOfProfile,
    time_limit: float | None = None,
    progress: _Progress | None = None,
) -> NDArray[np.float64]: ...
def plan_s_curve(
    problem: Problem,
    jerk: NDArray[np.float64],
    cuttings: Sequence[tuple[float, float]],
    look_ahead: int,
    time_limit: float | None = None,
    progress: _Progress | None = None,
) -> tuple[_Profile, _Changes]: ...
def path_segments(
    problem: Problem,
    jerk: NDArray[np.float64],
    cuttings: Sequence[tuple[float, float]],
    look_ahead: int,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.uint32],
    NDArray[np.float64],
]: ...
def profile_of_sections(
    problem: Problem,
    jerk: NDArray[np.float64],
    offsets: NDArray[np.int64],
    sections: NDArray[np.float64],
) -> tuple[_Profile, _Changes]: ...
def lower_bound(problem: Problem, profile: SpeedProfile, progress: _Progress | None = None) -> float: ...
def feed_between(
    problem: Problem, piece: NDArray[np.int64], u0: NDArray[np.float64], u1: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def look_ahead(
    speed: NDArray[np.float64], up: NDArray[np.float64], down: NDArray[np.float64]
) -> NDArray[np.float64]: ...

# t, position, velocity, acceleration, jerk, line, piece, u, rounds of the interpolator, length error.
_Chunk = tuple[
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.int32],
    NDArray[np.uint32],
    NDArray[np.float64],
    int,
    float,
]

@final
class Sampler:
    def __new__(
        cls,
        control_points: NDArray[np.float64],
        weights: NDArray[np.float64] | None,
        offsets: NDArray[np.int64],
        width: NDArray[np.float64],
        tip_speed: tuple[NDArray[np.float64], NDArray[np.int64]] | None,
        way_speed: tuple[NDArray[np.float64], NDArray[np.int64]] | None,
        feed_share: NDArray[np.float64] | None,
        line: NDArray[np.int32],
        runs: NDArray[np.int64],
        start_dwell: float,
        dwell: NDArray[np.float64],
        piece: NDArray[np.uint32],
        kind: NDArray[np.uint8],
        axis: NDArray[np.uint8],
        value: NDArray[np.float64],
        u0: NDArray[np.float64],
        u1: NDArray[np.float64],
        p0: NDArray[np.float64],
        p1: NDArray[np.float64],
        duration: NDArray[np.float64],
        a0: NDArray[np.float64],
        a1: NDArray[np.float64],
        arc_runs: NDArray[np.int64],
        period: float,
        newton: bool,
        progress: _Progress | None = None,
    ) -> Sampler: ...
    @property
    def count(self) -> int: ...
    @property
    def duration(self) -> float: ...
    @property
    def runs(self) -> NDArray[np.float64]: ...
    def chunk(self, start: int, stop: int) -> _Chunk: ...
    def at(self, times: NDArray[np.float64]) -> _Chunk: ...
    def along(self, piece: NDArray[np.uint32], u: NDArray[np.float64]) -> _Chunk: ...

def csv_rows(values: NDArray[np.float64], last: NDArray[np.int32]) -> bytes: ...
def read_gcode(
    source: bytes,
    name: str,
    places: NDArray[np.float64],
    machine_axes: str,
    machines_with: Callable[[str], str] | None,
    tip_control: object | None,
    block_delete: bool,
    max_moves: int,
    tools: Sequence[tuple[int, int, Sequence[float], float, int]] | None,
    subprograms: Callable[[str], tuple[str, bytes] | None] | None,
    feed: float | None,
    whole_step: float,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def fit_points(
    points: NDArray[np.float64],
    tolerance: float,
    max_chord: float,
    max_curvature: float,
    corner_angle: float,
) -> tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.uint32]
]: ...
def build_path(
    name: str,
    start: NDArray[np.float64],
    kind: NDArray[np.uint8],
    target: NDArray[np.float64],
    feed: NDArray[np.float64],
    line: NDArray[np.int32],
    tolerance: NDArray[np.float64],
    fit_tolerance: NDArray[np.float64],
    halt: NDArray[np.bool_],
    arc_move: NDArray[np.int64],
    arc_plane: NDArray[np.int64],
    arc_centre: NDArray[np.float64],
    arc_sweep: NDArray[np.float64],
    spline_move: NDArray[np.int64],
    spline_pieces: NDArray[np.int64],
    splines: tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.int64], NDArray[np.float64]]
    | None,
    change_move: NDArray[np.int64],
    change_start: NDArray[np.float64],
    joints: NDArray[np.bool_],
    max_velocity: NDArray[np.float64],
    max_acceleration: NDArray[np.float64],
    travel: NDArray[np.float64],
    jump: bool,
    exact_tolerance: float,
    max_chord: float,
    corner_acceleration: float,
    max_speed: float,
    corner_angle: float,
    corners: str,
    progress: _Progress | None = None,
) -> tuple[
    tuple[
        tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.int64], NDArray[np.float64]],
        NDArray[np.float64],
        NDArray[np.int64],
        NDArray[np.float64],
        NDArray[np.int64],
    ],
    tuple[int, int, int, float, list[float] | None],
    tuple[int, int, float] | None,
    tuple[NDArray[np.int64], NDArray[np.int64]],
]: ...

# Per limit: name, axis (-1: none), worst value, limit, ratio, time, source line; and the number of samples.
_Findings = tuple[list[tuple[str, int, float, float, float, float, int]], int]

def audit_plan(
    problem: Problem,
    limits: _Limits,
    feed: NDArray[np.float64],
    profile: SpeedProfile | None = None,
    program: Program | None = None,
    progress: _Progress | None = None,
) -> _Findings: ...
def audit_joints(
    problem: Problem, limits: _Limits, profile: SpeedProfile, progress: _Progress | None = None
) -> _Findings: ...

@final
class JointSetpointAudit:
    def __new__(cls, problem: Problem, limits: _Limits, profile: SpeedProfile) -> JointSetpointAudit: ...
    def push(
        self,
        t: NDArray[np.float64],
        position: NDArray[np.float64],
        velocity: NDArray[np.float64] | None = None,
        progress: _Progress | None = None,
    ) -> None: ...
    def finish(self) -> _Findings: ...

@final
class SetpointAudit:
    def __new__(
        cls,
        limits: _Limits,
        resolution: float = 0.0,
        problem: Problem | None = None,
        feed: NDArray[np.float64] | None = None,
        profile: SpeedProfile | None = None,
        program: Program | None = None,
    ) -> SetpointAudit: ...
    def push(
        self,
        t: NDArray[np.float64],
        position: NDArray[np.float64],
        velocity: NDArray[np.float64] | None = None,
        acceleration: NDArray[np.float64] | None = None,
        line: NDArray[np.int32] | None = None,
        progress: _Progress | None = None,
    ) -> None: ...
    def finish(self) -> _Findings: ...

# Control points (total, axes), weights (total,) if any piece is rational, offsets (n + 1,), widths (n,).
_CurveColumns = tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.int64], NDArray[np.float64]]

def joint_positions(expression: Expression, tips: NDArray[np.float64]) -> NDArray[np.float64]: ...
def joint_derivatives(
    expression: Expression, tips: TipPieces, fraction: NDArray[np.float64], order: int
) -> NDArray[np.float64]: ...
def joint_enclosures(
    expression: Expression, tips: TipPieces, order: int, parts: NDArray[np.float64] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def joint_constants(
    expression: Expression, tips: TipPieces, nodes: int, parts: NDArray[np.float64] | None = None
) -> NDArray[np.float64]: ...
def joint_path(
    expression: Expression,
    tips: TipPieces,
    travel: NDArray[np.float64] | None = None,
    start: NDArray[np.float64] | None = None,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    list[tuple[int, float]],
    list[tuple[int, float, int, float, float]],
]: ...
def joint_interpolants(
    expression: Expression,
    tips: TipPieces,
    nodes: NDArray[np.float64],
    to_bernstein: NDArray[np.float64],
    tolerance: NDArray[np.float64] | Accuracy,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def spline_pieces(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    knots: NDArray[np.float64],
    degree: int,
    periodic: bool,
) -> _CurveColumns: ...
def spline_insert(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    knots: NDArray[np.float64],
    degree: int,
    value: float,
    times: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.float64]]: ...
def turn_pieces(
    start: NDArray[np.float64],
    plane: tuple[int, int],
    centre: tuple[float, float],
    sweep: float,
    travel: NDArray[np.float64] | None,
    degree: int,
    tolerance: float,
) -> tuple[_CurveColumns, float]: ...
def check_control_points(
    control_points: NDArray[np.float64], weights: NDArray[np.float64] | None, degree: int
) -> None: ...
def curve_evaluate(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
    piece: NDArray[np.uint32],
    u: NDArray[np.float64],
    order: int,
) -> NDArray[np.float64]: ...
def curve_elevate(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
    degree: int,
) -> _CurveColumns: ...
def curve_split(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
    piece: NDArray[np.uint32],
    u: NDArray[np.float64],
) -> _CurveColumns: ...
def curve_reverse(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
) -> _CurveColumns: ...
def curve_joints(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
    closed: bool,
    gap: float,
    angle: float,
    derivative: float,
) -> tuple[
    NDArray[np.uint32], NDArray[np.uint8], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
]: ...
def curve_regular(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
) -> tuple[_CurveColumns, NDArray[np.int64], NDArray[np.bool_]]: ...
def curve_cusps(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    offsets: NDArray[np.int64],
    width: NDArray[np.float64],
    tolerance: float,
) -> tuple[NDArray[np.uint32], NDArray[np.float64]]: ...

@final
class CurveLength:
    def __new__(
        cls,
        control_points: NDArray[np.float64],
        weights: NDArray[np.float64] | None,
        offsets: NDArray[np.int64],
        width: NDArray[np.float64],
        accuracy: float,
        progress: _Progress | None = None,
    ) -> CurveLength: ...
    @property
    def total(self) -> float: ...
    @property
    def error(self) -> float: ...
    def lengths(self, piece: NDArray[np.uint32], u: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def locate(
        self, lengths: NDArray[np.float64], tolerance: float, newton: bool
    ) -> tuple[NDArray[np.uint32], NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]: ...

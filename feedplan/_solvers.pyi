"""Types of the native module."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from feedplan.audit import _Limits
from feedplan.constraints.problem import Problem as _Problem
from feedplan.geometry.rules import Rules
from feedplan.machine.expression import Expression
from feedplan.machine.joint_interpolants import Accuracy
from feedplan.machine.path_derivatives import TipPieces
from feedplan.planners._parts import Part
from feedplan.profile import SpeedProfile
from feedplan.program.gcode import Options
from feedplan.program.program import Program

__all__ = [
    "Curve",
    "CurveLength",
    "JointSetpointAudit",
    "Moves",
    "PlanError",
    "Problem",
    "Profile",
    "Sampler",
    "SetpointAudit",
    "__version__",
    "audit_joints",
    "audit_plan",
    "bound_jerk_limited",
    "build_path",
    "csv_rows",
    "feed_between",
    "fit_points",
    "insert_knot",
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
]

__version__: str

class PlanError(Exception): ...

# Who is told how far the work is, 0 to 1; what it raises ends the work and is raised.
_Progress = Callable[[float], None]

def plan_bang_bang(problem: _Problem, progress: _Progress | None = None) -> Profile: ...
def plan_jerk_limited(
    problem: _Problem | Part,
    jerk: NDArray[np.float64],
    resolution: float,
    tolerance: float,
    time_limit: float | None = None,
    progress: _Progress | None = None,
) -> tuple[Profile, bool, NDArray[np.float64]]: ...
def bound_jerk_limited(
    problem: _Problem | Part,
    jerk: NDArray[np.float64],
    profile: SpeedProfile,
    time_limit: float | None = None,
    progress: _Progress | None = None,
) -> NDArray[np.float64]: ...
def plan_s_curve(
    problem: _Problem,
    jerk: NDArray[np.float64],
    cuttings: Sequence[tuple[float, float]],
    look_ahead: int,
    time_limit: float | None = None,
    progress: _Progress | None = None,
) -> Profile: ...
def path_segments(
    problem: _Problem,
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
    problem: _Problem,
    jerk: NDArray[np.float64],
    offsets: NDArray[np.int64],
    sections: NDArray[np.float64],
) -> Profile: ...
def lower_bound(problem: _Problem, profile: SpeedProfile, progress: _Progress | None = None) -> float: ...
def feed_between(
    problem: _Problem, piece: NDArray[np.int64], u0: NDArray[np.float64], u1: NDArray[np.float64]
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
class Problem:
    def __new__(cls, problem: _Problem | Part) -> Problem: ...

@final
class Profile:
    def __new__(cls, columns: SpeedProfile) -> Profile: ...
    def fields(self) -> dict[str, Any]: ...

@final
class Sampler:
    def __new__(
        cls,
        problem: _Problem,
        profile: SpeedProfile,
        period: float,
        progress: _Progress | None = None,
    ) -> Sampler: ...
    @property
    def count(self) -> int: ...
    @property
    def duration(self) -> float: ...
    @property
    def runs(self) -> NDArray[np.float64]: ...
    def chunk(self, start: int, stop: int, newton: bool) -> _Chunk: ...
    def at(self, times: NDArray[np.float64]) -> _Chunk: ...
    def along(self, piece: NDArray[np.uint32], u: NDArray[np.float64]) -> _Chunk: ...

def csv_rows(values: NDArray[np.float64], last: NDArray[np.int32]) -> bytes: ...

@final
class Moves:
    def __new__(cls, columns: Program) -> Moves: ...
    def fields(self) -> dict[str, Any]: ...

def read_gcode(
    source: bytes, name: str, options: Options, progress: _Progress | None = None
) -> tuple[Moves, dict[str, Any]]: ...
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
    program: Program, rules: Rules, progress: _Progress | None = None
) -> tuple[
    tuple[Curve, NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]],
    tuple[int, int, int, float, list[float] | None],
    tuple[int, int, float] | None,
    tuple[NDArray[np.int64], NDArray[np.int64]],
]: ...

# Per limit: name, axis (-1: none), worst value, limit, ratio, time, source line; and the number of samples.
_Findings = tuple[list[tuple[str, int, float, float, float, float, int]], int]

def audit_plan(
    problem: _Problem,
    limits: _Limits,
    feed: NDArray[np.float64],
    profile: SpeedProfile | None = None,
    program: Program | None = None,
    progress: _Progress | None = None,
) -> _Findings: ...
def audit_joints(
    problem: _Problem, limits: _Limits, profile: SpeedProfile, progress: _Progress | None = None
) -> _Findings: ...

@final
class JointSetpointAudit:
    def __new__(cls, problem: _Problem, limits: _Limits, profile: SpeedProfile) -> JointSetpointAudit: ...
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
        problem: _Problem | None = None,
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
def insert_knot(
    control_points: NDArray[np.float64],
    weights: NDArray[np.float64] | None,
    knots: NDArray[np.float64],
    degree: int,
    value: float,
    times: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.float64]]: ...

@final
class Curve:
    def __new__(
        cls,
        control_points: NDArray[np.float64],
        weights: NDArray[np.float64] | None,
        offsets: NDArray[np.int64],
        width: NDArray[np.float64],
    ) -> Curve: ...
    @staticmethod
    def of_spline(
        control_points: NDArray[np.float64],
        weights: NDArray[np.float64] | None,
        knots: NDArray[np.float64],
        degree: int,
        periodic: bool,
    ) -> Curve: ...
    @staticmethod
    def of_turn(
        start: NDArray[np.float64],
        plane: tuple[int, int],
        centre: tuple[float, float],
        sweep: float,
        travel: NDArray[np.float64] | None,
        degree: int,
        tolerance: float,
    ) -> tuple[Curve, float]: ...
    def fields(self) -> dict[str, Any]: ...
    def evaluate(
        self, piece: NDArray[np.uint32], u: NDArray[np.float64], order: int
    ) -> NDArray[np.float64]: ...
    def elevated(self, degree: int) -> Curve: ...
    def split(self, piece: NDArray[np.uint32], u: NDArray[np.float64]) -> Curve: ...
    def reversed(self) -> Curve: ...
    def joints(
        self, closed: bool, gap: float, angle: float, derivative: float
    ) -> tuple[
        NDArray[np.uint32], NDArray[np.uint8], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
    ]: ...
    def regular(self) -> tuple[Curve, NDArray[np.int64], NDArray[np.bool_]]: ...
    def cusps(self, tolerance: float) -> tuple[NDArray[np.uint32], NDArray[np.float64]]: ...
    def lengths(self, accuracy: float, progress: _Progress | None = None) -> CurveLength: ...

@final
class CurveLength:
    @property
    def total(self) -> float: ...
    @property
    def error(self) -> float: ...
    def lengths(self, piece: NDArray[np.uint32], u: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def locate(
        self, lengths: NDArray[np.float64], tolerance: float, newton: bool
    ) -> tuple[NDArray[np.uint32], NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]: ...

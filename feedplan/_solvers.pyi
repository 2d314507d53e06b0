"""Types of the native module."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

from feedplan.audit import _Limits
from feedplan.constraints.problem import Problem as _Problem
from feedplan.geometry.rules import Motion, Rules
from feedplan.machine.expression import Expression
from feedplan.machine.joint_interpolants import Accuracy
from feedplan.machine.path_derivatives import TipPieces
from feedplan.planners._parts import Part
from feedplan.profile import SpeedProfile
from feedplan.program.gcode import Options
from feedplan.program.program import Program

__all__ = [
    "Curve", "CurveLength", "Moves", "PlanError", "Problem", "Profile", "Sampler", "SetpointAudit",
    "__version__", "audit_joints", "audit_plan", "buckets", "build_path", "csv_rows", "feed_between",
    "joint_derivatives", "joint_enclosures", "joint_interpolants", "joint_path", "joint_positions",
    "look_ahead", "lower_bound", "path_segments", "plan_bang_bang", "plan_jerk_limited", "plan_s_curve",
    "profile_of_sections", "read_gcode", "thin",
]  # fmt: skip

_Floats = NDArray[np.float64]
_Integers = NDArray[np.int64]
_Naturals = NDArray[np.uint32]

__version__: str

class PlanError(Exception): ...

# Who is told how far the work is, 0 to 1; what it raises ends the work and is raised.
_Progress = Callable[[float], None] | None

def plan_bang_bang(problem: _Problem, progress: _Progress = None) -> Profile: ...
def plan_jerk_limited(
    problem: _Problem | Part,
    jerk: _Floats,
    resolution: float,
    tolerance: float,
    proves: bool,
    time_limit: float | None = None,
    progress: _Progress = None,
) -> tuple[Profile, bool, _Floats, _Floats]: ...
def plan_s_curve(
    problem: _Problem,
    jerk: _Floats,
    cuttings: Sequence[tuple[float, float]],
    look_ahead: int,
    time_limit: float | None = None,
    progress: _Progress = None,
) -> Profile: ...
def path_segments(
    problem: _Problem, jerk: _Floats, cuttings: Sequence[tuple[float, float]], look_ahead: int
) -> list[_Floats]: ...
def profile_of_sections(
    problem: _Problem, jerk: _Floats, offsets: _Integers, sections: _Floats
) -> Profile: ...
def lower_bound(problem: _Problem, profile: SpeedProfile, progress: _Progress = None) -> float: ...
def feed_between(problem: _Problem, piece: _Integers, u0: _Floats, u1: _Floats) -> _Floats: ...
def look_ahead(speed: _Floats, up: _Floats, down: _Floats) -> _Floats: ...

# t, position, velocity, acceleration, jerk, line, piece, u, rounds of the interpolator, length error.
_Chunk = tuple[_Floats, _Floats, _Floats, _Floats, _Floats, NDArray[np.int32], _Naturals, _Floats, int, float]

@final
class Problem:
    def __new__(cls, problem: _Problem | SimpleNamespace) -> Problem: ...

@final
class Profile:
    def __new__(cls, columns: SpeedProfile) -> Profile: ...
    def fields(self) -> dict[str, Any]: ...

@final
class Sampler:
    def __new__(
        cls, problem: _Problem, profile: SpeedProfile, period: float, progress: _Progress = None
    ) -> Sampler: ...
    count: Final[int]
    duration: Final[float]
    runs: Final[_Floats]
    def chunk(self, start: int, stop: int, newton: bool) -> _Chunk: ...
    def at(self, times: _Floats) -> _Chunk: ...
    def along(self, piece: _Naturals, u: _Floats) -> _Chunk: ...

def csv_rows(values: _Floats, last: NDArray[np.int32]) -> bytes: ...
def buckets(values: _Floats, weight: _Floats, width: int) -> tuple[_Integers, _Floats]: ...
def thin(points: _Floats, cost: _Floats, tolerance: float) -> tuple[_Integers, _Floats]: ...

@final
class Moves:
    def __new__(cls, columns: Program) -> Moves: ...
    def fields(self) -> dict[str, Any]: ...

def read_gcode(
    source: bytes, name: str, options: Options, progress: _Progress = None
) -> tuple[Moves, dict[str, Any]]: ...
def build_path(
    program: Program, rules: Rules, motion: Motion | None = None, progress: _Progress = None
) -> tuple[
    tuple[Curve, _Floats, _Integers, _Floats, _Integers],
    tuple[int, int, int, float, list[float] | None],
    tuple[int, int, float] | None,
    tuple[_Integers, _Integers],
]: ...

# Per limit: name, axis (-1: none), worst value, limit, ratio, time, source line; and the number of samples.
_Findings = tuple[list[tuple[str, int, float, float, float, float, int]], int]

def audit_plan(
    problem: _Problem,
    limits: _Limits,
    feed: _Floats,
    profile: SpeedProfile | None = None,
    program: Program | None = None,
    progress: _Progress = None,
) -> _Findings: ...
def audit_joints(
    problem: _Problem, limits: _Limits, profile: SpeedProfile, progress: _Progress = None
) -> _Findings: ...

@final
class SetpointAudit:
    def __new__(
        cls,
        limits: _Limits,
        resolution: float = 0.0,
        problem: _Problem | None = None,
        feed: _Floats | None = None,
        profile: SpeedProfile | None = None,
        program: Program | None = None,
        deviation: float = 0.0,
    ) -> SetpointAudit: ...
    def push(
        self,
        t: _Floats,
        position: _Floats,
        velocity: _Floats | None = None,
        acceleration: _Floats | None = None,
        line: NDArray[np.int32] | None = None,
        progress: _Progress = None,
    ) -> None: ...
    def finish(self) -> _Findings: ...

def joint_positions(expression: Expression, tips: _Floats) -> _Floats: ...
def joint_derivatives(expression: Expression, tips: TipPieces, fraction: _Floats, order: int) -> _Floats: ...
def joint_enclosures(
    expression: Expression, tips: TipPieces, order: int, parts: _Floats | None = None
) -> tuple[_Floats, _Floats]: ...
def joint_path(
    expression: Expression, tips: TipPieces, travel: _Floats | None = None, start: _Floats | None = None
) -> tuple[
    _Integers, _Floats, _Floats, _Floats, list[tuple[int, float]], list[tuple[int, float, int, float, float]]
]: ...
def joint_interpolants(
    expression: Expression,
    tips: TipPieces,
    nodes: _Floats,
    to_bernstein: _Floats,
    tolerance: _Floats | Accuracy,
) -> tuple[_Integers, _Floats, _Floats, _Floats]: ...

@final
class Curve:
    def __new__(
        cls, control_points: _Floats, weights: _Floats | None, offsets: _Integers, width: _Floats
    ) -> Curve: ...
    @staticmethod
    def of_spline(
        control_points: _Floats, weights: _Floats | None, knots: _Floats, degree: int, periodic: bool
    ) -> Curve: ...
    def fields(self) -> dict[str, Any]: ...
    def evaluate(self, piece: _Naturals, u: _Floats, order: int) -> _Floats: ...
    def elevated(self, degree: int) -> Curve: ...
    def split(self, piece: _Naturals, u: _Floats) -> Curve: ...
    def reversed(self) -> Curve: ...
    def regular(self) -> tuple[Curve, _Integers, NDArray[np.bool_]]: ...

@final
class CurveLength:
    def __new__(cls, curve: Curve, accuracy: float) -> CurveLength: ...
    total: Final[float]
    error: Final[float]
    def lengths(self, piece: _Naturals, u: _Floats) -> _Floats: ...
    def locate(self, lengths: _Floats, tolerance: float) -> tuple[_Naturals, _Floats]: ...

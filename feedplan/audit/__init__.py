"""The independent audit: measures path, profile and setpoints against every limit by differences alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from feedplan._solvers import SetpointAudit, audit_joints, audit_plan
from feedplan.arrays import Floats
from feedplan.audit.feed import feed_axes, feed_limits
from feedplan.audit.recorded import audit_recorded
from feedplan.audit.verdict import PASS_MARK, Audit, LimitCheck, join
from feedplan.audit.worst import Findings
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.machine.axis import Axis, size_of
from feedplan.machine.machine import Machine
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.progress import Listener, part, tell
from feedplan.setpoints import SetpointChunk, Setpoints
from feedplan.units import shared_unit

__all__ = ["PASS_MARK", "Audit", "LimitCheck", "audit", "audit_setpoints"]

# Share of the audit's progress for path and profile if setpoints are audited after them.
PLAN_SHARE = 0.25
# Share of progress reached when the feeds of the blocks are known.
FEED_SHARE = 0.004
# Share of progress reached, in the audit of setpoints from files, before recorded velocities, accelerations
# and jerks are compared with each other.
RECORDED_SHARE = 0.8

# Number of setpoints that are computed, audited and written at once: 16 native tasks of 1024 setpoints each,
# so that all processors finish together, and few enough that their memory is reused.
CHUNK = 16_384


@dataclass(frozen=True)
class _Limits:
    """The limits that the native audit takes, one number for each axis."""

    max_velocity: list[float]
    max_acceleration: list[float]
    min_velocity: list[float]
    min_acceleration: list[float]
    max_jerk: list[float]
    judges_jerk: bool
    max_velocity_jump: list[float]
    jump_beyond: list[float]
    travel: list[tuple[float, float]]
    feed_axes: list[list[float]]
    chord_tolerance: float
    period: float
    end_speeds: tuple[float, float]


def audit(
    problem: Problem,
    profile: SpeedProfile | None,
    machine: Machine,
    program: Program | None = None,
    setpoints: Setpoints | Iterable[SetpointChunk] | None = None,
    jerk: bool = False,
    progress: Listener | None = None,
) -> Audit:
    """Measures a plan against every limit of its problem and machine.

    It measures the `profile` on its path; with a `program`, the distance between followed and programmed
    path; with `setpoints`, which are read chunk by chunk, their difference quotients and their distance from
    the path. Where the joints are not the path's axes, joint limits are measured only by positions from the
    kinematics. Jerk is judged only if the planner limits it (`jerk`): then in every third difference of the
    setpoints, and on the continuous profile. There the acceleration may jump only where the curvature of the
    path jumps, by at most 4/3 × jerk limit × servo period: a greater jump alone would exceed the jerk limit
    in third differences. `progress` is called with the finished share; an exception from it ends the audit.

    At a corner the profile's axis velocities may jump by the problem's `velocity_jump`. In setpoints such a
    jump is an acceleration over one period, which second differences judge like any other; only the jump that
    the machine file allows may exceed the acceleration limit there. Raises InputError where path, machine,
    program and setpoints do not belong together.
    """
    axes, problem_units, way_unit = problem.axes, problem.units, problem.unit
    program = None if program is None else program.along(problem.path.axes)
    machine_axes = _machine_axes(machine, axes)
    jump = [axis.max_velocity_jump for axis in machine_axes]
    limits = _Limits(
        max_velocity=problem.max_velocity.tolist(),
        max_acceleration=problem.max_acceleration.tolist(),
        min_velocity=problem.min_velocity.tolist(),
        min_acceleration=problem.min_acceleration.tolist(),
        max_jerk=problem.max_jerk.tolist(),
        judges_jerk=jerk,
        max_velocity_jump=jump if problem.velocity_jump is None else problem.velocity_jump.tolist(),
        jump_beyond=jump,
        travel=[axis.travel for axis in machine_axes],
        feed_axes=feed_axes(axes),
        chord_tolerance=float(problem.chord_tolerance),
        period=float(problem.period),
        end_speeds=(float(problem.start_speed), float(problem.end_speed)),
    )
    raised: list[Exception] = []

    def report(done: float) -> None:
        try:
            if progress is not None:
                progress(done)
        except Exception as error:
            raised.append(error)
            raise

    if isinstance(setpoints, Setpoints):
        limits = replace(limits, period=setpoints.period)
    stream = None if setpoints is None else _with_shares(setpoints, part(report, PLAN_SHARE, 1.0))
    try:
        report(0.0)
        work = _audit_axes if problem.joints is None else _audit_joints
        results = work(problem, profile, limits, program, stream, report)
        report(1.0)
    except ValueError as error:
        if error in raised:
            raise
        raise InputError(f"this plan cannot be audited: {error}") from None
    return join(results, axes, jerk, problem_units, way_unit)


Results = list[Findings]
Chunks = Iterator[tuple[SetpointChunk, Listener | None]]


def _audit_axes(
    problem: Problem,
    profile: SpeedProfile | None,
    limits: _Limits,
    program: Program | None,
    setpoints: Chunks | None,
    report: Listener,
) -> Results:
    """Audits a plan whose path axes are the joints."""
    plan_limits = replace(limits, period=float(problem.period))
    end = 1.0 if setpoints is None else PLAN_SHARE
    feed = feed_limits(problem, program, part(report, 0.0, FEED_SHARE))
    report(FEED_SHARE)
    whole = part(report, FEED_SHARE, end)
    results = [audit_plan(problem, plan_limits, feed, profile, program, whole)]
    if setpoints is not None:
        report(PLAN_SHARE)
        # The path is already compared with the program, so the setpoints need not be.
        findings, _ = results[0]
        used = [ratio for name, _, _, _, ratio, _, _ in findings if name == "deviation"]
        stream = SetpointAudit(
            limits,
            problem=problem,
            feed=feed,
            profile=profile,
            program=program,
            deviation=max(used, default=0.0),
        )
        results.append(_seen(stream, setpoints))
    return results


def _audit_joints(
    problem: Problem,
    profile: SpeedProfile | None,
    limits: _Limits,
    program: Program | None,
    setpoints: Chunks | None,
    report: Listener,
) -> Results:
    """Audits a plan on the tool tip's path: the tip's limits on this path, the joints' by the kinematics."""
    axes = len(problem.path.axes)
    free = replace(
        limits,
        max_velocity=[math.inf] * axes,
        max_acceleration=[math.inf] * axes,
        min_velocity=[-math.inf] * axes,
        min_acceleration=[-math.inf] * axes,
        max_jerk=[math.inf] * axes,
        judges_jerk=False,
        max_velocity_jump=[0.0] * axes,
        jump_beyond=[0.0] * axes,
        travel=[(-math.inf, math.inf)] * axes,
        feed_axes=feed_axes(problem.path.axes),
    )
    feed = feed_limits(problem, program)
    findings, samples = audit_plan(problem, free, feed, None, program)
    results: Results = [([found for found in findings if found[1] < 0], samples)]
    if profile is not None:
        own = replace(limits, period=float(problem.period))
        whole = 1.0 if setpoints is None else PLAN_SHARE
        results.append(audit_joints(problem, own, profile, part(report, 0.0, whole)))
    if setpoints is not None:
        report(PLAN_SHARE)
        stream = (
            SetpointAudit(limits)
            if profile is None
            else SetpointAudit(limits, problem=problem, feed=feed, profile=profile)
        )
        results.append(_seen(stream, setpoints))
    return results


def _seen(stream: SetpointAudit, setpoints: Chunks) -> Findings:
    """Audits all setpoints as a stream; returns the findings."""
    for chunk, share in setpoints:
        stream.push(
            np.ascontiguousarray(chunk.t, np.float64),
            np.ascontiguousarray(chunk.position, np.float64),
            _known(chunk.velocity),
            _known(chunk.acceleration),
            np.ascontiguousarray(chunk.line, np.int32),
            share,
        )
    return stream.finish()


def _known(values: Floats) -> Floats | None:
    """A column as the native audit takes it; None if it has no rows, because its values are unknown."""
    return np.ascontiguousarray(values, np.float64) if len(values) else None


def audit_setpoints(
    points: SetpointChunk,
    machine: Machine,
    *,
    period: float,
    resolution: float = 0.0,
    jerk: bool = False,
    corners: bool = False,
    progress: Listener | None = None,
) -> Audit:
    """Measures setpoints from files against the limits of a machine, by finite differences alone.

    Columns of velocity, acceleration and jerk may be empty. Recorded velocities must match the positions.
    Recorded accelerations must keep the limit and match the velocities; where jerk is judged (`jerk`),
    recorded jerks must match the accelerations (`feedplan.audit.recorded`). `corners` allows the velocity to
    jump by acceleration limit × period from one setpoint to the next, as on paths that pass corners between
    lines. `resolution` [mm] is the last digit of positions that were written as text: its rounding is allowed
    for in differences. `period` [s] is the time step. A velocity jump that the machine allows at corners
    appears as one or two accelerations above the limit where the direction turns; it is allowed only there.
    `progress` is called with the finished share; an exception from it ends the audit. Raises InputError for
    axes that the machine lacks, and for fewer than two setpoints.
    """
    names, machine_axes = points.axes, _machine_axes(machine, points.axes)
    if len(points) < 2:
        raise InputError(f"{len(points)} setpoints cannot be audited: give at least two")
    own_jump = [axis.max_velocity_jump for axis in machine_axes]
    # Allowances that are a share of a limit use the smaller limit of both directions.
    least = [size_of(axis.max_acceleration) for axis in machine_axes]
    jump = [max(own, corners * period * size) for own, size in zip(own_jump, least, strict=True)]
    limits = _Limits(
        max_velocity=[axis.velocity_range[1] for axis in machine_axes],
        max_acceleration=[axis.acceleration_range[1] for axis in machine_axes],
        min_velocity=[axis.velocity_range[0] for axis in machine_axes],
        min_acceleration=[axis.acceleration_range[0] for axis in machine_axes],
        max_jerk=[axis.max_jerk for axis in machine_axes],
        judges_jerk=jerk,
        max_velocity_jump=jump,
        jump_beyond=own_jump,
        travel=[axis.travel for axis in machine_axes],
        feed_axes=feed_axes(names),
        chord_tolerance=math.inf,
        period=period,
        end_speeds=(0.0, 0.0),
    )
    chunks = _in_chunks(points, part(progress, 0.0, RECORDED_SHARE))
    results = [_seen(SetpointAudit(limits, resolution), chunks)]
    rest = part(progress, RECORDED_SHARE, 1.0)
    pairs = [("recorded_change", points.velocity, points.acceleration, least, jump)]
    if jerk:
        pairs += [("recorded_jerk", points.acceleration, points.jerk, limits.max_jerk, [0.0] * len(names))]
    for i, (check, rate, change, limit, steps) in enumerate(pairs):
        share = part(rest, i / len(pairs), (i + 1) / len(pairs))
        if len(rate) and len(change):
            found = audit_recorded(
                check, points.t, rate, change, np.array(limit), np.array(steps), points.line, share
            )
            results.append(found)
    tell(progress, 1.0)
    units = tuple(axis.unit for axis in machine_axes)
    return join(results, names, jerk, units, shared_unit(units, "mm"))


def _in_chunks(points: SetpointChunk, report: Listener | None) -> Chunks:
    """The setpoints in chunks; `report` is called with the finished share before each chunk."""
    for start in range(0, len(points), CHUNK):
        tell(report, start / len(points))
        yield points.part(slice(start, start + CHUNK), points.axes), None


def _with_shares(setpoints: Setpoints | Iterable[SetpointChunk], report: Listener | None) -> Chunks:
    """The setpoints in chunks, each with its progress callback (None if their number is unknown)."""
    if not isinstance(setpoints, Setpoints):
        yield from ((chunk, None) for chunk in setpoints)
        return
    done = 0.0
    for chunk in setpoints.chunks(CHUNK):
        after = done + len(chunk) / setpoints.count
        share = part(report, done, min(after, 1.0))
        yield chunk, share
        if share is not None:
            share(1.0)
        done = after


def _machine_axes(machine: Machine, names: tuple[str, ...]) -> list[Axis]:
    by_name = {axis.name: axis for axis in machine.axes}
    missing = [name for name in names if name not in by_name]
    if missing:
        raise InputError(
            f"machine {machine.name} has no axis {missing[0]}: use a machine with {' '.join(names)}"
        )
    return [by_name[name] for name in names]

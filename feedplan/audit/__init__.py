"""The independent audit: every limit measured again on path, profile and setpoints, by differences alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import SetpointAudit, audit_joints, audit_plan
from feedplan.arguments import callback, flag, instance, list_of_names, not_negative, number, positive
from feedplan.array_arguments import floats, whole_numbers
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

# Share of the audit's time that path and profile take where setpoints follow, for the progress shown.
PLAN_SHARE = 0.25
# How far it is when the feeds of the blocks are known.
FEED_SHARE = 0.004
# How far the audit of setpoints from files is before what is recorded of them is compared.
RECORDED_SHARE = 0.8

# Setpoints that are computed, audited and written at once: 16 times the 1024 of one native task, so that all
# processors finish together, and few enough that their memory is used again.
CHUNK = 16_384


@dataclass(frozen=True)
class _Limits:
    """What the native audit needs to know of machine and problem, one number an axis."""

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

    The `profile` on its path; with a `program` the distance between followed and programmed path; with
    `setpoints`, which are read chunk by chunk, their differences and their places on the path. Where the
    joints are not the path's axes, their limits are measured by the kinematics' positions alone. Jerk is
    judged only if the method claims it (`jerk`): then in every third difference of the setpoints, and on the
    continuous profile as well, whose acceleration may jump only where the curvature of the path does, by no
    more than 4/3 of what the jerk limit makes in one servo period: more alone would break third differences.
    `progress` is told how far it is; what it raises ends the audit.

    At a corner the profile's axis velocities may jump by the problem's `velocity_jump`. In setpoints a
    jump is an acceleration over one period, judged like any other by second differences: only the jump
    that the machine file allows may exceed the limit there. Raises InputError where path, machine,
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
    """Where the path's axes are the joints."""
    plan_limits = replace(limits, period=float(problem.period))
    end = 1.0 if setpoints is None else PLAN_SHARE
    feed = feed_limits(problem, program, part(report, 0.0, FEED_SHARE))
    report(FEED_SHARE)
    whole = part(report, FEED_SHARE, end)
    results = [audit_plan(problem, plan_limits, feed, profile, program, whole)]
    if setpoints is not None:
        report(PLAN_SHARE)
        # Setpoints on a path that has been measured need not be measured against the program as well.
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
    """Where the path is the tool tip's: the tip by its path, the joints by the kinematics."""
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
    """What the audit of a stream finds in all its setpoints."""
    for chunk, share in setpoints:
        stream.push(
            np.ascontiguousarray(chunk.t, np.float64),
            np.ascontiguousarray(chunk.position, np.float64),
            np.ascontiguousarray(chunk.velocity, np.float64),
            np.ascontiguousarray(chunk.acceleration, np.float64),
            np.ascontiguousarray(chunk.line, np.int32),
            share,
        )
    return stream.finish()


def audit_setpoints(
    t: ArrayLike,
    position: ArrayLike,
    machine: Machine,
    *,
    axes: tuple[str, ...] | None = None,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    recorded_jerk: ArrayLike | None = None,
    line: ArrayLike | None = None,
    resolution: float = 0.0,
    jerk: bool = False,
    corners: bool = False,
    period: float | None = None,
    progress: Listener | None = None,
) -> Audit:
    """Measures setpoints from anywhere against the limits of a machine, by finite differences alone.

    `t` (n,) [s] and `position` (n, axes) [mm]; optional `velocity` [mm/s], `acceleration` [mm/s²] and
    `recorded_jerk` [mm/s³] of the same shape as position, and source `line` (n,). `axes` names the columns
    (default: the machine's axes). Recorded velocities must be those of the positions, recorded accelerations
    within the limit and those of the velocities, and where jerk is judged recorded jerks those of the
    accelerations (`feedplan.audit.recorded`). `corners`: the velocity may jump from one period to the next
    by what the acceleration limit gives in one, as where corners of lines are passed.
    `resolution` [mm] is the last digit of positions that were written as text: what its rounding adds to a
    difference is allowed. The `period` [s] is that of the times unless given. Jerk is judged only if `jerk`
    says so.
    A jump of velocity that the machine allows at corners shows as one or two accelerations above the limit
    where the direction turns; only there it is allowed for. `progress` is told how far it is; what it raises
    ends the audit. Raises InputError for arrays that do not belong together.
    """
    instance(machine, Machine, "the machine", "a Machine")
    names = machine.axis_names if axes is None else list_of_names(axes, "axes", "a list of axis letters")
    machine_axes = _machine_axes(machine, names)
    times, positions = floats(t, "times", 1), floats(position, "positions", 2)
    if times.ndim != 1 or positions.shape != (len(times), len(names)):
        raise InputError(
            f"{positions.shape} positions at {times.shape} times: give one row for each time and one column "
            f"for each of the axes {' '.join(names)}"
        )
    if len(times) < 2:
        raise InputError(f"{len(times)} setpoints cannot be audited: give at least two")
    resolution = number(resolution, "the resolution", "0 or more", not_negative, "mm")
    jerk, corners = flag(jerk, "jerk"), flag(corners, "corners")
    callback(progress, "the part done")
    recorded = {"velocity": velocity, "acceleration": acceleration, "jerk": recorded_jerk}
    rates = {
        name: None if values is None else floats(values, f"recorded values of the {name}")
        for name, values in recorded.items()
    }
    for name, values in rates.items():
        if values is not None and values.shape != positions.shape:
            raise InputError(
                f"the recorded {name} has the shape {values.shape}: give the shape of the positions, "
                f"{positions.shape}"
            )
    lines = np.zeros(len(times), np.int32) if line is None else _lines(line)
    if lines.shape != times.shape:
        raise InputError(f"{len(lines)} source lines: give as many as the times, {len(times)}")
    period = (
        _period(times, machine.period)
        if period is None
        else number(period, "the period", "a positive number", positive, "s")
    )
    own_jump = [axis.max_velocity_jump for axis in machine_axes]
    # What is no limit but a share of one is that of the smaller one of both directions.
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
    stream = SetpointAudit(limits, resolution)
    for start in range(0, len(times), CHUNK):
        tell(progress, RECORDED_SHARE * start / len(times))
        own = slice(start, start + CHUNK)
        stream.push(
            times[own],
            positions[own],
            None if rates["velocity"] is None else rates["velocity"][own],
            None if rates["acceleration"] is None else rates["acceleration"][own],
            lines[own],
        )
    results = [stream.finish()]
    rest = part(progress, RECORDED_SHARE, 1.0)
    pairs = [("recorded_change", "velocity", "acceleration", least, jump)]
    if jerk:
        pairs += [("recorded_jerk", "acceleration", "jerk", limits.max_jerk, [0.0] * len(names))]
    for i, (check, rate, change, limit, steps) in enumerate(pairs):
        of, by = rates[rate], rates[change]
        share = part(rest, i / len(pairs), (i + 1) / len(pairs))
        if of is not None and by is not None:
            results.append(
                audit_recorded(check, times, of, by, np.array(limit), np.array(steps), lines, share)
            )
    tell(progress, 1.0)
    units = tuple(axis.unit for axis in machine_axes)
    return join(results, names, jerk, units, shared_unit(units, "mm"))


def _with_shares(setpoints: Setpoints | Iterable[SetpointChunk], report: Listener | None) -> Chunks:
    """The setpoints in chunks, and who is told how far each is; nobody where their number is not known."""
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


def _lines(given: ArrayLike) -> NDArray[np.int32]:
    lines = whole_numbers(given, "source lines")
    narrow = len(lines) == 0 or np.can_cast(lines.dtype, np.int32)
    if not narrow and not (lines.min() >= -(2**31) and lines.max() < 2**31):
        raise InputError("source lines are beyond 2147483647: give the lines of a program")
    return np.ascontiguousarray(lines, np.int32)


def _period(times: Floats, default: float) -> float:
    """The usual time step; the machine's where the times show none."""
    step = float(np.median(np.diff(times[:CHUNK])))
    return step if math.isfinite(step) and step > 0 else default

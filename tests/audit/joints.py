"""Plans on machines whose joints are not the path's axes, for the tests of the audit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import plan_curves
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.along import derivatives, positions
from feedplan.machine.machine import Machine
from feedplan.machine.proxies import build_proxies
from feedplan.machine.words import axis_words
from feedplan.profile import ArcKind, SpeedProfile
from feedplan.setpoints import SetpointChunk
from tests.audit.curves import path_along

Array = NDArray[np.float64]


def joint_problem(machine: Machine, names: str, curve: CompositeCurve, **changes: Any) -> Problem:
    """From rest to rest along the tip curve, cut where the planner's stand-ins for the joints are."""
    words = axis_words(machine, tuple(names), changes.pop("meaning", None))
    points = curve.by_piece
    proxies = build_proxies(words.kinematics, words.tip(points), curve.width, 1e-10, nodes=8)
    cut = proxies.part[:, 0] > 0
    path = path_along(
        curve.split(proxies.piece[cut], proxies.part[cut, 0] * curve.width[proxies.piece[cut]]), names
    )
    count = len(path)
    start = positions(words.kinematics, words.tip(path.curve.control_points[path.curve.offsets[:-1]]))
    steps = proxies.slope * (path.width / 9.0)[:, None, None]
    joints = np.concatenate([start[:, None], start[:, None] + np.cumsum(steps, axis=1)], axis=1)
    problem = Problem(
        path=path,
        max_velocity=np.array([axis.max_velocity for axis in machine.axes]),
        max_acceleration=np.array([axis.max_acceleration for axis in machine.axes]),
        max_jerk=np.full(len(machine.axes), math.inf),
        feed=np.full(count, 1e6),
        junction_speed=np.concatenate([[0.0], np.full(count - 1, np.inf), [0.0]]),
        chord_tolerance=math.inf,
        period=machine.period,
        joint_axes=machine.axis_names,
        joints=CompositeCurve.from_pieces(joints, path.width),
        words=(words,),
    )
    return problem if not changes else type(problem)(**{**vars(problem), **changes})


def planned_joints(problem: Problem) -> SpeedProfile:
    """The exact profile of the joints' limits alone."""
    assert problem.joints is not None
    joints = problem.joints
    return SpeedProfile(
        *plan_curves(
            joints.control_points,
            np.zeros(0),
            joints.offsets,
            joints.width,
            np.asarray(problem.path.runs, np.int64),
            problem.feed,
            problem.junction_speed,
            problem.max_velocity,
            problem.max_acceleration,
            math.inf,
            problem.period,
            problem.start_speed,
            problem.end_speed,
        )
    )


def steady(problem: Problem, p: float) -> SpeedProfile:
    """Constant p over all pieces."""
    count, width = len(problem.path), problem.path.width
    return SpeedProfile(
        piece=np.arange(count, dtype=np.uint32),
        kind=np.full(count, ArcKind.FLAT, np.uint8),
        axis=np.full(count, 255, np.uint8),
        value=np.zeros(count),
        u0=np.zeros(count),
        u1=width.copy(),
        p0=np.full(count, p),
        p1=np.full(count, p),
        duration=width / math.sqrt(p),
        runs=np.array([0, count]),
    )


def places_at(problem: Problem, profile: SpeedProfile, t: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Arc, u and √p at times in motion (n,): by halving, from the closed forms on the planner's stand-ins."""
    assert problem.joints is not None
    ends = np.cumsum(profile.duration)
    arc = np.minimum(np.searchsorted(ends, t, side="right"), len(profile) - 1)
    since = np.clip(t - (ends[arc] - profile.duration[arc]), 0.0, profile.duration[arc])
    piece, rows = profile.piece[arc].astype(np.int64), np.arange(len(t))
    axis = np.where(profile.axis[arc] == 255, 0, profile.axis[arc]).astype(np.int64)
    kind, value = profile.kind[arc], profile.value[arc]

    def motion(u: Array) -> tuple[Array, Array]:
        q, slope = problem.joints.evaluate(piece, u, 1)  # type: ignore[union-attr]
        return q[rows, axis], slope[rows, axis]

    (q0, g0), (q1, g1) = motion(profile.u0[arc]), motion(profile.u1[arc])
    v0, v1 = g0 * np.sqrt(profile.p0[arc]), g1 * np.sqrt(profile.p1[arc])
    # From the slower end, where nothing cancels.
    rest = profile.duration[arc] - since
    ahead = q0 + since * (v0 + 0.5 * value * since)
    target = np.where(np.abs(v0) <= np.abs(v1), ahead, q1 - rest * (v1 - 0.5 * value * rest))
    target = np.where(
        kind == ArcKind.AXIS_VELOCITY, q0 + np.sign(q1 - q0) * np.sqrt(np.abs(value)) * since, target
    )
    low, high = profile.u0[arc].copy(), profile.u1[arc].copy()
    for _ in range(70):
        middle = 0.5 * (low + high)
        below = (motion(middle)[0] < target) == (q1 > q0)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    u = np.where(kind == ArcKind.FLAT, profile.u0[arc] + np.sqrt(profile.p0[arc]) * since, 0.5 * (low + high))
    q, slope = motion(u)
    speed = np.sqrt(
        np.maximum(
            np.where(np.abs(v0) <= np.abs(v1), v0**2 + 2 * value * (q - q0), v1**2 - 2 * value * (q1 - q)),
            0.0,
        )
    )
    speed = np.where(kind == ArcKind.AXIS_VELOCITY, np.sqrt(np.abs(value)), speed)
    with np.errstate(divide="ignore", invalid="ignore"):
        root_p = np.where(kind == ArcKind.FLAT, np.sqrt(profile.p0[arc]), speed / np.abs(slope))
    return arc, u, root_p


def sampled(problem: Problem, profile: SpeedProfile) -> SetpointChunk:
    """Setpoints of one run: its start, one a period, and the stop at the next whole period."""
    count = math.ceil(profile.time / problem.period - 1e-9)
    t = np.arange(count + 1) * problem.period
    arc, u, root_p = places_at(problem, profile, np.minimum(t, profile.time))
    piece = profile.piece[arc].astype(np.int64)
    words = problem.words[0]
    width = problem.path.width[piece]
    control = np.stack(
        [problem.path.curve.control_points[slice(*problem.path.curve.offsets[i : i + 2])] for i in piece]
    )
    q = derivatives(words.kinematics, words.tip(control), width, np.minimum(u / width, 1.0), 1)
    turning = np.array(words.kinematics.turning)
    position = np.where(turning, np.unwrap(q[0], period=360.0, axis=0), q[0])
    velocity = np.nan_to_num(q[1] * root_p[:, None])
    velocity[[0, -1]] *= [[problem.start_speed > 0], [problem.end_speed > 0]]
    zero = np.zeros_like(position)
    return SetpointChunk(t, position, velocity, zero, zero, problem.path.line[piece], problem.axes)

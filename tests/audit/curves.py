"""Plans on curves of any degree, for the tests of the audit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.machine.path_derivatives import derivatives
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.setpoints import SetpointChunk

Array = NDArray[np.float64]


def machine_of(problem: Problem, jump: float = 0.0) -> Machine:
    """A machine whose axes have the limits of the problem."""
    limits = zip(problem.axes, problem.max_velocity, problem.max_acceleration, strict=True)
    return Machine("own", tuple(Axis(name, v, a, max_velocity_jump=jump) for name, v, a in limits))


def places_at(problem: Problem, profile: SpeedProfile, t: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Arc, u and √p at times in motion (n,), by closed forms and bisection; not for arcs of the law FEED."""
    ends = np.cumsum(profile.duration)
    arc = np.minimum(np.searchsorted(ends, t, side="right"), len(profile) - 1)
    since = np.clip(t - (ends[arc] - profile.duration[arc]), 0.0, profile.duration[arc])
    piece, rows = profile.piece[arc].astype(np.int64), np.arange(len(t))
    axis = np.where(profile.axis[arc] == 255, 0, profile.axis[arc]).astype(np.int64)
    kind, value = profile.kind[arc], profile.value[arc]

    def motion(u: Array) -> tuple[Array, Array]:
        q, slope = problem.curve.evaluate(piece, u, 1)
        return q[rows, axis], slope[rows, axis]

    (q0, g0), (q1, g1) = motion(profile.u0[arc]), motion(profile.u1[arc])
    v0, v1 = g0 * np.sqrt(profile.p0[arc]), g1 * np.sqrt(profile.p1[arc])
    # From the slower end, where no difference of large numbers occurs.
    rest = profile.duration[arc] - since
    ahead = q0 + since * (v0 + 0.5 * value * since)
    target = np.where(np.abs(v0) <= np.abs(v1), ahead, q1 - rest * (v1 - 0.5 * value * rest))
    target = np.where(
        kind == PhaseLaw.AXIS_VELOCITY, q0 + np.sign(q1 - q0) * np.sqrt(np.abs(value)) * since, target
    )
    low, high = profile.u0[arc].copy(), profile.u1[arc].copy()
    for _ in range(70):
        middle = 0.5 * (low + high)
        below = (motion(middle)[0] < target) == (q1 > q0)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    u = np.where(
        kind == PhaseLaw.PARAMETER_ACCELERATION,
        profile.u0[arc] + np.sqrt(profile.p0[arc]) * since,
        0.5 * (low + high),
    )
    q, slope = motion(u)
    speed = np.sqrt(
        np.maximum(
            np.where(np.abs(v0) <= np.abs(v1), v0**2 + 2 * value * (q - q0), v1**2 - 2 * value * (q1 - q)),
            0.0,
        )
    )
    speed = np.where(kind == PhaseLaw.AXIS_VELOCITY, np.sqrt(np.abs(value)), speed)
    with np.errstate(divide="ignore", invalid="ignore"):
        root_p = np.where(
            kind == PhaseLaw.PARAMETER_ACCELERATION, np.sqrt(profile.p0[arc]), speed / np.abs(slope)
        )
    return arc, u, root_p


def sampled(problem: Problem, profile: SpeedProfile) -> SetpointChunk:
    """Setpoints of one run: the start, one every period, and the stop at the next whole period."""
    count = math.ceil(profile.time / problem.period - 1e-9)
    t = np.arange(count + 1) * problem.period
    arc, u, root_p = places_at(problem, profile, np.minimum(t, profile.time))
    piece = profile.piece[arc].astype(np.int64)
    curve = problem.path.curve
    if problem.words:
        (words,) = problem.words
        control = np.stack([curve.control_points[slice(*curve.offsets[i : i + 2])] for i in piece])
        width = curve.width[piece]
        share = np.minimum(u / width, 1.0)
        q = derivatives(words.kinematics, words.tip(control), width, share, 1)
        turning = np.array(words.kinematics.turning)
        q[0] = np.where(turning, np.unwrap(q[0], period=360.0, axis=0), q[0])
    else:
        q = curve.evaluate(piece, u, 1)
    velocity = np.nan_to_num(q[1] * root_p[:, None])
    velocity[[0, -1]] *= [[problem.start_speed > 0], [problem.end_speed > 0]]
    acceleration = np.zeros_like(velocity)
    if not problem.words:
        # Central differences over 0.1 µs on each side: a switch between phases disturbs them only if it is at
        # the setpoint itself.
        around = [places_at(problem, profile, np.clip(t + step, 0.0, profile.time)) for step in (-1e-7, 1e-7)]
        rates = [
            curve.evaluate(profile.piece[arc].astype(np.int64), u, 1)[1] * root_p[:, None]
            for arc, u, root_p in around
        ]
        acceleration = (rates[1] - rates[0]) / 2e-7
        acceleration[[0, -1]] = 0.0
    zero = np.zeros_like(velocity)
    return SetpointChunk(t, q[0], velocity, acceleration, zero, problem.path.line[piece], problem.axes)

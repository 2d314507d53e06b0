"""Plans on machines whose joints are not the path's axes, for the tests of the audit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Cut
from feedplan.machine.axis_words import axis_words
from feedplan.machine.joint_interpolants import joint_interpolants
from feedplan.machine.machine import Machine
from feedplan.machine.path_derivatives import positions
from feedplan.profile import PhaseLaw, SpeedProfile
from tests.along import path_along

Array = NDArray[np.float64]


def joint_problem(machine: Machine, names: str, curve: CompositeCurve, **changes: Any) -> Problem:
    """From rest to rest along the tip curve, cut where the planner's polynomials of the joints are joined."""
    words = axis_words(machine, tuple(names), changes.pop("coordinate_mode", None))
    points = curve.by_piece
    found = joint_interpolants(words.kinematics, words.tip(points), curve.width, 1e-10, nodes=8)
    cut = found.part[:, 0] > 0
    path = path_along(
        curve.split(found.piece[cut], found.part[cut, 0] * curve.width[found.piece[cut]]), names
    )
    count = len(path)
    start = positions(words.kinematics, words.tip(path.curve.control_points[path.curve.offsets[:-1]]))
    steps = found.slope * (path.width / 9.0)[:, None, None]
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
        cut=Cut(curve, found.piece, found.part),
    )
    return problem if not changes else type(problem)(**{**vars(problem), **changes})


def steady(problem: Problem, p: float) -> SpeedProfile:
    """A profile with constant p over all pieces."""
    count, width = len(problem.path), problem.path.width
    return SpeedProfile(
        piece=np.arange(count, dtype=np.uint32),
        kind=np.full(count, PhaseLaw.PARAMETER_ACCELERATION, np.uint8),
        axis=np.full(count, 255, np.uint8),
        value=np.zeros(count),
        u0=np.zeros(count),
        u1=width.copy(),
        p0=np.full(count, p),
        p1=np.full(count, p),
        duration=width / math.sqrt(p),
        runs=np.array([0, count]),
    )

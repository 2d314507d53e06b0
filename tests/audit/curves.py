"""Plans on curves of any degree, for the tests of the audit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import plan_curves
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.machine import Axis, Machine
from feedplan.profile import SpeedProfile

Array = NDArray[np.float64]


def machine_of(problem: Problem, jump: float = 0.0) -> Machine:
    """Axes with the limits of the problem."""
    limits = zip(problem.axes, problem.max_velocity, problem.max_acceleration, strict=True)
    return Machine("own", tuple(Axis(name, v, a, max_velocity_jump=jump) for name, v, a in limits))


def path_along(curve: CompositeCurve, names: str = "XYZABC", **changes: Any) -> Path:
    """One run over the curve, each piece on a line and a move of its own."""
    number = np.arange(len(curve))
    columns: dict[str, Any] = {
        "axes": tuple(names[: curve.axes]),
        "curve": curve,
        "feed": np.full(len(curve), 100.0),
        "move": np.stack([number, number], axis=1),
        "line": np.asarray(10 * (number + 1), dtype=np.int32),
        "runs": np.array([0, len(curve)]),
        "dwell": np.zeros(1),
        "tolerance": np.zeros(len(curve)),
    }
    return Path(**{**columns, **changes})


def problem_along(
    path: Path, velocity: Any, acceleration: Any, feed: float = 1e9, chord_tolerance: float = math.inf
) -> Problem:
    """From rest to rest."""
    axes = len(path.axes)
    return Problem(
        path=path,
        max_velocity=np.broadcast_to(np.asarray(velocity, float), axes).copy(),
        max_acceleration=np.broadcast_to(np.asarray(acceleration, float), axes).copy(),
        max_jerk=np.full(axes, np.inf),
        feed=np.full(len(path), feed),
        junction_speed=np.concatenate([[0.0], np.full(len(path) - 1, np.inf), [0.0]]),
        chord_tolerance=chord_tolerance,
        period=0.001,
    )


def planned(problem: Problem) -> SpeedProfile:
    """The exact profile on pieces of any degree."""
    curve = problem.path.curve
    return SpeedProfile(
        *plan_curves(
            curve.control_points,
            np.zeros(0) if curve.weights is None else curve.weights,
            curve.offsets,
            curve.width,
            np.asarray(problem.path.runs, np.int64),
            problem.feed,
            problem.junction_speed,
            problem.max_velocity,
            problem.max_acceleration,
            problem.chord_tolerance,
            problem.period,
            problem.start_speed,
            problem.end_speed,
        )
    )

"""The certificate: a time that no feasible profile of a problem can beat."""

from __future__ import annotations

from feedplan import _solvers
from feedplan.constraints.problem import Problem


def lower_bound(problem: Problem) -> float:
    """A proven lower bound [s] on the time in motion along the problem's path, dwells not counted."""
    path = problem.path
    return float(
        _solvers.lower_bound(
            path.control_points,
            path.width,
            path.runs,
            problem.feed,
            problem.junction_speed,
            problem.max_velocity,
            problem.max_acceleration,
        )
    )

"""Turns faults of the native planners into errors of the package."""

from __future__ import annotations

import math

from feedplan._solvers import PlanError
from feedplan.constraints.problem import Problem
from feedplan.errors import InfeasibleError, InputError, SolverError, at_line


def error_of(problem: Problem, fault: PlanError) -> InfeasibleError | InputError | SolverError:
    """The error for a planner's fault: with the source line, and a speed that is possible."""
    kind, piece, reachable, sentence = fault.args
    line = 0 if piece is None else int(problem.path.line[piece])
    if reachable is not None:
        most = f"at most {_rounded_down(reachable)} {problem.unit}/s"
        at_start = kind == "start"
        why = f"the limits ahead allow {most}: " if at_start else f"{most} can be reached: "
        return end_error(problem, at_start, line, why, reachable)
    if kind == "stuck":
        return SolverError(
            f"{at_line(line)}{sentence}: this is a fault of the planner; please report the program"
        )
    return InputError(f"{at_line(line)}{sentence}")


def end_error(
    problem: Problem,
    at_start: bool,
    line: int,
    why: str = "",
    reachable: float | None = None,
    what: str = "no profile",
) -> InfeasibleError:
    """The error that no profile has the given speed at the path's start or end; `why` ends with a colon."""
    verb, speed = ("starts", problem.start_speed) if at_start else ("ends", problem.end_speed)
    sentence = f"{what} {verb} at {speed:g} {problem.unit}/s: {why}give a lower speed"
    return InfeasibleError(f"{at_line(line)}{sentence}", line, reachable)


def _rounded_down(speed: float) -> str:
    """A speed rounded down to six digits."""
    if speed <= 0.0:
        return "0"
    scale = 10.0 ** (5 - math.floor(math.log10(speed)))
    return f"{math.floor(speed * scale) / scale:.6g}"

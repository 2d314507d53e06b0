"""Faults of the native planners as errors of the package."""

from __future__ import annotations

import math

from feedplan._solvers import PlanError
from feedplan.constraints.problem import Problem
from feedplan.errors import InfeasibleError, InputError, SolverError, at_line


def error_of(problem: Problem, fault: PlanError) -> InfeasibleError | InputError | SolverError:
    """The planner's fault in our words: with the source line, and a speed that will do."""
    kind, piece, reachable, sentence = fault.args
    line = None if piece is None else int(problem.path.line[piece])
    place = at_line(line or 0)
    if reachable is not None:
        shown, unit = _rounded_down(reachable), f"{problem.unit}/s"
        if kind == "start":
            sentence = (
                f"{place}no profile starts at {problem.start_speed:g} {unit}: "
                f"the limits ahead allow at most {shown} {unit}: give a lower speed"
            )
        else:
            sentence = (
                f"{place}no profile ends at {problem.end_speed:g} {unit}: "
                f"at most {shown} {unit} can be reached: give a lower speed"
            )
        return InfeasibleError(sentence, line, reachable)
    if kind == "stuck":
        return SolverError(f"{place}{sentence}: this is a fault of the planner; please report the program")
    return InputError(f"{place}{sentence}")


def _rounded_down(speed: float) -> str:
    """Six digits of a speed, never above it."""
    if speed <= 0.0:
        return "0"
    scale = 10.0 ** (5 - math.floor(math.log10(speed)))
    return f"{math.floor(speed * scale) / scale:.6g}"

"""Planners compute a speed profile from a problem. Each method is one file, found by its name.

The method `bang-bang` is the module `bang_bang`; modules that begin with an underscore are shared by methods.
`MethodName` lists the names, and the documentation of `feedplan.plan` the options. A module has

- `plan(problem: Problem, …) -> SpeedProfile`; options are keyword arguments, each with a default.
- `CORNERS`, a `feedplan.geometry.corners.Corners`, if the method needs another path than the rounded one.
- `LIMITS_JERK = True` if its profiles keep the jerk limits of the axes; the audit then checks them.
- `GRID_ERROR` if its profiles have a lower bound of their own (`SpeedProfile.lower_bound`): finer grids may
  reduce the time by this many times the accuracy.

`plan` may take more keyword arguments: `PROGRESS` to report its progress, `RESERVE` to announce the work
after the plan (`planners.jerk_limited`), `ELSEWHERE` to plan runs on other computers.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import ModuleType
from typing import Any, Literal, get_args

from feedplan.arguments import one_of
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.geometry.corners import Corners
from feedplan.planners._parts import Elsewhere as Elsewhere
from feedplan.profile import SpeedProfile

MethodName = Literal[
    "arc-transition",
    "bang-bang",
    "casadi",
    "clarabel",
    "constant-velocity-transition",
    "jerk-limited",
    "junction-deviation",
    "linuxcnc",
    "ruckig",
    "s-curve",
    "tangential",
    "toppra",
]

# Reserves time for the work after a plan; `feedplan.plan` gives it, users cannot.
RESERVE = "reserve"
# A function that is called with the finished share of the plan; also an argument of `feedplan.plan`.
PROGRESS = "progress"
# An executor for parts of the work (`planners._parts.Elsewhere`); `feedplan.plan` gives it too.
ELSEWHERE = "elsewhere"


def methods() -> tuple[MethodName, ...]:
    """The names of all planning methods; the documentation of `feedplan.plan` has their options."""
    return get_args(MethodName)


def planner(method: str, **options: Any) -> Callable[[Problem], SpeedProfile]:
    """The planning function of a method, with those `options` that are not None.

    Raises InputError that names the known methods, or the method's options.
    """
    plan: Callable[..., SpeedProfile] = _module(method).plan
    return partial(plan, **given_options(method, options))


def given_options(method: str, options: Mapping[str, Any], others: Iterable[str] = ()) -> dict[str, Any]:
    """Those of the `options` that are not None. An option that only other methods take must be None.

    Raises as `planner` does, and names the methods that take the option, if any; names of `others` appear in
    the message as allowed too.
    """
    known = options_of(method)
    for name, value in options.items():
        if name in known or (value is None and any(name in options_of(other) for other in methods())):
            continue
        some = ", ".join((*known, *others))
        remedy = f"give {some}, or leave it out" if some else "leave it out"
        if takers := [other for other in methods() if name in options_of(other)]:
            remedy = f"leave it out, or choose a method that takes it ({', '.join(takers)})"
        raise InputError(f"the method {method} takes no {name}: {remedy}")
    return {name: value for name, value in options.items() if value is not None}


def grid_error(method: str) -> float:
    """`GRID_ERROR` of a method: finer grids may reduce the time by this many times the accuracy; 0 without a
    lower bound of its own."""
    return float(getattr(_module(method), "GRID_ERROR", 0.0))


def options_of(method: str) -> dict[str, Any]:
    """A method's options with their defaults; raises as `planner` does."""
    parameters = inspect.signature(_module(method).plan).parameters.values()
    others = ("problem", RESERVE, PROGRESS, ELSEWHERE)
    return {own.name: own.default for own in parameters if own.name not in others}


def takes(method: str, argument: str) -> bool:
    """Whether a method takes `argument`: `RESERVE`, `PROGRESS` or `ELSEWHERE`; raises as `planner` does."""
    return argument in inspect.signature(_module(method).plan).parameters


def corners(method: str) -> Corners:
    """The treatment of corners that a method needs; raises as `planner` does."""
    choice: Corners = getattr(_module(method), "CORNERS", Corners.ROUNDED)
    return choice


def limits_jerk(method: str | None) -> bool:
    """Whether a method keeps jerk limits, which the audit then checks; False for an unknown method."""
    return method in methods() and getattr(_module(str(method)), "LIMITS_JERK", False)


def _module(method: str) -> ModuleType:
    name = one_of(method, "method", methods())
    return importlib.import_module(f"{__name__}.{name.replace('-', '_')}")

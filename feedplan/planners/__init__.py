"""Planners: from a problem to a speed profile; one file a method, found by its name.

The method `bang-bang` is the module `bang_bang`; modules that begin with an underscore are shared by methods.
`MethodName` lists the names, and the documentation of `feedplan.plan` the options. A module has

- `plan(problem: Problem, …) -> SpeedProfile`; options are keyword arguments, each with a default.
- `CORNERS`, a `feedplan.geometry.corners.Corners`, if the method is for another path than the rounded one.
- `LIMITS_JERK = True` if its profiles keep the jerk limits of the axes; the audit then checks them.
- `GRID_ERROR` if its profiles come with a lower bound of their own (`SpeedProfile.lower_bound`): finer grids
  may gain this many times the accuracy.

`plan` may take more keyword arguments: `PROGRESS` to report how far it is, `RESERVE` to announce the work
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

# Keeps time for the work that follows a plan; it is given by `feedplan.plan`, and no option of users.
RESERVE = "reserve"
# A function that gets the part of the plan that is done; an argument of `feedplan.plan` too.
PROGRESS = "progress"
# Does parts of the work; given by `feedplan.plan` too.
ELSEWHERE = "elsewhere"


def methods() -> tuple[MethodName, ...]:
    """The names of all planning methods; the documentation of `feedplan.plan` has their options."""
    return get_args(MethodName)


def planner(method: str, **options: Any) -> Callable[[Problem], SpeedProfile]:
    """The planning function of a method, with those `options` that are not None.

    Raises InputError naming the methods there are, or the options that the method has.
    """
    plan: Callable[..., SpeedProfile] = _module(method).plan
    return partial(plan, **given_options(method, options))


def given_options(method: str, options: Mapping[str, Any], others: Iterable[str] = ()) -> dict[str, Any]:
    """Those options of a method that are not None; one that only other methods take may be None.

    Raises as `planner`, naming the methods that take the option if there are any; `others` may be given as
    well.
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
    """How many times the accuracy finer grids would gain on a method's own bound, 0 without one."""
    return float(getattr(_module(method), "GRID_ERROR", 0.0))


def options_of(method: str) -> dict[str, Any]:
    """A method's options by name, with their defaults; raises as `planner`."""
    parameters = inspect.signature(_module(method).plan).parameters.values()
    others = ("problem", RESERVE, PROGRESS, ELSEWHERE)
    return {own.name: own.default for own in parameters if own.name not in others}


def takes(method: str, argument: str) -> bool:
    """Whether a method takes `RESERVE`, `PROGRESS` or `ELSEWHERE`; raises as `planner`."""
    return argument in inspect.signature(_module(method).plan).parameters


def corners(method: str) -> Corners:
    """The corners of the path that a method is made for; raises as `planner`."""
    choice: Corners = getattr(_module(method), "CORNERS", Corners.ROUNDED)
    return choice


def limits_jerk(method: str | None) -> bool:
    """Whether a method claims to keep the axes' jerk limits, which are judged then; an unknown one: no."""
    return method in methods() and getattr(_module(str(method)), "LIMITS_JERK", False)


def _module(method: str) -> ModuleType:
    name = one_of(method, "method", methods())
    return importlib.import_module(f"{__name__}.{name.replace('-', '_')}")

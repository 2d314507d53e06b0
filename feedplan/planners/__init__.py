"""Planners: a problem in, a speed profile out; one file a method, found by its name.

A planner module has one function `plan(problem: Problem) -> SpeedProfile`, with what options it has as
keywords, each with a default. The method `bang-bang` is the module `bang_bang`, `MethodName` has its name,
and the documentation of `feedplan.plan` its options; modules that begin with an underscore are what methods
share. A method that is made for another path than the rounded one says so in `CORNERS`
(`feedplan.geometry.corners.Corners`); one whose profiles keep the jerk limits of the axes says
`LIMITS_JERK = True`, and the audit judges them. One that knows a bound of the time beside that of
`feedplan.lower_bound` has `lower_bound(problem, profile)` with the same options, and `GRID_ERROR` if
that leaves so many times the accuracy to finer grids. One that tells how far it is takes `PROGRESS`, and so
does its bound; one that can tell what follows its plan before it is made (`planners.jerk_limited`) takes
`RESERVE`, and one whose runs may be planned on other computers `ELSEWHERE`, as does its bound.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import ModuleType
from typing import Any, Literal, cast

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
# Is told how far the plan is; given by `feedplan.plan` too.
PROGRESS = "progress"
# Does parts of the work; given by `feedplan.plan` too.
ELSEWHERE = "elsewhere"


def methods() -> tuple[MethodName, ...]:
    """The names of all planning methods; `feedplan.plan` tells the options of each."""
    names = (module.name for module in pkgutil.iter_modules(__path__))
    known = sorted(name.replace("_", "-") for name in names if not name.startswith("_"))
    return cast("tuple[MethodName, ...]", tuple(known))


def planner(method: str, **options: Any) -> Callable[[Problem], SpeedProfile]:
    """The planning function of a method, with those `options` that are not None.

    Raises InputError naming the methods there are, or the options that the method has.
    """
    plan: Callable[..., SpeedProfile] = _module(method).plan
    return partial(plan, **given_options(method, options))


def given_options(method: str, options: Mapping[str, Any], others: Iterable[str] = ()) -> dict[str, Any]:
    """Those options of a method that are not None; one that only other methods take may be None.

    Raises as `planner`; `others` may be given as well.
    """
    known = options_of(method)
    for name, value in options.items():
        if name in known or (value is None and any(name in options_of(other) for other in methods())):
            continue
        some = ", ".join((*known, *others))
        remedy = f"give {some}, or leave it out" if some else "leave it out"
        raise InputError(f"the method {method} takes no {name}: {remedy}")
    return {name: value for name, value in options.items() if value is not None}


def bound_of(method: str, **options: Any) -> Callable[..., float] | None:
    """What a method itself knows of the least time [s] from one of its profiles, with the same options; None
    for most; raises as `planner`."""
    bound: Callable[..., float] | None = getattr(_module(method), "lower_bound", None)
    return None if bound is None else partial(bound, **given_options(method, options))


def grid_error(method: str) -> float:
    """How many times the accuracy a method's own bound leaves to finer grids, 0 for most."""
    return float(getattr(_module(method), "GRID_ERROR", 0.0))


def options_of(method: str) -> dict[str, Any]:
    """A method's options by name, with their defaults; raises as `planner`."""
    parameters = inspect.signature(_module(method).plan).parameters.values()
    others = ("problem", RESERVE, PROGRESS, ELSEWHERE)
    return {own.name: own.default for own in parameters if own.name not in others}


def tells_early(method: str) -> bool:
    """Whether a method can tell what follows its plan before it is made (`RESERVE`); raises as `planner`."""
    return RESERVE in inspect.signature(_module(method).plan).parameters


def tells_progress(method: str) -> bool:
    """Whether a method tells how far its plan is (`PROGRESS`); raises as `planner`."""
    return PROGRESS in inspect.signature(_module(method).plan).parameters


def goes_elsewhere(method: str) -> bool:
    """Whether runs of a method may be planned on other computers (`ELSEWHERE`); raises as `planner`."""
    return ELSEWHERE in inspect.signature(_module(method).plan).parameters


def corners(method: str) -> Corners:
    """What becomes of a program's corners in the path that a method is made for; raises as `planner`."""
    choice: Corners = getattr(_module(method), "CORNERS", Corners.ROUNDED)
    return choice


def limits_jerk(method: str | None) -> bool:
    """Whether a method claims to keep the axes' jerk limits, which are judged then; an unknown one: no."""
    return method in methods() and getattr(_module(str(method)), "LIMITS_JERK", False)


def _module(method: str) -> ModuleType:
    name = one_of(method, "method", methods())
    return importlib.import_module(f"{__name__}.{name.replace('-', '_')}")

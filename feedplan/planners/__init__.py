"""Planners: a problem in, a speed profile out; one file a method, found by its name.

A planner module has one function `plan(problem: Problem) -> SpeedProfile`, with what options it has as
keywords. The method `bang-bang` is the module `bang_bang`; modules that begin with an underscore are what
methods share. A method that is made for another path than the rounded one says so in `CORNERS`
(`feedplan.geometry.corners.Corners`); one whose profiles keep the jerk limits of the axes says
`LIMITS_JERK = True`, and the audit judges them. One that knows a bound of the time beside that of
`feedplan.bound` has a function `lower_bound(problem, profile)` with the same options, and `GRID_ERROR` if
that leaves so many times the accuracy to finer grids.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import partial
from types import ModuleType

from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.geometry.corners import Corners
from feedplan.profile import SpeedProfile


def methods() -> tuple[str, ...]:
    """The names of all planning methods."""
    names = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name.replace("_", "-") for name in names if not name.startswith("_")))


def planner(method: str, **options: float | None) -> Callable[[Problem], SpeedProfile]:
    """The planning function of a method, with those `options` that are not None.

    Raises InputError naming the methods there are, or the option that the method does not have.
    """
    plan: Callable[..., SpeedProfile] = _module(method).plan
    given = {name: value for name, value in options.items() if value is not None}
    for name in given.keys() - options_of(method):
        raise InputError(f"the method {method} takes no {name.replace('_', ' ')}: leave it out")
    return partial(plan, **given)


def bound_of(method: str, **options: float | None) -> Callable[[Problem, SpeedProfile], float] | None:
    """What a method itself knows of the least time [s] from one of its profiles, with the same options; None
    for most; raises as `planner`."""
    bound: Callable[..., float] | None = getattr(_module(method), "lower_bound", None)
    given = {name: value for name, value in options.items() if value is not None}
    return None if bound is None else partial(bound, **given)


def default_accuracy(method: str) -> float:
    """The accuracy that a method plans to where none is given; 0 for one that has none."""
    known = inspect.signature(_module(method).plan).parameters.get("accuracy")
    return 0.0 if known is None else float(known.default)


def grid_error(method: str) -> float:
    """How many times the accuracy a method's own bound leaves to finer grids, 0 for most."""
    return float(getattr(_module(method), "GRID_ERROR", 0.0))


def options_of(method: str) -> frozenset[str]:
    """The names of a method's options; raises as `planner`."""
    return frozenset(inspect.signature(_module(method).plan).parameters) - {"problem"}


def corners(method: str) -> Corners:
    """What becomes of a program's corners in the path that a method is made for; raises as `planner`."""
    choice: Corners = getattr(_module(method), "CORNERS", Corners.ROUNDED)
    return choice


def limits_jerk(method: str | None) -> bool:
    """Whether a method claims to keep the axes' jerk limits, which are judged then; an unknown one: no."""
    return method in methods() and getattr(_module(str(method)), "LIMITS_JERK", False)


def _module(method: str) -> ModuleType:
    if method not in methods():
        raise InputError(f"there is no method '{method}': use one of {', '.join(methods())}")
    return importlib.import_module(f"{__name__}.{method.replace('-', '_')}")

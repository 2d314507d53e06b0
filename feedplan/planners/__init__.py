"""Planners: a problem in, a speed profile out; one file a method, found by its name.

A planner module has one function `plan(problem: Problem) -> SpeedProfile`. The method `bang-bang` is the
module `bang_bang`; modules that begin with an underscore are what methods share. A method that is made for
another path than the rounded one says so in `CORNERS` (`feedplan.geometry.corners.Corners`).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from types import ModuleType

from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.geometry.corners import Corners
from feedplan.profile import SpeedProfile


def methods() -> tuple[str, ...]:
    """The names of all planning methods."""
    names = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name.replace("_", "-") for name in names if not name.startswith("_")))


def planner(method: str) -> Callable[[Problem], SpeedProfile]:
    """The planning function of a method; raises InputError naming the methods there are."""
    plan: Callable[[Problem], SpeedProfile] = _module(method).plan
    return plan


def corners(method: str) -> Corners:
    """What becomes of a program's corners in the path that a method is made for; raises as `planner`."""
    choice: Corners = getattr(_module(method), "CORNERS", Corners.ROUNDED)
    return choice


def _module(method: str) -> ModuleType:
    if method not in methods():
        raise InputError(f"there is no method '{method}': use one of {', '.join(methods())}")
    return importlib.import_module(f"{__name__}.{method.replace('-', '_')}")

"""Planners: a problem in, a speed profile out; one file a method, found by its name.

A planner module has one function `plan(problem: Problem) -> SpeedProfile`. The method `bang-bang` is the
module `bang_bang`.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable

from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.profile import SpeedProfile


def methods() -> tuple[str, ...]:
    """The names of all planning methods."""
    names = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name.replace("_", "-") for name in names if not name.startswith("_")))


def planner(method: str) -> Callable[[Problem], SpeedProfile]:
    """The planning function of a method; raises InputError naming the methods there are."""
    if method not in methods():
        raise InputError(f"there is no method '{method}': use one of {', '.join(methods())}")
    module = importlib.import_module(f"{__name__}.{method.replace('-', '_')}")
    plan: Callable[[Problem], SpeedProfile] = module.plan
    return plan

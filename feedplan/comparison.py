"""Plans one program by several methods; compares time, proven gap, computing time, worst use of limits.

Methods may follow different paths within the tolerance; a lower bound holds only for its own path.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from feedplan.arguments import callback, list_of_names, number, one_of
from feedplan.audit import Audit, LimitCheck
from feedplan.errors import InfeasibleError, InputError, MissingPackageError, SolverError
from feedplan.geometry.path import Path
from feedplan.machine.controller import Controller
from feedplan.machine.machine import Machine
from feedplan.planners import MethodName, limits_jerk, options_of
from feedplan.planners import methods as all_methods
from feedplan.planning import OF_ALL_METHODS, Plan, plan, reading_of
from feedplan.program.program import Program
from feedplan.program.read import read_program
from feedplan.program.source import Source
from feedplan.progress import Progress
from feedplan.today import Today

# The names of the machine's and the program's limits in an audit.
LIMITS = ("feed", "velocity", "acceleration", "jerk", "chord", "deviation")

# Time limit of each method if the user gives none [s]; solvers on meshes may take hours.
TIME_LIMIT = 10.0

# Begin and end of each stage in the progress of one method (0 to 1).
STAGES = {"fit": (0.0, 0.2), "plan": (0.2, 0.6), "audit": (0.6, 1.0)}


@dataclass(frozen=True)
class Row:
    """The result of one method: its plan and audit, or a sentence why it has no plan.

    `lower_bound` [s] is the greatest lower bound that any method has proven on this method's path.
    """

    method: MethodName
    plan: Plan | None
    lower_bound: float
    error: str | None = None

    @property
    def time(self) -> float | None:
        """Time of the program [s], None without a plan."""
        return None if self.plan is None else self.plan.time

    @property
    def saved(self) -> float | None:
        """The time of today's controller minus the plan's time [s]; None without a controller."""
        return self.plan.today.saved if self.plan and self.plan.today else None

    @property
    def gap(self) -> float | None:
        """(time − lower_bound) / time, an upper bound of the share of the time that could be saved.

        None without a plan, or if the plan breaks limits: it may then be faster than the bound.
        """
        if self.plan is None or not self.plan.audit().ok:
            return None
        return (self.plan.time - self.lower_bound) / self.plan.time if self.plan.time > 0 else 0.0

    @property
    def audit(self) -> Audit | None:
        """The audit of the plan, None without a plan."""
        return None if self.plan is None else self.plan.audit()

    def worst(self, limit: str) -> LimitCheck | None:
        """The check with the greatest use of a limit, over all axes; None if nothing was measured."""
        checks = [check for check in self.audit.checks if check.name == limit] if self.audit else []
        return max(checks, key=lambda check: check.ratio, default=None)

    def to_json(self) -> dict[str, Any]:
        """The numbers by name."""
        return {
            "method": self.method,
            "time": self.time,
            "lower_bound": self.lower_bound if self.plan else None,
            "gap": self.gap,
            "saved": self.saved,
            "compute": dict(self.plan.compute) if self.plan else None,
            "audit": self.audit.to_json() if self.audit else None,
            "error": self.error,
        }


def compare(
    source: Source | Program | Path,
    machine: Machine | str | os.PathLike[str],
    methods: Sequence[MethodName] | None = None,
    *,
    time_limit: float | None = TIME_LIMIT,
    progress: Progress | None = None,
    **options: Any,
) -> tuple[Row, ...]:
    """Plans one program by each of the methods (None: all) and audits every plan.

    `source`, `machine` and `options` are those of `feedplan.plan`; each method gets only the options that it
    takes. `time_limit` [s] is the limit of each method (None: no limit). The row of a method that finds no
    plan, or whose package is missing, has an error. `progress(method, done)` is called with the finished
    share of a method. Raises the errors of `feedplan.plan` about program, machine and options.
    """
    chosen = (
        all_methods() if methods is None else list_of_names(methods, "methods", "a list of methods' names")
    )
    if not chosen:
        raise InputError("there is no method to compare: name one or more")
    has = {one_of(method, "method", all_methods()): options_of(method) for method in chosen}
    if time_limit is not None:
        remedy = "a positive number, or None"
        options["time_limit"] = number(time_limit, "the time limit", remedy, lambda given: given > 0, "s")
    known = dict.fromkeys((*OF_ALL_METHODS, *chain.from_iterable(has.values()), "time_limit"))
    for name in options:
        if name not in known:
            raise InputError(f"no method of these takes {name}: give {', '.join(known)}, or leave it out")
    callback(progress)
    machine = Machine.of(machine)
    reading = reading_of(source, options.pop("reading", None))
    if not isinstance(source, (Program, Path)):
        source = read_program(source, machine, feed=options.get("feed"), **reading)
    given = options.pop("controller", None)
    rival = machine.controller if given is None else Controller.of(given)
    alone = replace(machine, controller=None)
    today: Today | None = None
    rows: list[Row] = []
    for method, takes in has.items():
        shown = partial(_show, progress, method)
        shown("fit", 0.0)
        try:
            own = {name: value for name, value in options.items() if name in takes or name in OF_ALL_METHODS}
            made = plan(source, alone, method, **own, controller=None if today else rival, progress=shown)
            today = today or made.today
            made = replace(made, machine=machine, today=today and replace(today, planned=made.time))
            made.audit(shown)
            rows.append(Row(method, made, made.lower_bound))
        except (InfeasibleError, MissingPackageError, SolverError) as error:
            rows.append(Row(method, None, 0.0, str(error)))
        if progress:
            progress(method, 1.0)
    return tuple(replace(row, lower_bound=_greatest_bound(row, rows)) for row in rows)


def _show(progress: Progress | None, method: str, stage: str, done: float) -> None:
    if progress and stage in STAGES:
        start, end = STAGES[stage]
        progress(method, start + (end - start) * done)


def _greatest_bound(row: Row, rows: Sequence[Row]) -> float:
    """The greatest lower bound of all `rows` that holds for the plan of a row; 0 if there is none."""
    bounds = (
        other.lower_bound for other in rows if row.plan and other.plan and _bounds(other.plan, row.plan)
    )
    return max(bounds, default=0.0)


def _bounds(other: Plan, made: Plan) -> bool:
    """Whether the lower bound of `other` holds for `made`: both follow the same path, and `made` keeps jerk
    limits if `other` does."""
    same_path = np.array_equal(made.path.curve.control_points, other.path.curve.control_points)
    same_stops = np.array_equal(made.problem.junction_speed, other.problem.junction_speed)
    return same_path and same_stops and limits_jerk(made.method) >= limits_jerk(other.method)

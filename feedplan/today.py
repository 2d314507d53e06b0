"""Computes the time that a controller takes for a program today, to compare it with that of a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from feedplan.constraints.problem import build_problem
from feedplan.errors import InfeasibleError, SolverError
from feedplan.geometry.build import build_path
from feedplan.geometry.path import Path
from feedplan.machine.controller import Controller
from feedplan.machine.machine import Machine
from feedplan.planners import corners, planner
from feedplan.program.program import Program


@dataclass(frozen=True)
class Today:
    """The time of a program by the model of a `controller` (`time` [s]) and by the plan (`planned` [s])."""

    controller: Controller
    time: float
    planned: float

    @property
    def saved(self) -> float:
        """The controller's time minus the plan's [s]."""
        return self.time - self.planned

    def of_controller(self) -> dict[str, Any]:
        """The controller's numbers by name."""
        return {
            "controller": self.controller.name,
            "parameters": dict(self.controller.parameters),
            "time": self.time,
        }

    def to_json(self) -> dict[str, Any]:
        """All numbers by name."""
        return {**self.of_controller(), "saved": self.saved}


def time_by(
    controller: Controller,
    source: Program | Path,
    machine: Machine,
    tolerance: float | None,
    **request: Any,
) -> float:
    """The time of the program by the model of the controller, including pauses [s].

    `tolerance` and `request` (feed, feed_override, start_speed, end_speed) are arguments of `feedplan.plan`,
    which also describes the errors.
    """
    method = controller.model.method
    if isinstance(source, Program):
        source = build_path(source, machine, tolerance, corners=corners(method))
    problem = build_problem(source, machine, **request)
    return planner(method, **controller.options)(problem).time + source.pauses


def beside_plan(
    controller: Controller, time: float, source: Program | Path, machine: Machine, settings: Mapping[str, Any]
) -> tuple[Today | None, tuple[str, ...]]:
    """The controller's time, compared with a plan of `time` [s] that was made with the same settings; or None
    and a sentence if the model finds no plan."""
    try:
        return Today(controller, time_by(controller, source, machine, **settings), time), ()
    except (InfeasibleError, SolverError) as error:
        return None, (f"the time by {controller.name} is not known: {error}",)

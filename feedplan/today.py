"""The time that a controller takes for a program as it is, beside that of a plan."""

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
    """What `controller` makes of a program: `time` [s] by its model, `planned` [s] by the plan."""

    controller: Controller
    time: float
    planned: float

    @property
    def saved(self) -> float:
        """By how much the plan is faster [s]."""
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
    """The time [s] of the program with its pauses by the model of the controller.

    `tolerance` and `request` are as for `feedplan.plan`: feed, feed_override, start_speed, end_speed.
    Raises as that does.
    """
    method = controller.model.method
    if isinstance(source, Program):
        source = build_path(source, machine, tolerance, corners=corners(method))
    problem = build_problem(source, machine, **request)
    return planner(method, **controller.options)(problem).time + source.pauses


def beside_plan(
    controller: Controller, time: float, source: Program | Path, machine: Machine, settings: Mapping[str, Any]
) -> tuple[Today | None, tuple[str, ...]]:
    """The controller beside a plan of `time` [s] made with the same settings; None and a sentence where its
    model has no plan."""
    try:
        return Today(controller, time_by(controller, source, machine, **settings), time), ()
    except (InfeasibleError, SolverError) as error:
        return None, (f"the time by {controller.name} is not known: {error}",)

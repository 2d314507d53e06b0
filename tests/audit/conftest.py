"""A planned part that uses all that the audit checks, and tools to plant faults in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.audit import Audit, audit
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.planners import planner
from feedplan.planning import plan
from feedplan.profile import OF_PHASES, SpeedProfile
from feedplan.program.program import Program
from feedplan.setpoints import SetpointChunk, Setpoints
from tests.along import path_along

COLUMNS = ("t", "position", "velocity", "acceleration", "jerk", "line")


@dataclass(frozen=True)
class Case:
    """All that one audit compares; the methods `with_…` return a case with parts of it replaced."""

    problem: Problem
    profile: SpeedProfile
    machine: Machine
    program: Program | None
    points: SetpointChunk

    @property
    def path(self) -> Path:
        return self.problem.path

    def audit(self, chunk: int = 1000) -> Audit:
        return audit(self.problem, self.profile, self.machine, self.program, self.chunks(chunk))

    def chunks(self, size: int) -> Iterator[SetpointChunk]:
        for first in range(0, len(self.points.t), size):
            part = {name: getattr(self.points, name)[first : first + size] for name in COLUMNS}
            yield SetpointChunk(**part, axes=self.points.axes)

    def with_path(self, **changes: Any) -> Case:
        return replace(self, problem=replace(self.problem, path=replace(self.path, **changes)))

    def with_problem(self, **changes: Any) -> Case:
        return replace(self, problem=replace(self.problem, **changes))

    def with_profile(self, **changes: Any) -> Case:
        return replace(self, profile=replace(self.profile, **changes))

    def with_program(self, **changes: Any) -> Case:
        assert self.program is not None
        return replace(self, program=replace(self.program, **changes))

    def with_points(self, **changes: Any) -> Case:
        return replace(self, points=replace(self.points, **changes))

    def arcs(self, change: Callable[[NDArray[Any]], NDArray[Any]], runs: NDArray[np.int64]) -> Case:
        """The case with `change` applied to the rows of every column of the profile."""
        columns = {name: change(getattr(self.profile, name)) for name in OF_PHASES}
        return self.with_profile(**columns, runs=runs)

    def rows(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Case:
        """The case with `change` applied to the rows of every column of the setpoints."""
        return self.with_points(**{name: change(getattr(self.points, name)) for name in COLUMNS})

    def start(self, arc: int) -> float:
        """Time at which an arc begins, dwells included [s]."""
        run = int(np.searchsorted(self.profile.runs, arc, side="right")) - 1
        return float(self.profile.duration[:arc].sum() + self.path.dwell[:run].sum())


def planned(problem: Problem, machine: Machine, program: Program | None = None) -> Case:
    profile = planner("bang-bang")(problem)
    return Case(problem, profile, machine, program, Setpoints(problem, profile, problem.period).all())


@pytest.fixture(scope="session")
def part(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """Curve, corner, arc, helix, pause and exact stop on a mill that is slow in Z."""
    lines = ["G21 G90 G17 G64 P0.02", "G1 F4000 X0 Y0 Z0"]
    lines += [
        f"X{x:.4f} Y{4 * math.sin(math.pi * x / 10):.4f} Z{0.3 * math.cos(x):.4f}"
        for x in np.arange(0.5, 30.1, 0.5)
    ]
    lines += ["G3 X36 Y0 I3 J0 F2500", "G1 X36 Y10", "G4 P0.0503", "G1 X20 Y14 Z2"]
    lines += [
        "G2 X20 Y14 Z6 I-5 J0",
        "G61.1",
        "G1 X10 Y14 F1200",
        "X10 Y20",
        "G64 P0.02",
        "G0 X0 Y0 Z5",
        "M2",
    ]
    file = tmp_path_factory.mktemp("part") / "part.ngc"
    file.write_text("\n".join(lines) + "\n")
    result = plan(file, Machine.load("mill"))
    points = result.setpoints().all()
    return Case(result.problem, result.profile, result.machine, result.program, points)


@pytest.fixture(scope="session")
def spline() -> Callable[..., Case]:
    """A smooth random path: a C1 quadratic B-spline on a random polygon, planned and sampled."""

    def make(
        machine: Machine,
        seed: int,
        count: int = 60,
        size: float = 1.0,
        offset: float = 0.0,
        feed: float = 150.0,
    ) -> Case:
        rng = np.random.default_rng(seed)
        axes = len(machine.axes)
        heading = rng.normal(size=axes)
        corners = [np.full(axes, offset)]
        for _ in range(count + 1):
            heading = heading / np.linalg.norm(heading) + 0.3 * rng.normal(size=axes)
            corners.append(corners[-1] + size * rng.uniform(0.3, 3.0) * heading / np.linalg.norm(heading))
        polygon = np.array(corners)
        edge = np.linalg.norm(np.diff(polygon, axis=0), axis=1)
        width = 0.5 * (edge[:-1] + edge[1:])
        share = np.concatenate(([0.0], width)) / np.concatenate(
            ([width[0]], width[:-1] + width[1:], [width[-1]])
        )
        knots = polygon[:-1] + share[:, None] * np.diff(polygon, axis=0)
        path = path_along(
            CompositeCurve.from_pieces(np.stack([knots[:-1], polygon[1:-1], knots[1:]], axis=1), width),
            machine.axis_names,
            feed=feed,
            line=np.arange(1, count + 1),
            runs=[0, count // 3, count],
            dwell=np.array([0.0123, 0.0]),
        )
        return planned(build_problem(path, machine), machine)

    return make

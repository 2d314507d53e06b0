"""From a part program to a plan: read, build the path, state the problem, plan, and hand out setpoints."""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from feedplan.accuracy import estimate, shortfalls
from feedplan.audit import Audit, audit
from feedplan.bound import lower_bound
from feedplan.constraints.problem import Problem, build_problem, speed_square
from feedplan.geometry.build import build_path
from feedplan.geometry.path import Path
from feedplan.machine.machine import Machine
from feedplan.outputs import FORMAT
from feedplan.planners import (
    bound_of,
    corners,
    default_accuracy,
    grid_error,
    limits_jerk,
    options_of,
    planner,
)
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.program.read import read_program
from feedplan.report.account import Account, account
from feedplan.setpoints import Setpoints, setpoints
from feedplan.time_limit import TimeLimit
from feedplan.trajectory import State, Trajectory

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Plan:
    """A planned program.

    `profile` is the speed along `problem.path`; `lower_bound` [s] is proven: no feasible profile of this path
    is faster, though one of another path within the tolerance may be (a method with a bound of its own, as
    jerk-limited, may prove its on a grid and say so); `compute` is the computing time of each stage [s];
    `options` those that the plan was made with.
    """

    program: Program | None
    machine: Machine
    problem: Problem
    profile: SpeedProfile
    method: str
    lower_bound: float
    compute: dict[str, float]
    interpolator: str = "sarfraz"
    warnings: tuple[str, ...] = field(default=())
    options: Mapping[str, Any] = field(default_factory=dict)
    _verdict: list[Audit] = field(default_factory=list, init=False, repr=False, compare=False)

    def __repr__(self) -> str:
        name = self.program.name if self.program else "a path"
        return (
            f"<Plan of {name} on {self.machine.name} by {self.method}: {self.time:.6g} s, "
            f"gap {100 * self.gap:.3g} %, {len(self.path)} pieces>"
        )

    def _repr_html_(self) -> str:
        from feedplan.report.card import card

        return card(self.figures(), self.trajectory)

    def figures(self) -> dict[str, str]:
        """The key figures by name, in words: what a notebook shows. The audit is told if it has been made."""
        verdict = self._verdict[0] if self._verdict else None
        judged = "not made yet" if verdict is None else "every limit holds" if verdict.ok else "failed"
        return {
            "program": self.program.name if self.program else "a path",
            "machine": self.machine.name,
            "method": self.method,
            "time": f"{self.time:.6g} s",
            "no plan of this path is faster than": f"{self.lower_bound:.6g} s (gap {100 * self.gap:.3g} %)",
            "pieces": f"{len(self.path)} in {len(self.path.runs) - 1} runs",
            "audit": judged,
            **({"warnings": "; ".join(self.warnings)} if self.warnings else {}),
        }

    @property
    def path(self) -> Path:
        """The path that is followed."""
        return self.problem.path

    @property
    def time(self) -> float:
        """Time of the whole program, dwells included [s]."""
        return self.profile.time + self.path.pauses

    @property
    def gap(self) -> float:
        """How far the time can be from the optimum at most: (time − lower_bound) / time."""
        return (self.time - self.lower_bound) / self.time if self.time > 0 else 0.0

    def setpoints(self, period: float | None = None, interpolator: str | None = None) -> Setpoints:
        """Setpoints at the servo period [s] (the machine's unless given), computed as they are read."""
        return setpoints(
            self.problem, self.profile, period or self.machine.period, interpolator or self.interpolator
        )

    @cached_property
    def trajectory(self) -> Trajectory:
        """The plan as functions of time and length."""
        return Trajectory(self.problem, self.profile)

    @cached_property
    def account(self) -> Account:
        """What the time and the way are made of: limits, slow lines, stops, feed and rapid motion."""
        return account(self.problem, self.profile, self.program, limits_jerk(self.method))

    def at(self, t: ArrayLike) -> State:
        """Position, velocity, acceleration, jerk and source line at one time or at times (n,) [s]; exact.

        See `Trajectory.at`."""
        return self.trajectory.at(t)

    def audit(self, progress: Progress | None = None) -> Audit:
        """The independent check of profile, geometry and setpoints; computed once.

        `progress("audit", done)` is called as it goes on.
        """
        if not self._verdict:
            share = (lambda done: progress("audit", done)) if progress else None
            with _timed(self.compute, "audit"):
                verdict = audit(
                    self.problem,
                    self.profile,
                    self.machine,
                    self.program,
                    self.setpoints(),
                    jerk=limits_jerk(self.method),
                    progress=share,
                )
            self._verdict.append(verdict)
        return self._verdict[0]

    def summary(self) -> dict[str, Any]:
        """What `plan.json` holds: plain numbers and strings.

        `setpoints` are those of the machine's period. Hashes tell whether a text was changed.
        """
        fit, program, points = self.path.fit, self.program, self.setpoints()
        machine_file = self.machine.to_toml()
        return {
            "format": FORMAT,
            "units": {"length": "mm", "angle": "deg", "time": "s"},
            "time": self.time,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "estimated_gap": estimate(self.profile),
            "stopped": self.profile.stopped,
            "method": self.method,
            "options": dict(self.options),
            "machine": self.machine.name,
            "machine_file": machine_file,
            "machine_file_sha256": hashlib.sha256(machine_file.encode()).hexdigest(),
            "program": program.name if program else None,
            "program_sha256": program.sha256 if program else None,
            "setpoints": {
                "axes": list(points.axes),
                "period": points.period,
                "count": points.count,
                "duration": points.duration,
            },
            **self.account.to_json(),
            "pieces": len(self.path),
            "runs": len(self.path.runs) - 1,
            "stops": len(self.path.runs) - 2,
            "fit": {
                "points": fit.points,
                "splines": fit.splines,
                "polynomials": fit.polynomials,
                "deviation": fit.deviation,
            },
            "compute": dict(self.compute),
            "audit": self.audit().to_json(),
            "warnings": list(self.warnings),
        }


def plan(
    source: str | os.PathLike[str] | Program | Path,
    machine: Machine | str,
    method: str = "bang-bang",
    *,
    accuracy: float | None = None,
    cells: int | None = None,
    time_limit: float | None = None,
    tolerance: float | None = None,
    feed: float | None = None,
    feed_override: float = 1.0,
    period: float | None = None,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
    interpolator: str = "sarfraz",
    progress: Progress | None = None,
) -> Plan:
    """The plan of a part program on a machine, time-optimal unless another method is asked for.

    `source`: a file, a Program or a Path. `machine`: a Machine, or the name or file of one. Methods that
    solve on a mesh refine it to the relative `accuracy` of the time, or take `cells` a piece, and give up
    after `time_limit` [s]; others take none of these. With jerk-limited the limit is for all work from here
    to the files: reading, fitting, a first plan, audit, setpoints and report are never left out (how long the
    last three will take is known from some setpoints of the first plan), the rest of the time is for a
    better plan and its bound. `tolerance` [mm] is the greatest distance from the programmed path where the
    program lets the tool leave it (default: the program's own, else 0.01); how the path follows the program
    within it is the method's choice (`planners.corners`). `feed` [mm/s] replaces the programmed feeds,
    `feed_override` multiplies them. `period` [s] replaces the machine's servo period;
    `start_speed` and `end_speed` [mm/s] hold at the ends. `progress(stage, done)` is called as the work goes
    on. Raises ProgramError, MachineError, InputError or InfeasibleError, each a sentence with place and
    remedy.
    """
    of_method = {"accuracy": accuracy, "cells": cells, "time_limit": time_limit}
    solve: Callable[..., SpeedProfile] = planner(method, **of_method)
    # The limit of a method that can tell early what follows its plan is one for all of it.
    limit = TimeLimit(time_limit) if time_limit is not None and "reserve" in options_of(method) else None
    if not isinstance(machine, Machine):
        machine = Machine.load(machine)
    if period is not None:
        machine = machine.with_period(period)
    report = progress or (lambda stage, done: None)
    compute: dict[str, float] = {}
    program: Program | None = None
    if isinstance(source, Path):
        path = source
    else:
        report("read", 0.0)
        with _timed(compute, "read"):
            program = source if isinstance(source, Program) else read_program(FilePath(source), machine)
        report("fit", 0.0)
        with _timed(compute, "fit"):
            path = build_path(program, machine, tolerance, corners=corners(method))
    report("plan", 0.0)
    with _timed(compute, "plan"):
        problem = build_problem(
            path,
            machine,
            feed=feed,
            feed_override=feed_override,
            start_speed=start_speed,
            end_speed=end_speed,
        )
        if limit is not None:
            solve = partial(
                solve, time_limit=limit.left, reserve=_following(limit, problem, machine, interpolator)
            )
        profile = solve(problem)
    with _timed(compute, "bound"):
        least = lower_bound(problem, profile)
        left = time_limit if limit is None else limit.left
        known = bound_of(method, **{**of_method, "time_limit": left})
        if known is not None:
            least = max(least, known(problem, profile))
        wanted = accuracy or default_accuracy(method)
        short = shortfalls(
            profile,
            least,
            accuracy=wanted,
            to_prove=accuracy is not None,
            time_limit=time_limit,
            left_to_grids=wanted * grid_error(method),
        )
        least += path.pauses
    report("plan", 1.0)
    return Plan(
        program=program,
        machine=machine,
        problem=problem,
        profile=profile,
        method=method,
        lower_bound=least,
        compute=compute,
        interpolator=interpolator,
        warnings=(program.warnings if program else ())
        + path.warnings
        + short
        + rounding_stops(problem, profile)
        + curvature_jumps(problem, profile),
        options={
            **of_method,
            "tolerance": tolerance,
            "feed": feed,
            "feed_override": feed_override,
            "period": period,
            "start_speed": start_speed,
            "end_speed": end_speed,
            "interpolator": interpolator,
        },
    )


def _following(
    limit: TimeLimit, problem: Problem, machine: Machine, interpolator: str
) -> Callable[[SpeedProfile], float]:
    """Keeps of a limit what will follow a plan, by a first one of the problem; returns that [s]."""
    return lambda first: limit.keep_for(setpoints(problem, first, machine.period, interpolator))


def rounding_stops(problem: Problem, profile: SpeedProfile) -> tuple[str, ...]:
    """A sentence for each line on which rounding makes the plan stop."""
    lines = dict.fromkeys(int(line) for line in problem.path.line[profile.slowed])
    return tuple(
        f"line {line}: rounding hides how the path goes on next to a cusp: the plan stops there, slower than "
        "it need be; a corner in place of the cusp is exact"
        for line in lines
    )


def curvature_jumps(problem: Problem, profile: SpeedProfile) -> tuple[str, ...]:
    """A sentence where jumps of curvature slow a profile of limited jerk: how many, and the slowest place."""
    if not len(profile.kinked):
        return ()
    # The first arc of each piece: it begins at the jump.
    arc = np.searchsorted(profile.piece, profile.kinked)
    speed_sq = profile.p0[arc] * speed_square(problem, profile.kinked, np.zeros(len(arc)))
    slowest = int(np.argmin(speed_sq))
    line = int(problem.path.line[profile.kinked[slowest]])
    count = len(profile.kinked)
    joints = "1 joint" if count == 1 else f"{count} joints, here the most"
    return (
        f"line {line}: the tool slows to {math.sqrt(speed_sq[slowest]):.3g} mm/s where the curvature jumps, "
        f"as it does at {joints}: limits of jerk hold it there; a path of continuous curvature is faster",
    )


@contextmanager
def _timed(compute: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        compute[stage] = time.perf_counter() - start

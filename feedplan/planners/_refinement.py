"""Planning by a solver on meshes: stretch by stretch, finer until the time is accurate enough.

On each mesh the solution is checked between the nodes. Where an arc goes beyond a limit that its rows kept, the
limit is lowered there by as much and the solution repeated; what little is left after some rounds is met by
scaling p, which keeps every limit. So the result is feasible, and its time approaches the least from above.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.errors import InputError, SolverError
from feedplan.planners._arcs import Arcs, arcs_between, profile
from feedplan.planners._mesh import Mesh, Stretch, end_error, mesh, stretches
from feedplan.planners._transcription import Rows, Transcription, transcribe
from feedplan.profile import SpeedProfile

Array = NDArray[np.float64]

# The first mesh has as many cells in a piece, and in a stretch.
_LEAST, _FIRST = 4, 32
# More cells are not tried; the solvers need some 10 kB for each.
MAX_CELLS = 400_000
# How often limits are lowered where the arcs go beyond them, and what is left to scaling.
_ROUNDS = 6
_EXCESS = 1e-6
# A cell that exceeds a limit by more than this though it was lowered is held at both ends.
_STUBBORN = 1e-4
# Seen between the checked places, and rounding.
_MARGIN = 1e-9


class Refused(Exception):
    """A solver ended without a solution: its own word, and whether it proved that there is none."""

    def __init__(self, word: str, infeasible: bool = False) -> None:
        super().__init__(word)
        self.infeasible = infeasible


# x in the nodes of a transcription, within so many seconds; raises Refused.
Solve = Callable[[Transcription, float], Array]


@dataclass(frozen=True)
class Method:
    """A solver, its `rows` of a mesh for limits (n, joints) and for cells that are held at both ends (n,), and
    what its result is.

    `by_axis`: arcs may be of constant joint acceleration. `feasible`: limits are kept between the nodes.
    """

    name: str
    solve: Solve
    rows: Callable[[Mesh, Array, NDArray[np.bool_]], Rows]
    by_axis: bool = True
    feasible: bool = True


def plan_on_meshes(
    problem: Problem,
    method: Method,
    accuracy: float,
    cells: int | None,
    time_limit: float | None,
) -> SpeedProfile:
    """The profile of all runs: on `cells` cells a piece, or on meshes refined to the relative `accuracy`."""
    if not 0.0 < accuracy < 1.0:
        raise InputError(f"the accuracy is {accuracy}: give a part of the time between 0 and 1, as 1e-4")
    if cells is not None and cells < 1:
        raise InputError(f"{cells} cells a piece: give 1 or more")
    if time_limit is not None and not time_limit > 0.0:
        raise InputError(f"the time limit is {time_limit} s: give a positive number")
    deadline = time.monotonic() + (math.inf if time_limit is None else time_limit)
    parts: list[tuple[Mesh, Arcs]] = []
    runs, count = [0], 0
    for run in stretches(problem):
        for stretch in run:
            part = _Planner(problem, stretch, method, deadline).plan(accuracy, cells)
            parts.append(part)
            count += len(part[0])
        runs.append(count)
    return profile(problem, parts, runs)


@dataclass(frozen=True)
class _Planner:
    """Plans one stretch."""

    problem: Problem
    stretch: Stretch
    method: Method
    deadline: float

    def plan(self, accuracy: float, cells: int | None) -> tuple[Mesh, Arcs]:
        pieces = self.stretch.last - self.stretch.first
        if cells is not None:
            self._check(pieces * cells, "a coarser mesh (fewer cells)")
            return self._on(np.full(pieces, cells))
        count = np.full(pieces, max(_LEAST, math.ceil(_FIRST / pieces)))
        times: list[float] = []
        while True:
            self._check(
                int(count.sum()),
                f"an accuracy above {accuracy:g}"
                + (f" ({_error(times):.1g} is reached)" if len(times) > 1 else ""),
            )
            part = self._on(count)
            times.append(float(part[1].duration.sum()))
            if len(times) > 1 and _error(times) <= accuracy:
                return part
            count = 2 * count

    def _check(self, cells: int, remedy: str) -> None:
        if cells > MAX_CELLS:
            raise SolverError(
                f"{self._place}{self.method.name} would need {cells} cells, {MAX_CELLS} are the most: ask for "
                f"{remedy}, or use bang-bang"
            )

    def _on(self, cells: NDArray[np.int64]) -> tuple[Mesh, Arcs]:
        """The solution on one mesh."""
        cut = mesh(self.problem, self.stretch, cells)
        acceleration = self.problem.max_acceleration
        allowed = np.ones((len(cut), len(acceleration)))
        share = np.ones(len(cut) + 1)
        at_ends = np.zeros(len(cut), dtype=bool)
        best: Arcs | None = None
        for rounds in range(_ROUNDS if self.method.feasible else 1):
            rows = self.method.rows(cut, acceleration * allowed, at_ends)
            transcription = transcribe(cut, rows, acceleration, share, self.method.feasible)
            p = self._solve(transcription) * transcription.scale
            arcs = arcs_between(self.problem, cut, p, self.method.by_axis)
            if not self.method.feasible:
                return cut, arcs
            worst = float(arcs.worst.max())
            loss = arcs.duration.sum() * math.sqrt(max(worst, 1.0))
            if best is None or loss < best.duration.sum() * math.sqrt(max(float(best.worst.max()), 1.0)):
                best = arcs
            if worst <= 1.0 + _EXCESS:
                break
            allowed /= np.maximum(arcs.acceleration, 1.0)
            if rounds:
                stay = (arcs.acceleration.max(axis=1) > 1.0 + _STUBBORN) & ~at_ends
                allowed[stay] = 1.0
                at_ends |= stay
            beyond = np.maximum(arcs.speed, 1.0)
            share /= np.maximum(np.append(beyond, 1.0), np.append(1.0, beyond))
        assert best is not None
        factor = (1.0 - _MARGIN) / max(float(best.worst.max()), 1.0)
        moving = [p is not None and p > 0.0 for p in cut.fixed]
        if not any(moving):
            return cut, best.scaled(factor)
        if factor < 1.0 - 2.0 * _EXCESS:
            raise SolverError(
                f"{self._place}{self.method.name} leaves a limit by {1.0 / factor - 1.0:.1g} of it between the "
                "nodes, and speeds given at the ends of the path keep it from being slower: ask for a finer mesh"
            )
        return cut, best

    def _solve(self, transcription: Transcription) -> Array:
        left = self.deadline - time.monotonic()
        name = self.method.name
        try:
            if left <= 0.0:
                raise Refused("time is up")
            if not transcription.free.any():
                return transcription.known
            return self.method.solve(transcription, left)
        except Refused as refusal:
            if refusal.infeasible:
                sides = [side for side, x in enumerate(transcription.fixed) if x]
                if sides:
                    raise end_error(self.problem, self.stretch, sides[0]) from None
            raise SolverError(
                f"{self._place}{name} found no profile ({refusal}): allow more time, ask for another accuracy, "
                "or use bang-bang"
            ) from None

    @property
    def _place(self) -> str:
        return f"line {int(self.problem.path.line[self.stretch.first])}: "


def _error(times: list[float]) -> float:
    """The relative error of the last of the times on meshes each twice as fine as the one before.

    The order is the observed one of the last three, between 1 and 2; 1 of two times.
    """
    last = abs(times[-1] - times[-2])
    before = abs(times[-2] - times[-3]) if len(times) > 2 else 0.0
    order = 1.0 if last == 0.0 or before == 0.0 else min(max(math.log2(before / last), 1.0), 2.0)
    return last / (2.0**order - 1.0) / times[-1]

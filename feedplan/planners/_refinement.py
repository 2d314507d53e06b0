"""Planning by a solver on meshes: each subrun on finer and finer meshes until the time is accurate enough.

The fastest profile is at some limit everywhere. Cells whose arcs are below all limits, or whose rows are
stricter than the limits, lose the most time: these cells are cut in two.

On each mesh the solution is checked between the stations. Where an arc exceeds a limit that its rows keep,
the limit is lowered by the excess and the subrun is solved again. After some rounds p is scaled down by the
rest, which keeps every limit. So the result is feasible, and its time approaches the least time from above.
"""

from __future__ import annotations

import importlib
import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from feedplan.arguments import is_whole, number, shown
from feedplan.arrays import Flags, Floats
from feedplan.constraints.problem import Problem
from feedplan.errors import InfeasibleError, InputError, MissingPackageError, SolverError, at_line
from feedplan.planners._arcs import Arcs, arcs_between, profile
from feedplan.planners._faults import end_error
from feedplan.planners._mesh import Cuts, Mesh, Subrun, even_cuts, mesh, subruns
from feedplan.planners._transcription import Rows, Transcription, transcribe
from feedplan.profile import SpeedProfile

# The least numbers of cells of the first mesh in a piece, and in a subrun.
_LEAST, _FIRST = 4, 32
# The greatest number of cells of a subrun: solvers need about 10 kB for each.
MAX_CELLS = 400_000
# The greatest number of cells a piece that a user may ask for.
_MOST_CELLS = 1_000_000_000
# How many times limits are lowered where arcs exceed them, more times where given speeds at the ends forbid
# scaling; and the excess that scaling may remove. The audit allows 1e-6.
_ROUNDS = 3
_MOVING_ROUNDS = 8
_EXCESS = 5e-7
# A cell that exceeds a lowered limit by more than this share has its limits at both ends instead.
_STUBBORN = 1e-4
# A limit that holds at both ends of a cell costs time where more than this share of it is used.
_NEAR = 0.9
# The cells that make this share of the error are cut.
_SHARE = 0.9
# The factor of the error from one mesh to the next, at best and at worst.
_FALLS = 0.25, 0.7
# The estimate of the error may be half the error.
_SAFETY = 0.5
# The error is at most about this share of the time in which no limit is used in full.
_TRUE = 0.35
# Covers rounding, and excess between the places that are checked.
_MARGIN = 1e-9


class Refusal(Exception):  # noqa: N818 (its handler makes the error of it)
    """A solver ended without a solution: its own word, and whether it proved that no solution exists."""

    def __init__(self, word: str, infeasible: bool = False) -> None:
        super().__init__(word)
        self.infeasible = infeasible


# From a transcription and a time limit [s] to x in its stations; raises Refusal.
Solve = Callable[[Transcription, float], Floats]


@dataclass(frozen=True)
class Method:
    """A solver of a package.

    `rows` gives the rows of a mesh from limits (n, joints) and from the cells whose limits hold at both ends
    (n,). `by_axis`: arcs may have a constant joint acceleration. `feasible`: the result keeps limits between
    the stations. `platform`: the only one that the package exists for, if any. `others`: packages that it
    needs besides.
    """

    name: str
    solve: Solve
    rows: Callable[[Mesh, Floats, Flags], Rows]
    by_axis: bool = True
    feasible: bool = True
    platform: str = ""
    others: tuple[str, ...] = ()

    def require(self) -> None:
        """Raises MissingPackageError where its packages cannot be imported."""
        for package in (self.name, *self.others):
            self._require(package)

    def _require(self, package: str) -> None:
        try:
            with warnings.catch_warnings():
                # The docstrings of toppra hold escapes that Python warns of.
                warnings.simplefilter("ignore")
                importlib.import_module(package)
        except ImportError:
            where = f", which there is for {self.platform}" if self.platform else ""
            raise MissingPackageError(
                f"the method {self.name} needs the package {package}{where}: `pip install {package}`"
            ) from None


def plan_on_meshes(
    problem: Problem,
    method: Method,
    accuracy: float,
    cells: int | None,
    time_limit: float | None,
) -> SpeedProfile:
    """The profile of all runs: on `cells` cells a piece, or on meshes refined to the relative `accuracy`."""
    remedy = "a part of the time between 0 and 1, as 1e-4"
    accuracy = number(accuracy, "the accuracy", remedy, lambda part: 0.0 < part < 1.0)
    if cells is not None and not is_whole(cells, most=_MOST_CELLS):
        raise InputError(f"{shown(cells)} cells a piece: give a whole number from 1 to {_MOST_CELLS}")
    if time_limit is not None:
        time_limit = number(time_limit, "the time limit", "a positive number", lambda limit: limit > 0, "s")
    method.require()
    deadline = time.monotonic() + (math.inf if time_limit is None else time_limit)
    parts: list[tuple[Mesh, Arcs]] = []
    runs, count = [0], 0
    for run in subruns(problem):
        for subrun in run:
            part = _Planner(problem, subrun, method, deadline).plan(accuracy, cells)
            parts.append(part)
            count += len(part[0])
        runs.append(count)
    return profile(parts, runs)


@dataclass(frozen=True)
class _Strictness:
    """How much stricter than the limits the rows are: parts of the `acceleration` (n, joints) and of p in the
    stations, `speed` (n + 1,); and which cells are held `at_ends` (n,). `repeated` after the first time."""

    acceleration: Floats
    speed: Floats
    at_ends: Flags
    repeated: bool = False

    @classmethod
    def none(cls, grid: Mesh, problem: Problem) -> _Strictness:
        cells = len(grid)
        return cls(np.ones((cells, len(problem.axes))), np.ones(cells + 1), np.zeros(cells, dtype=bool))

    def tightened(self, arcs: Arcs) -> _Strictness:
        """Lower limits where arcs exceed them; a cell that exceeds them again has limits at its ends."""
        stubborn = self.repeated & (arcs.acceleration.max(axis=1) > 1.0 + _STUBBORN) & ~self.at_ends
        acceleration = self.acceleration / _excess(arcs.acceleration)
        acceleration[stubborn] = 1.0
        beyond = _excess(arcs.speed)
        speed = self.speed / np.maximum(np.append(beyond, 1.0), np.append(1.0, beyond))
        return _Strictness(acceleration, speed, self.at_ends | stubborn, repeated=True)

    @property
    def share(self) -> Floats:
        """The share of the accelerations that is not used (n,)."""
        return np.asarray(1.0 - self.acceleration.min(axis=1))


def _excess(used: Floats) -> Floats:
    """The factor by which a limit has to be lowered, 1 where it is kept."""
    return np.where(used > 1.0, used * (1.0 + _EXCESS), 1.0)


@dataclass(frozen=True)
class _Planner:
    """Plans one subrun."""

    problem: Problem
    subrun: Subrun
    method: Method
    deadline: float

    def plan(self, accuracy: float, cells: int | None) -> tuple[Mesh, Arcs]:
        pieces = self.subrun.last - self.subrun.first
        if cells is not None:
            self._check(pieces * cells, "a coarser mesh (fewer cells)")
            grid, arcs, _ = self._on(even_cuts(self.subrun, cells))
            excess = float(arcs.worst.max()) - 1.0
            if self.method.feasible and excess > _EXCESS:
                raise SolverError(
                    f"{self._place}{self.method.name} leaves a limit by {excess:.1g} of it between stations, "
                    "and speeds given at the ends of the path keep it from being slower: give more cells"
                )
            return grid, arcs
        cuts = even_cuts(self.subrun, max(_LEAST, math.ceil(_FIRST / pieces)))
        times: list[float] = []
        reached = ""
        while True:
            self._check(len(cuts), f"an accuracy above {accuracy:g}{reached}")
            grid, arcs, lost = self._on(cuts)
            times.append(float(arcs.duration.sum()))
            unsure = lost + arcs.duration * (1.0 - arcs.used)
            if len(times) > 2:
                error = max(_left(times), _TRUE * float(unsure.sum())) / times[-1]
                kept = not self.method.feasible or arcs.worst.max() <= 1.0 + _EXCESS
                if kept and error <= _SAFETY * accuracy:
                    return grid, arcs
                reached = f" ({error:.1g} is reached)"
            cuts = cuts.bisected(_greatest(unsure))

    def _check(self, cells: int, remedy: str) -> None:
        if cells > MAX_CELLS:
            raise SolverError(
                f"{self._place}{self.method.name} would need {cells} cells, {MAX_CELLS} are the most: "
                f"ask for {remedy}, or use bang-bang"
            )

    def _on(self, cuts: Cuts) -> tuple[Mesh, Arcs, Floats]:
        """The solution on one mesh, and the time (n,) lost by keeping the limits between the stations."""
        grid = mesh(self.problem, self.subrun, cuts)
        moving = any(p is not None and p > 0.0 for p in grid.fixed)
        strict = _Strictness.none(grid, self.problem)
        arcs, rows = self._under(strict, grid)
        if not self.method.feasible:
            return grid, arcs, np.zeros(len(grid))
        best = arcs, rows, strict
        for _ in range(_MOVING_ROUNDS if moving else _ROUNDS):
            if arcs.worst.max() <= 1.0 + _EXCESS:
                break
            strict = strict.tightened(arcs)
            try:
                arcs, rows = self._under(strict, grid)
            except InfeasibleError:
                break  # the given speeds at the ends need the whole limits
            if arcs.feasible_time < best[0].feasible_time:
                best = arcs, rows, strict
        arcs, rows, strict = best
        worst = float(arcs.worst.max())
        held = (rows.held & (arcs.acceleration > _NEAR)).any(axis=1)
        lost = arcs.duration * (strict.share + np.where(held, grid.turn, 0.0))
        lost += arcs.duration.sum() * np.maximum(arcs.worst - (1.0 + _EXCESS), 0.0)
        # Speeds given at the ends cannot be scaled: a finer mesh has to remove the excess.
        return grid, arcs if moving else arcs.scaled((1.0 - _MARGIN) / max(worst, 1.0)), lost

    def _under(self, strict: _Strictness, grid: Mesh) -> tuple[Arcs, Rows]:
        """The arcs of the solution under stricter limits, and its rows."""
        acceleration = np.array([-self.problem.min_acceleration, self.problem.max_acceleration])
        rows = self.method.rows(grid, acceleration[:, None] * strict.acceleration, strict.at_ends)
        task = transcribe(grid, rows, acceleration, strict.speed, self.method.feasible)
        p = self._solve(task) * task.scale
        return arcs_between(self.problem, grid, p, self.method.by_axis), rows

    def _solve(self, transcription: Transcription) -> Floats:
        left = self.deadline - time.monotonic()
        name = self.method.name
        try:
            if left <= 0.0:
                raise Refusal("time is up")
            if not transcription.free.any():
                return transcription.known
            return self.method.solve(transcription, left)
        except Refusal as refusal:
            if refusal.infeasible:
                ends = (True, self.subrun.first), (False, self.subrun.last - 1)
                for (at_start, piece), x in zip(ends, transcription.fixed, strict=True):
                    if x:
                        line = int(self.problem.path.line[piece])
                        raise end_error(self.problem, at_start, line) from None
            raise SolverError(
                f"{self._place}{name} found no profile ({refusal}): allow more time, ask for another "
                "accuracy, or use bang-bang"
            ) from None

    @property
    def _place(self) -> str:
        return at_line(int(self.problem.path.line[self.subrun.first]))


def _greatest(parts: Floats) -> Flags:
    """The greatest of the parts (n,) that together are the share `_SHARE` of the sum."""
    order = np.argsort(-parts)
    enough = int(np.searchsorted(np.cumsum(parts[order]), _SHARE * parts.sum())) + 1
    marked = np.zeros(len(parts), dtype=bool)
    marked[order[:enough]] = True
    return marked


def _left(times: list[float]) -> float:
    """The estimated fall of the time on all finer meshes.

    The ratio of the last two falls gives the sum of a geometric series.
    """
    before, last = (abs(times[-i] - times[-i - 1]) for i in (2, 1))
    ratio = min(max(last / before, _FALLS[0]), _FALLS[1]) if before > 0.0 else _FALLS[1]
    return last * ratio / (1.0 - ratio)

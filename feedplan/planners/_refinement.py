"""Plans with a solver: each subrun is solved on finer and finer meshes until its time is accurate enough.

The fastest profile reaches some limit everywhere. Most time is lost in cells whose phases reach no limit, or
whose rows are stricter than the limits: these cells are bisected.

On each mesh the solution is checked between the stations. Where a phase exceeds a limit although its rows
keep it, the limit is lowered by the excess and the subrun is solved again. After some rounds p is scaled down
by the remaining excess, so that every limit holds. So the result is feasible, and its time approaches the
least time from above.
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
from feedplan.planners._faults import end_error
from feedplan.planners._mesh import Cuts, Mesh, Subrun, even_cuts, mesh, subruns
from feedplan.planners._phases import Phases, phases_between, profile
from feedplan.planners._transcription import Rows, Transcription, transcribe
from feedplan.profile import SpeedProfile

# The least number of cells of the first mesh in a piece (`_LEAST`), and in a subrun (`_FIRST`).
_LEAST, _FIRST = 4, 32
# The greatest number of cells of a subrun: solvers need about 10 kB for each.
MAX_CELLS = 400_000
# The greatest number of cells for each piece that a user may request.
_MOST_CELLS = 1_000_000_000
# How many times limits are lowered where phases exceed them: `_ROUNDS`, or `_MOVING_ROUNDS` if given speeds
# at the ends forbid scaling. `_EXCESS` is the excess that scaling may remove; the audit allows 1e-6.
_ROUNDS = 3
_MOVING_ROUNDS = 8
_EXCESS = 5e-7
# A cell that exceeds a lowered limit by more than this share gets rows at both its ends instead.
_STUBBORN = 1e-4
# Rows at both ends of a cell cost time where more than this share of the limit is used.
_NEAR = 0.9
# The cells that cause this share of the error are bisected.
_SHARE = 0.9
# The error of a mesh over that of the mesh before it, at best and at worst.
_FALLS = 0.25, 0.7
# The estimated error may be this share of the true error.
_SAFETY = 0.5
# The error is at most about this share of the time in which no limit is fully used.
_TRUE = 0.35
# Margin for rounding, and for excess between the places that are checked.
_MARGIN = 1e-9


class Refusal(Exception):  # noqa: N818 (its handler makes the error of it)
    """A solver ended without a solution: its own word, and whether it proved that there is none."""

    def __init__(self, word: str, infeasible: bool = False) -> None:
        super().__init__(word)
        self.infeasible = infeasible


# Returns x at the stations for a transcription and a time limit [s]; raises Refusal.
Solve = Callable[[Transcription, float], Floats]


@dataclass(frozen=True)
class Method:
    """A solver from a package.

    `rows` makes the rows of a mesh from limits (n, joints) and from the cells whose limits hold at both ends
    (n,). `by_axis`: phases may have a constant joint acceleration. `feasible`: the result must keep limits
    between the stations. `platform`: the only platform with this package, if any. `others`: further packages
    that it needs.
    """

    name: str
    solve: Solve
    rows: Callable[[Mesh, Floats, Flags], Rows]
    by_axis: bool = True
    feasible: bool = True
    platform: str = ""
    others: tuple[str, ...] = ()

    def require(self) -> None:
        """Raises MissingPackageError if one of its packages cannot be imported."""
        for package in (self.name, *self.others):
            self._require(package)

    def _require(self, package: str) -> None:
        try:
            with warnings.catch_warnings():
                # The docstrings of toppra contain escapes that cause Python warnings.
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
    """The profile of all runs: with `cells` cells a piece, or on meshes refined to relative `accuracy`."""
    remedy = "a part of the time between 0 and 1, as 1e-4"
    accuracy = number(accuracy, "the accuracy", remedy, lambda part: 0.0 < part < 1.0)
    if cells is not None and not is_whole(cells, most=_MOST_CELLS):
        raise InputError(f"{shown(cells)} cells a piece: give a whole number from 1 to {_MOST_CELLS}")
    if time_limit is not None:
        time_limit = number(time_limit, "the time limit", "a positive number", lambda limit: limit > 0, "s")
    method.require()
    deadline = time.monotonic() + (math.inf if time_limit is None else time_limit)
    parts: list[tuple[Mesh, Phases]] = []
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
    """How much stricter than the limits the rows are: factors of the `acceleration` limits (n, joints) and of
    p at the stations, `speed` (n + 1,); and which cells have rows at both ends, `at_ends` (n,). `repeated` is
    true from the second time on."""

    acceleration: Floats
    speed: Floats
    at_ends: Flags
    repeated: bool = False

    @classmethod
    def none(cls, grid: Mesh, problem: Problem) -> _Strictness:
        cells = len(grid)
        return cls(np.ones((cells, len(problem.axes))), np.ones(cells + 1), np.zeros(cells, dtype=bool))

    def tightened(self, phases: Phases) -> _Strictness:
        """Lowers limits where phases exceed them; a cell that exceeds them again gets rows at its ends."""
        stubborn = self.repeated & (phases.acceleration.max(axis=1) > 1.0 + _STUBBORN) & ~self.at_ends
        acceleration = self.acceleration / _excess(phases.acceleration)
        acceleration[stubborn] = 1.0
        beyond = _excess(phases.speed)
        speed = self.speed / np.maximum(np.append(beyond, 1.0), np.append(1.0, beyond))
        return _Strictness(acceleration, speed, self.at_ends | stubborn, repeated=True)

    @property
    def share(self) -> Floats:
        """The greatest share of an acceleration limit that the rows leave unused in each cell (n,)."""
        return np.asarray(1.0 - self.acceleration.min(axis=1))


def _excess(used: Floats) -> Floats:
    """The divisor that lowers a limit, 1 where it is kept."""
    return np.where(used > 1.0, used * (1.0 + _EXCESS), 1.0)


@dataclass(frozen=True)
class _Planner:
    """Plans one subrun."""

    problem: Problem
    subrun: Subrun
    method: Method
    deadline: float

    def plan(self, accuracy: float, cells: int | None) -> tuple[Mesh, Phases]:
        pieces = self.subrun.last - self.subrun.first
        if cells is not None:
            self._check(pieces * cells, "a coarser mesh (fewer cells)")
            grid, phases, _ = self._on(even_cuts(self.subrun, cells))
            excess = float(phases.worst.max()) - 1.0
            if self.method.feasible and excess > _EXCESS:
                raise SolverError(
                    f"{self._place}{self.method.name} leaves a limit by {excess:.1g} of it between stations, "
                    "and speeds given at the ends of the path keep it from being slower: give more cells"
                )
            return grid, phases
        cuts = even_cuts(self.subrun, max(_LEAST, math.ceil(_FIRST / pieces)))
        times: list[float] = []
        reached = ""
        while True:
            self._check(len(cuts), f"an accuracy above {accuracy:g}{reached}")
            grid, phases, lost = self._on(cuts)
            times.append(float(phases.duration.sum()))
            unsure = lost + phases.duration * (1.0 - phases.used)
            if len(times) > 2:
                error = max(_left(times), _TRUE * float(unsure.sum())) / times[-1]
                kept = not self.method.feasible or phases.worst.max() <= 1.0 + _EXCESS
                if kept and error <= _SAFETY * accuracy:
                    return grid, phases
                reached = f" ({error:.1g} is reached)"
            cuts = cuts.bisected(_greatest(unsure))

    def _check(self, cells: int, remedy: str) -> None:
        if cells > MAX_CELLS:
            raise SolverError(
                f"{self._place}{self.method.name} would need {cells} cells, {MAX_CELLS} are the most: "
                f"ask for {remedy}, or use bang-bang"
            )

    def _on(self, cuts: Cuts) -> tuple[Mesh, Phases, Floats]:
        """The mesh, its solution, and the time (n,) [s] lost by keeping the limits between the stations."""
        grid = mesh(self.problem, self.subrun, cuts)
        moving = any(p is not None and p > 0.0 for p in grid.fixed)
        strict = _Strictness.none(grid, self.problem)
        phases, rows = self._under(strict, grid)
        if not self.method.feasible:
            return grid, phases, np.zeros(len(grid))
        best = phases, rows, strict
        for _ in range(_MOVING_ROUNDS if moving else _ROUNDS):
            if phases.worst.max() <= 1.0 + _EXCESS:
                break
            strict = strict.tightened(phases)
            try:
                phases, rows = self._under(strict, grid)
            except InfeasibleError:
                break  # the given speeds at the ends need the full limits
            if phases.feasible_time < best[0].feasible_time:
                best = phases, rows, strict
        phases, rows, strict = best
        worst = float(phases.worst.max())
        held = (rows.held & (phases.acceleration > _NEAR)).any(axis=1)
        lost = phases.duration * (strict.share + np.where(held, grid.turn, 0.0))
        lost += phases.duration.sum() * np.maximum(phases.worst - (1.0 + _EXCESS), 0.0)
        # Given speeds at the ends cannot be scaled: a finer mesh has to remove the excess.
        return grid, phases if moving else phases.scaled((1.0 - _MARGIN) / max(worst, 1.0)), lost

    def _under(self, strict: _Strictness, grid: Mesh) -> tuple[Phases, Rows]:
        """The phases of the solution under stricter limits, and its rows."""
        acceleration = np.array([-self.problem.min_acceleration, self.problem.max_acceleration])
        rows = self.method.rows(grid, acceleration[:, None] * strict.acceleration, strict.at_ends)
        task = transcribe(grid, rows, acceleration, strict.speed, self.method.feasible)
        p = self._solve(task) * task.scale
        return phases_between(self.problem, grid, p, self.method.by_axis), rows

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
    """Marks the greatest of the `parts` (n,), as many as make the share `_SHARE` of the sum."""
    order = np.argsort(-parts)
    enough = int(np.searchsorted(np.cumsum(parts[order]), _SHARE * parts.sum())) + 1
    marked = np.zeros(len(parts), dtype=bool)
    marked[order[:enough]] = True
    return marked


def _left(times: list[float]) -> float:
    """Estimates by how much all finer meshes together reduce the time [s].

    It is the sum of a geometric series with the ratio of the last two reductions.
    """
    before, last = (abs(times[-i] - times[-i - 1]) for i in (2, 1))
    ratio = min(max(last / before, _FALLS[0]), _FALLS[1]) if before > 0.0 else _FALLS[1]
    return last * ratio / (1.0 - ratio)

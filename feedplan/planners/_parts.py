"""A problem in parts that are planned apart: every run begins and ends at rest, so runs do not interact.

The joined profiles of the parts are equal to the profile of the whole bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import PlanError
from feedplan._solvers import Problem as NativeProblem
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.curves.speed_polynomial import SpeedPolynomial
from feedplan.lazy import cached_property
from feedplan.profile import OF_PHASES, OF_PIECES, SpeedProfile
from feedplan.progress import Listener

Floats = NDArray[np.float64]


class Elsewhere(Protocol):
    """An executor that does parts of the work in place of this process."""

    def count(self) -> int:
        """The number of parts that keeps the executor busy."""

    def map(
        self, work: Callable[..., Any], given: Sequence[tuple[Any, ...]], progress: Listener | None
    ) -> list[Any]:
        """What `work(*arguments, progress)` returns for each of the arguments that are given."""


@dataclass(frozen=True)
class Runs:
    """The fields of a `Path` that native code takes, for some of its runs; offsets count from 0."""

    runs: NDArray[np.int64]
    line: NDArray[np.int32]
    start_dwell: float
    dwell: Floats


@dataclass(frozen=True)
class Part:
    """What native planners take of a `Problem`, for the runs from the `run`-th to before the `end_run`-th.

    Their pieces begin with the `first`.
    """

    run: int
    end_run: int
    first: int
    path: Runs
    curve: CompositeCurve
    tip_speed: SpeedPolynomial | None
    way_speed: SpeedPolynomial | None
    tip_curve: CompositeCurve | None
    feed_share: Floats | None
    feed: Floats
    junction_speed: Floats
    max_velocity: Floats
    max_acceleration: Floats
    min_velocity: Floats
    min_acceleration: Floats
    chord_tolerance: float
    period: float
    start_speed: float
    end_speed: float

    @cached_property
    def native(self) -> NativeProblem:
        """The part as kernels take it."""
        return NativeProblem(self)


def parts(problem: Problem, count: int) -> list[Part]:
    """The problem in at most `count` parts of about equally many pieces; a run stays whole."""
    runs = problem.path.runs
    wanted = np.linspace(0, runs[-1], count + 1)[1:-1]
    cuts = np.unique([0, *np.searchsorted(runs, wanted), len(runs) - 1])
    return [_part(problem, int(a), int(b)) for a, b in pairwise(cuts)]


def _part(problem: Problem, run: int, end_run: int) -> Part:
    runs = problem.path.runs
    first, end = int(runs[run]), int(runs[end_run])
    return Part(
        run=run,
        end_run=end_run,
        first=first,
        path=Runs(
            runs=runs[run : end_run + 1] - first,
            line=problem.path.line[first:end],
            start_dwell=0.0,
            dwell=problem.path.dwell[run:end_run],
        ),
        curve=problem.curve[first:end],
        tip_speed=None if problem.tip_speed is None else problem.tip_speed[first:end],
        way_speed=None if problem.way_speed is None else problem.way_speed[first:end],
        tip_curve=None if problem.tip_curve is None else problem.tip_curve[first:end],
        feed_share=None if problem.feed_share is None else problem.feed_share[first:end],
        feed=problem.feed[first:end],
        junction_speed=problem.junction_speed[first : end + 1],
        max_velocity=problem.max_velocity,
        max_acceleration=problem.max_acceleration,
        min_velocity=problem.min_velocity,
        min_acceleration=problem.min_acceleration,
        chord_tolerance=problem.chord_tolerance,
        period=problem.period,
        start_speed=problem.start_speed if run == 0 else 0.0,
        end_speed=problem.end_speed if end_run == len(runs) - 1 else 0.0,
    )


def joined(own: Sequence[Part], planned: Sequence[tuple[SpeedProfile, Floats]]) -> SpeedProfile:
    """The profile of the whole from those of the parts, and the excess of their runs."""
    profiles, excess = zip(*planned, strict=True)
    names = (*OF_PHASES, *OF_PIECES, "run_bounds")
    columns: dict[str, list[Any]] = {name: [getattr(each, name) for each in profiles] for name in names}
    for name in ("piece", *OF_PIECES):
        columns[name] = [column + part.first for part, column in zip(own, columns[name], strict=True)]
    arcs = np.cumsum([0, *map(len, profiles)])
    runs = [profile.runs[1:] + before for profile, before in zip(profiles, arcs[:-1], strict=True)]
    return SpeedProfile(
        **{name: np.concatenate(column) for name, column in columns.items()},  # type: ignore[arg-type]
        runs=np.concatenate(([0], *runs)),
        excess=math.fsum(np.concatenate(excess)),
    )


def fault_of(part: Part, arguments: tuple[Any, ...]) -> PlanError:
    """The fault of a part with the piece of the whole, from the arguments of a PlanError."""
    kind, piece, reachable, sentence = arguments
    return PlanError(kind, None if piece is None else piece + part.first, reachable, sentence)

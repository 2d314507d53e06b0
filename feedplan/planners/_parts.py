"""Divides a problem into parts that are planned apart: runs begin and end at rest, and do not interact.

The joined profiles of the parts equal the profile of the whole problem bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, Protocol

import numpy as np

from feedplan._solvers import PlanError
from feedplan._solvers import Problem as NativeProblem
from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.lazy import cached_property
from feedplan.profile import SpeedProfile, joined_runs
from feedplan.progress import Listener


class Elsewhere(Protocol):
    """An executor that does parts of the work in place of this process."""

    def count(self) -> int:
        """The number of parts that keeps all workers of the executor busy."""

    def map(
        self, work: Callable[..., Any], given: Sequence[tuple[Any, ...]], progress: Listener | None
    ) -> list[Any]:
        """The results of `work(*arguments, progress)` for each element of `given`."""


# The fields of a problem that kernels take: with a value for each piece, and common to all parts.
_OF_EACH_PIECE = ("curve", "tip_speed", "way_speed", "tip_curve", "feed_share", "feed")
_SHARED = (
    "max_velocity",
    "max_acceleration",
    "min_velocity",
    "min_acceleration",
    "chord_tolerance",
    "period",
)


@dataclass(frozen=True)
class Part:
    """The runs `run` to before `end_run` of a problem; `first` is the index of their first piece.

    `given` has the fields of a `Problem` that kernels take, only for these runs.
    """

    run: int
    end_run: int
    first: int
    given: SimpleNamespace

    @cached_property
    def native(self) -> NativeProblem:
        """The part in the form that the native kernels take."""
        return NativeProblem(self.given)


def parts(problem: Problem, count: int) -> list[Part]:
    """The problem in at most `count` parts with about equal numbers of pieces; runs are not divided."""
    runs = problem.path.runs
    wanted = np.linspace(0, runs[-1], count + 1)[1:-1]
    cuts = np.unique([0, *np.searchsorted(runs, wanted), len(runs) - 1])
    return [_part(problem, int(a), int(b)) for a, b in pairwise(cuts)]


def _part(problem: Problem, run: int, end_run: int) -> Part:
    path, runs = problem.path, problem.path.runs
    first, end = int(runs[run]), int(runs[end_run])
    columns = {name: getattr(problem, name) for name in _OF_EACH_PIECE}
    given = SimpleNamespace(
        path=SimpleNamespace(
            runs=runs[run : end_run + 1] - first,
            line=path.line[first:end],
            start_dwell=0.0,
            dwell=path.dwell[run:end_run],
        ),
        **{name: None if column is None else column[first:end] for name, column in columns.items()},
        **{name: getattr(problem, name) for name in _SHARED},
        junction_speed=problem.junction_speed[first : end + 1],
        start_speed=problem.start_speed if run == 0 else 0.0,
        end_speed=problem.end_speed if end_run == len(runs) - 1 else 0.0,
    )
    return Part(run, end_run, first, given)


def joined(own: Sequence[Part], planned: Sequence[tuple[SpeedProfile, Floats]]) -> SpeedProfile:
    """The profile of the whole problem from the profiles of the parts and the excess of their runs."""
    profiles, excess = zip(*planned, strict=True)
    whole = [slice(0, len(profile.runs) - 1) for profile in profiles]
    return joined_runs(
        zip(profiles, whole, (part.first for part in own), strict=True),
        excess=math.fsum(np.concatenate(excess)),
        run_bounds=np.concatenate([profile.run_bounds for profile in profiles]),
    )


def fault_of(part: Part, arguments: tuple[Any, ...]) -> PlanError:
    """A part's PlanError, from its arguments, with the index of the piece in the whole problem."""
    kind, piece, reachable, sentence = arguments
    return PlanError(kind, None if piece is None else piece + part.first, reachable, sentence)

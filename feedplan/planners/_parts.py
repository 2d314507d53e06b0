"""A problem in parts that are planned apart: each run begins and ends at rest, so that none knows of another.

Put together, the profiles of the parts are that of the whole bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import PlanError
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener

Floats = NDArray[np.float64]


class Elsewhere(Protocol):
    """Who does parts of the work in place of this process."""

    def count(self) -> int:
        """How many parts keep all of it busy."""

    def map(
        self, work: Callable[..., Any], given: Sequence[tuple[Any, ...]], progress: Listener | None
    ) -> list[Any]:
        """What `work(*arguments, progress)` returns for each of the arguments that are given."""


@dataclass(frozen=True)
class Runs:
    """Offsets of runs in the pieces, from 0."""

    runs: NDArray[np.int64]


@dataclass(frozen=True)
class Pieces:
    """Pieces of a `CompositeCurve`."""

    control_points: Floats
    weights: Floats | None
    offsets: NDArray[np.int64]
    width: Floats


@dataclass(frozen=True)
class Squares:
    """Some pieces of a `TipSpeed`."""

    coefficients: Floats
    offsets: NDArray[np.int64]


@dataclass(frozen=True)
class Part:
    """What native planners take of a `Problem`, for the runs from the `run`-th to before the `end_run`-th.

    Their pieces begin with the `first`.
    """

    run: int
    end_run: int
    first: int
    path: Runs
    curve: Pieces
    tip_speed: Squares | None
    way_speed: Squares | None
    tip_curve: Pieces | None
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


@dataclass(frozen=True)
class PartOfProfile:
    """What the native bound takes of a profile, for the arcs of a part."""

    piece: NDArray[np.uint32]
    kind: NDArray[np.uint8]
    u0: Floats
    u1: Floats
    p0: Floats
    p1: Floats
    a0: Floats
    a1: Floats
    duration: Floats


def parts(problem: Problem, count: int) -> list[Part]:
    """The problem in so many parts of about as many pieces, or in fewer: a run stays whole."""
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
        path=Runs(runs[run : end_run + 1] - first),
        curve=_pieces(problem.curve, first, end),
        tip_speed=_squares(problem.tip_speed, first, end),
        way_speed=_squares(problem.way_speed, first, end),
        tip_curve=None if problem.tip_curve is None else _pieces(problem.tip_curve, first, end),
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


def _pieces(curve: Any, first: int, end: int) -> Pieces:
    own = slice(int(curve.offsets[first]), int(curve.offsets[end]))
    return Pieces(
        curve.control_points[own],
        None if curve.weights is None else curve.weights[own],
        curve.offsets[first : end + 1] - curve.offsets[first],
        curve.width[first:end],
    )


def _squares(speed: Any, first: int, end: int) -> Squares | None:
    if speed is None:
        return None
    own = slice(int(speed.offsets[first]), int(speed.offsets[end]))
    return Squares(speed.coefficients[own], speed.offsets[first : end + 1] - speed.offsets[first])


def part_of_profile(profile: SpeedProfile, part: Part) -> PartOfProfile:
    """The arcs of a part."""
    arcs = slice(int(profile.runs[part.run]), int(profile.runs[part.end_run]))
    others = {name: getattr(profile, name)[arcs] for name in PartOfProfile.__dataclass_fields__}
    return PartOfProfile(**{**others, "piece": profile.piece[arcs] - np.uint32(part.first)})


def joined(own: Sequence[Part], planned: Sequence[Any]) -> SpeedProfile:
    """The profile of the whole from those of the parts, as `plan_jerk_limited` gives them."""
    columns: list[list[NDArray[Any]]] = [[] for _ in range(14)]
    arcs = 0
    for part, (profile, changes, _) in zip(own, planned, strict=True):
        for number, column in enumerate((*profile, *changes)):
            if number in _OF_PIECES:
                column = column + np.uint32(part.first)
            elif number == _RUNS:
                column = column[1 if columns[_RUNS] else 0 :] + arcs
            columns[number].append(column)
        arcs += len(profile[0])
    ends = [end for _, _, end in planned]
    whole: Any = [np.concatenate(column) for column in columns]
    stopped, excess = zip(*ends, strict=True)
    return replace(SpeedProfile(*whole), stopped=any(stopped), excess=math.fsum(np.concatenate(excess)))


# Columns of profiles that name pieces (`piece`, `slowed`, `kinked`), and their offsets of runs.
_OF_PIECES, _RUNS = (0, 10, 13), 9


def fault_of(part: Part, told: tuple[Any, ...]) -> PlanError:
    """A fault of a part, as one of the whole."""
    kind, piece, reachable, sentence = told
    return PlanError(kind, None if piece is None else piece + part.first, reachable, sentence)

"""Finds a faster path within the tolerance: it is fitted to the speed of a plan, and used where it is faster.

A path that is fitted without knowing the speed distributes each bend evenly. A path that is fitted to the
speed of a plan bends where the tool is slow and is smooth where it is fast. Later fits start from the best
path and take a step along the gradient of its least time (`refit`). At stops that both paths have, the tool
rests at the same places, so each section between two of them can follow the path on which it takes less time.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InfeasibleError, SolverError
from feedplan.geometry.path import Path
from feedplan.geometry.rules import Motion
from feedplan.path_gradient import path_gradient
from feedplan.profile import SpeedProfile, joined_runs
from feedplan.refit import FitLimits, along_gradient, at_speed_of, promise

# The greatest number of rounds: later ones save hardly any time.
MAX_ROUNDS = 3
# A path is fitted again only if some run takes longer, by more than this share, than it would at the feed and
# the axes' greatest speeds.
_WORTH_TRYING = 1e-3
# Times of a section that differ by less than this share count as equal (rounding).
_ROUNDING = 1e-9
# A step along the gradient is planned only if its predicted saving exceeds this share of the time.
_PROMISING = 1e-5
# Where a step does not save time, the next step is shorter by this factor.
_SHORTER = 0.3


@dataclass(frozen=True, eq=False)
class Followed:
    """A path, the problem along it and a speed profile for it."""

    path: Path
    problem: Problem
    profile: SpeedProfile

    @property
    def time(self) -> float:
        """Time of the program, pauses included [s]."""
        return self.profile.time + self.path.pauses


@dataclass(frozen=True)
class Gain:
    """The time saved by paths that are fitted to the speed.

    `times` [s]: along the first path, and after each round; `promised` [s]: the predicted saving of each step
    along the gradient, and of one more step; `sections`: number of sections between the stops that both paths
    of the last round have; `faster`: number of sections in which the new path was faster.
    """

    times: tuple[float, ...]
    promised: tuple[float, ...]
    sections: int
    faster: int

    @property
    def gained(self) -> float:
        """Time saved [s]."""
        return self.times[0] - self.times[-1]

    def to_json(self) -> dict[str, Any]:
        """The numbers by name, as in plan.json."""
        return {**asdict(self), "gained": self.gained}


def faster(
    first: Followed,
    limits: FitLimits,
    fit: Callable[[Motion], Path],
    follow: Callable[[Path], Followed],
    join: Callable[[Path], Problem],
    rounds: int,
) -> tuple[Followed, Gain]:
    """The first plan, with each section on the path on which it takes least time.

    The first of the `rounds` fits a path to the speed of the first plan; each later round goes a step along
    the gradient from the best path, or, where the joints are not the path's axes, fits to the speed of the
    best plan. `fit` makes a path for a motion, `follow` plans it, and `join` makes the problem along a path.
    """
    best, times, promised = first, [first.time], list[float]()
    sections, count, stopped = _Sections(first.path, first.path), 0, first.profile.stopped
    # The length of the next step for each move.
    step = np.ones(int(first.path.move.max()) + 1)
    # Where no plan is found along a new path, the best one so far is kept.
    with suppress(InfeasibleError, SolverError):
        # After the last round, one more turn only computes the predicted saving of one more step.
        for turn in range(rounds + (rounds > 1)):
            if stopped or not (_excess(best) > _WORTH_TRYING).any():
                break
            stepping = turn > 0 and best.problem.joints is None
            if stepping:
                path, saving = _stepped(best, limits, step, fit)
                promised.append(saving)
                if saving < _PROMISING * best.time:
                    break
            elif turn < rounds:
                path = fit(at_speed_of(best.problem, best.profile, limits))
            if turn == rounds:
                break
            other = follow(path)
            # The time limit is for all plans.
            stopped = other.profile.stopped
            sections = _Sections(best.path, other.path)
            before, after = (
                _sums(each.profile.run_times, runs)
                for each, runs in zip((best, other), sections.runs, strict=True)
            )
            better: Flags = after < (1.0 - _ROUNDING) * before
            count = int(better.sum())
            if count:
                best = other if better.all() else _joined(best, other, sections, better, join)
            if stepping:
                step[~better[np.searchsorted(sections.last, np.arange(len(step)))]] *= _SHORTER
            times.append(best.time)
    return best, Gain(tuple(times), tuple(promised), len(sections), count)


def _stepped(
    best: Followed, limits: FitLimits, step: Floats, fit: Callable[[Motion], Path]
) -> tuple[Path, float]:
    """The path after a step along the gradient from the best path, and its predicted saving [s]."""
    along, gradient = best.problem.path, path_gradient(best.problem, best.profile, limits.jerk)
    length = step[along.move[gradient.piece, 0]]
    path = fit(along_gradient(along, gradient, limits, length))
    return path, promise(gradient, along, path, _Sections(along, path).runs, limits, length)


class _Sections:
    """The sections between the stops that two paths of one program both have: `runs` are their offsets in the
    runs of both paths, `last` is the last move of each section."""

    def __init__(self, first: Path, other: Path) -> None:
        ends = [_stops(path) for path in (first, other)]
        common = np.intersect1d(ends[0], ends[1])
        self.last = np.append(common, first.move.max())
        self.runs = [
            np.concatenate(
                [[0], np.searchsorted(_last_moves(path), common, side="right"), [len(path.runs) - 1]]
            )
            for path in (first, other)
        ]

    def __len__(self) -> int:
        return len(self.runs[0]) - 1


def _last_moves(path: Path) -> Integers:
    """The last move of each run."""
    return np.asarray(path.move[path.runs[1:] - 1, 1])


def _stops(path: Path) -> Integers:
    """The moves at whose ends the tool stops, except the last move; stops within a move are ignored."""
    last, after = _last_moves(path)[:-1], path.move[path.runs[1:-1], 0]
    return np.asarray(last[after > last])


def _sums(values: Floats, offsets: Integers) -> Floats:
    return np.add.reduceat(values, offsets[:-1])


def _excess(followed: Followed) -> Floats:
    """(time of each run) / (its time at the feed and the axes' greatest speeds) − 1."""
    problem, path = followed.problem, followed.problem.path
    control, offsets = path.curve.control_points, path.curve.offsets
    way = np.abs(control[offsets[1:] - 1] - control[offsets[:-1]])
    least = path.width / problem.feed
    if not problem.words:
        least = np.maximum(least, (way / problem.limits("velocity").max(axis=0)).max(axis=1))
    return np.asarray(followed.profile.run_times / np.maximum(_sums(least, path.runs), 1e-300) - 1.0)


def _joined(
    first: Followed,
    other: Followed,
    sections: _Sections,
    better: Flags,
    join: Callable[[Path], Problem],
) -> Followed:
    """The plan that takes each section from one of two plans: from `other` where it is `better`."""
    both = (first, other)
    changes = np.flatnonzero(np.diff(better)) + 1
    taken = [
        (both[which], slice(int(sections.runs[which][begin]), int(sections.runs[which][end])))
        for begin, end in pairwise([0, *changes.tolist(), len(better)])
        for which in [int(better[begin])]
    ]
    if (first.path.group_feed is None) == (other.path.group_feed is None):
        path = _joined_path([(each.path, own) for each, own in taken], first.path, other.path)
        problem = join(path)
        pieces = [_pieces(each.problem.path, own) for each, own in taken]
        ends = np.cumsum([own.stop - own.start for own in pieces])
        if len(problem.path) == ends[-1]:
            moved = (
                (each.profile, runs, int(end - own.stop))
                for (each, runs), own, end in zip(taken, pieces, ends, strict=True)
            )
            bounds = np.concatenate([each.profile.run_bounds[runs] for each, runs in taken])
            excess = max(each.profile.excess for each, _ in taken)
            return Followed(path, problem, joined_runs(moved, excess=excess, run_bounds=bounds))
    # Feeds or joints divide the joined path into other pieces: the faster plan is used as a whole.
    return min(both, key=lambda each: each.time)


def _pieces(path: Path, runs: slice) -> slice:
    """The range of the pieces of a range of runs."""
    return slice(int(path.runs[runs.start]), int(path.runs[runs.stop]))


def _joined_path(taken: list[tuple[Path, slice]], first: Path, other: Path) -> Path:
    """A path from runs of two paths, in order."""
    pieces = [(path, _pieces(path, runs)) for path, runs in taken]

    def columns(rows: list[tuple[Path, slice]], *names: str) -> dict[str, Any]:
        known = [name for name in names if getattr(first, name) is not None]
        return {name: np.concatenate([getattr(path, name)[own] for path, own in rows]) for name in known}

    return replace(
        other,
        curve=CompositeCurve.joined([path.curve[own] for path, own in pieces]),
        **columns(pieces, "feed", "group_feed", "move", "line", "tolerance"),
        **columns(taken, "dwell", "coordinate_mode", "tool_length", "new_words"),
        runs=np.cumsum(np.concatenate([[0], *(np.diff(path.runs)[own] for path, own in taken)])),
        fit=replace(
            other.fit,
            deviation=max(first.fit.deviation, other.fit.deviation),
            inside=max(first.fit.inside or 0.0, other.fit.inside or 0.0),
            outside=max(first.fit.outside or 0.0, other.fit.outside or 0.0),
        ),
        warnings=tuple(dict.fromkeys(first.warnings + other.warnings)),
    )

"""Makes the motions that a path is fitted to: that of a plan, and one along the gradient of its least time.

The fit minimises the energy of `solvers/path/src/smooth_fit/pace.rs`: the squared differences of the second
and third derivatives from their target values, weighted by u̇³/A² and u̇⁵/J². Without a gradient the targets
are 0. For a step along the gradient, the targets are the derivatives of the path minus `step` × gradient /
weight: the energy then equals the change of the time to first order, plus half the weighted square of the
step / `step`, which replaces the second-order term.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from feedplan.arrays import Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.geometry.path import Path
from feedplan.geometry.rules import Motion
from feedplan.path_gradient import PathGradient
from feedplan.profile import SpeedProfile

# The speed counts as at least this share of the greatest speed of its run: a place where one plan stops need
# not be a stop in the next.
LEAST_SPEED = 0.25


@dataclass(frozen=True, eq=False)
class FitLimits:
    """The greatest `acceleration` [mm/s²] and `jerk` [mm/s³] of the axes of a path (axes,).

    The jerk is infinite where the plan has no jerk limit.
    """

    acceleration: Floats
    jerk: Floats


def at_speed_of(problem: Problem, profile: SpeedProfile, limits: FitLimits) -> Motion:
    """The motion of a plan, with the target 0 for all derivatives."""
    path = problem.path
    ends = np.searchsorted(profile.piece, path.runs)
    # The places are the starts of all phases, and the end of the last phase of each run.
    piece = np.insert(profile.piece.astype(np.int64), ends[1:], path.runs[1:] - 1)
    u = np.insert(profile.u0, ends[1:], path.width[path.runs[1:] - 1])
    p = np.insert(profile.p0, ends[1:], profile.p1[ends[1:] - 1])
    finite = np.isfinite(p)
    p = np.where(finite, p, p[finite].max(initial=0.0))
    # If one move ends and the next begins at rest within a run, the path goes back along its own line there.
    start = np.searchsorted(profile.piece, np.arange(1, len(path)))
    rests = 1 + np.flatnonzero((path.move[1:, 0] > path.move[:-1, 1]) & (profile.p0[start] == 0.0))
    nothing = np.zeros((len(piece), len(limits.jerk)))
    return _motion(path, np.union1d(path.runs, rests), piece, u, p, nothing, nothing, limits)


def along_gradient(path: Path, at: PathGradient, limits: FitLimits, step: Floats) -> Motion:
    """The motion of a plan, with the derivatives of its path after a step along the gradient as targets;
    `step` (m,) is the length of the step at each place."""
    second_weight, third_weight = _weights(path, at, limits)
    second = at.second - step[:, None] * at.by_second / second_weight
    # Without jerk limits the third derivatives have no weight.
    third = at.third - step[:, None] * at.by_third / np.where(third_weight > 0.0, third_weight, 1.0)
    return _motion(path, path.runs, at.piece, at.u, at.p, second, third, limits)


def promise(
    at: PathGradient, path: Path, other: Path, runs: list[Integers], limits: FitLimits, step: Floats
) -> float:
    """The predicted saving [s], to second order, of the other path on the sections where it is faster.

    `runs` are the offsets of the sections in both paths.
    """
    begin, of_other = (np.concatenate([[0.0], np.cumsum(each.width)]) for each in (path, other))
    place = np.interp(begin[at.piece] + at.u, begin[path.runs[runs[0]]], of_other[other.runs[runs[1]]])
    piece = np.clip(np.searchsorted(of_other, place, side="right") - 1, 0, len(other) - 1)
    u = np.clip(place - of_other[piece], 0.0, other.width[piece])
    _, _, second, third = other.curve.evaluate(piece, u, 3)
    saved = np.zeros(len(place))
    of_orders = (second - at.second, at.by_second), (third - at.third, at.by_third)
    for weight, (change, by) in zip(_weights(path, at, limits), of_orders, strict=True):
        saved -= (at.width[:, None] * (by * change + 0.5 / step[:, None] * weight * change**2)).sum(axis=1)
    first = np.searchsorted(at.piece, path.runs[runs[0][:-1]])
    return float(np.maximum(np.add.reduceat(saved, first), 0.0).sum())


def _weights(path: Path, at: PathGradient, limits: FitLimits) -> tuple[Floats, Floats]:
    """The weights u̇³/A² and u̇⁵/J² (m, axes), with the speed by `_counted`."""
    p = _counted(at.p, np.searchsorted(at.piece, path.runs))[:, None]
    return p**1.5 / limits.acceleration**2, p**2.5 / limits.jerk**2


def _counted(p: Floats, start: Integers) -> Floats:
    """p, at least LEAST_SPEED² of the greatest p of its run; `start` (r + 1,) are the offsets of the runs."""
    greatest = np.maximum.reduceat(p, start[:-1])
    return np.maximum(p, LEAST_SPEED**2 * np.repeat(greatest, np.diff(start)))


def _motion(
    path: Path,
    runs: Integers,
    piece: Integers,
    u: Floats,
    p: Floats,
    second: Floats,
    third: Floats,
    limits: FitLimits,
) -> Motion:
    begin, start = np.concatenate([[0.0], np.cumsum(path.width)]), np.searchsorted(piece, runs)
    run = np.repeat(np.arange(len(runs) - 1), np.diff(start))
    part = (begin[piece] + u - begin[runs[run]]) / np.diff(begin[runs])[run]
    return Motion(
        run=np.stack([path.move[runs[:-1], 0], path.move[runs[1:] - 1, 1]], axis=1),
        start=start,
        place=np.clip(part, 0.0, 1.0),
        speed_sq=_counted(p, start),
        second=second,
        third=third,
        max_jerk=limits.jerk,
    )

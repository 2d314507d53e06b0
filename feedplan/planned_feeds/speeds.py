"""Computes the greatest planned speed in each move of a program, along the axes that its feed counts along.

Each move owns the part of the path that is nearest to it. A piece that follows two moves, such as the blend
of a corner, belongs to both, because both feeds hold on all of it. A piece that follows more moves, such as a
fitted piece, is cut at the places nearest to the ends of the moves, where a change of feed would also cut it.
A move shorter than twice the tolerance may have the same nearest place for both ends: all pieces that follow
it belong to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from feedplan.arrays import Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.event_places import nearest
from feedplan.geometry.feed_groups import GROUPS, feed_groups, leading_group
from feedplan.machine.axis import DIRECTION
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program

# Fractions of each phase of the profile at which the speed is evaluated, besides its ends.
_WITHIN = (0.25, 0.5, 0.75)


@dataclass(frozen=True, eq=False)
class SpeedsAlong:
    """Speeds at places in the order of the path: `piece` (k,), `u` (k,), `speed` (k, 3) along X, Y, Z, along
    U, V, W [mm/s] and along all other axes [deg/s]. The places of move m are `first[m]` to `last[m]`, both
    included; `first` > `last` where no piece follows it. `group` (m,) is the index of the speed that its feed
    counts along, −1 where it moves nothing."""

    piece: Integers
    u: Floats
    speed: Floats
    first: Integers
    last: Integers
    group: Integers

    def of(self, move: int) -> Floats:
        """The speeds in a move along the axes of its feed."""
        return self.speed[self.first[move] : self.last[move] + 1, self.group[move]]

    def greatest(self) -> Floats:
        """The greatest planned speed in each move (m,); NaN for a move that no piece follows."""
        greatest = np.full(len(self.first), np.nan)
        own = np.flatnonzero((self.first <= self.last) & (self.group >= 0))
        for group in np.unique(self.group[own]):
            moves = own[self.group[own] == group]
            ends = np.stack([self.first[moves], self.last[moves] + 1], axis=1).ravel()
            speed = np.append(self.speed[:, group], -np.inf)
            greatest[moves] = np.maximum.reduceat(speed, ends)[::2]
        return greatest


def speeds_along(problem: Problem, profile: SpeedProfile, program: Program) -> SpeedsAlong:
    """The planned speeds at the ends of all phases and moves, and at places between them."""
    path = problem.path
    program = program.along(path.axes)
    begins, ends = _ends_of_moves(problem, program)
    within = [profile.u0 + share * (profile.u1 - profile.u0) for share in _WITHIN]
    columns = [profile.u0, *within, profile.u1]
    piece = np.concatenate([np.repeat(profile.piece, len(columns)), begins[0], ends[0]]).astype(np.int64)
    u = np.concatenate([np.stack(columns, axis=1).ravel(), begins[1], ends[1]])
    order = np.lexsort((u, piece))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    count = len(program)
    # Places equal to an end of a move belong to that move.
    first, last = rank[len(piece) - 2 * count : len(piece) - count], rank[len(piece) - count :]
    piece, u = piece[order], u[order]
    return SpeedsAlong(
        piece,
        u,
        speeds_at(problem, profile, piece, u)[0],
        first,
        np.where(begins[0] > ends[0], first - 1, last),
        leading_group(path.axes, program.moving()),
    )


def _ends_of_moves(
    problem: Problem, program: Program
) -> tuple[tuple[Integers, Floats], tuple[Integers, Floats]]:
    """The places where the path of each move begins and ends: pieces (m,) and parameters (m,)."""
    path = problem.path
    first, last = np.maximum.accumulate(path.move[:, 0]), np.maximum.accumulate(path.move[:, 1])
    moves = np.arange(len(program))
    begin = np.minimum(np.searchsorted(last, moves, side="left"), len(path) - 1)
    end = np.maximum(np.searchsorted(first, moves, side="right") - 1, 0)
    shared = last - first > 1
    u_begin, u_end = np.zeros(len(moves)), path.width[end].copy()
    ends = shared[end] & (last[end] > moves)
    u_end[ends] = nearest(path, program.target[ends], end[ends], end[ends] + 1)[1]
    begins = shared[begin] & (first[begin] < moves)
    # Usually the move before ends at the same place, which then is not searched again.
    same = begins & np.append(False, ends[:-1] & (end[:-1] == begin[1:]))
    u_begin[same] = u_end[:-1][same[1:]]
    begins &= ~same
    u_begin[begins] = nearest(path, program.starts()[begins], begin[begins], begin[begins] + 1)[1]
    length = np.linalg.norm(program.target - program.starts(), axis=1)
    whole = shared[begin] & shared[end] & (length <= 2.0 * path.tolerance[begin])
    u_begin, u_end = np.where(whole, 0.0, u_begin), np.where(whole, path.width[end], u_end)
    return (begin, u_begin), (end, np.where((begin == end) & (u_end < u_begin), u_begin, u_end))


def speeds_at(problem: Problem, profile: SpeedProfile, piece: Integers, u: Floats) -> tuple[Floats, Floats]:
    """The planned speed along each group of axes (k, 3) at places (k,), and the time at which the tool is
    there (k,) [s].

    Speeds are 0 where the curve's tangent vector is 0.
    """
    path = problem.path
    time, _, velocity, *_ = profile.sampler(problem).along(piece.astype(np.uint32), u)
    slope = problem.curve.evaluate(piece, u, 1)[1]
    square = (slope**2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.sqrt((velocity**2).sum(axis=1) / square)
    rate = np.where(np.isfinite(rate), rate, 0.0)
    if problem.joints is None:
        return np.sqrt((slope**2) @ feed_groups(path.axes).T) * rate[:, None], time
    place, words = path.curve.evaluate(piece, u, 1)
    squares = (words**2) @ (feed_groups(path.axes) & ~np.isin(path.axes, DIRECTION)).T
    if set(DIRECTION) <= set(path.axes):
        columns = [path.axes.index(name) for name in DIRECTION]
        vector, change = place[:, columns], words[:, columns]
        length = np.linalg.norm(vector, axis=1)
        # A direction turns at the rate |component of its derivative across it| / |direction|.
        across = np.linalg.norm(np.cross(vector, change), axis=1) / np.where(length > 0.0, length, 1.0) ** 2
        squares[:, GROUPS - 1] += np.degrees(across) ** 2
    return np.sqrt(squares) * rate[:, None], time

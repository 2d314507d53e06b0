"""Splits lines and arcs where the planned speed varies by more than a step, so that the F of each part is
close to the plan.

A cut is at a place where the path follows only one move, at least twice as far from the ends of the move as
the blends of its corners reach: so the blends do not change. The parts are lines, or arcs about the same
centre, with ends on the move: the geometry does not change.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from feedplan.arrays import Flags, Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.errors import InputError
from feedplan.planned_feeds.speeds import SpeedsAlong, speeds_at
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program

# The least duration of a part in servo periods: a control needs time for each block.
_LEAST_PERIODS = 10
# Number of samples of the speed in one step.
_WITHIN_STEP = 4
# The greatest number of samples of a program: about 20 GB.
_MOST_SAMPLES = 100_000_000
# The least turn of a part of an arc [rad] (a smaller one could be read as a full turn), and the greatest.
_LEAST_TURN, _GREATEST_TURN = 1e-4, math.pi


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of a move: `ends` (k, axes) [mm, deg] in the program's axes, the last one the end of the
    move; `shares` (k,) of the move up to each end; `speed` (k,) the greatest planned speed in each part
    [mm/s, deg/s]."""

    ends: Floats
    shares: Floats
    speed: Floats

    def __len__(self) -> int:
        return len(self.ends)


def parts_of(
    problem: Problem,
    profile: SpeedProfile,
    program: Program,
    along: SpeedsAlong,
    candidates: Integers,
    step: float,
) -> dict[int, Parts]:
    """The parts of those `candidates` (moves) whose planned speed varies by more than `step` [mm/s].

    Raises InputError for a step that is so small that there would be too many samples.
    """
    moves = [
        m
        for m in candidates.tolist()
        if along.group[m] >= 0 and along.first[m] < along.last[m] and np.ptp(along.of(m)) > step
    ]
    if not moves:
        return {}
    samples = _samples(problem, profile, along, moves, step)
    motion_of = motions(program)
    columns = [program.axes.index(name) for name in problem.path.axes]
    found: dict[int, Parts] = {}
    for m, (point, speed, time, free) in zip(moves, samples, strict=True):
        motion = motion_of(m)
        there = np.tile(motion.start, (len(point), 1))
        there[:, columns] = point
        share = motion.shares(there)
        if not free.any():
            continue
        near, far = share[free].min(), share[free].max()
        free &= (share >= 2.0 * near) & (share <= 2.0 * far - 1.0) & (share > 0.0) & (share < 1.0)
        cuts = _cuts(speed, time, free, step, _LEAST_PERIODS * problem.period)
        edges = [0.0, *share[cuts], 1.0]
        turns = np.abs(np.diff(edges) * motion.turn)
        if not cuts or (np.diff(edges) <= 0.0).any() or (motion.turn and turns.min() < _LEAST_TURN):
            continue
        # The sample at a cut belongs to both parts.
        bounds = [0, *cuts, len(speed) - 1]
        tops = [float(speed[a : b + 1].max()) for a, b in pairwise(bounds)]
        # An arc of more than half a turn is divided equally.
        counts = np.maximum(np.ceil(turns / _GREATEST_TURN), 1).astype(int)
        shares = np.concatenate(
            [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(edges[:-1], edges[1:], counts, strict=True)]
        )
        ends = np.array([*(motion.at(value) for value in shares[:-1]), program.target[m]])
        found[m] = Parts(ends, shares, np.repeat(tops, counts))
    return found


def _cuts(speed: Floats, time: Floats, free: Flags, step: float, least: float) -> list[int]:
    """Indices of samples at which to cut, so that the speed varies by at most about a step and each part
    takes at least `least` [s]."""
    cuts: list[int] = []
    values, clock, may = speed.tolist(), time.tolist(), free.tolist()
    low = high = values[0]
    begin = clock[0]
    for k in range(1, len(values)):
        low, high = min(low, values[k]), max(high, values[k])
        late = clock[k - 1] - begin >= least and clock[-1] - clock[k - 1] >= least
        if high - low > step and may[k - 1] and late:
            cuts.append(k - 1)
            begin = clock[k - 1]
            low, high = min(values[k - 1], values[k]), max(values[k - 1], values[k])
    return cuts


def _samples(
    problem: Problem, profile: SpeedProfile, along: SpeedsAlong, moves: list[int], step: float
) -> list[tuple[Floats, Floats, Floats, Flags]]:
    """Samples of each move in order: points, speeds, times, and whether the path follows only this move."""
    pieces, parameters, sizes = [], [], []
    varied = sum(float(np.abs(np.diff(along.of(m))).sum()) for m in moves)
    if _WITHIN_STEP * varied > _MOST_SAMPLES * step:
        least = _WITHIN_STEP * varied / _MOST_SAMPLES
        raise InputError(
            f"feed_step is {step:g} mm/s, and the speeds of the program vary by {varied:.4g} mm/s in all: "
            f"give one from {float(f'{1.05 * least:.1g}'):g} mm/s"
        )
    for m in moves:
        places = slice(int(along.first[m]), int(along.last[m]) + 1)
        piece, u, speed = along.piece[places], along.u[places], along.of(m)
        # Between two samples the speed changes by less than a step; its square is nearly linear in u.
        counts = np.where(piece[1:] == piece[:-1], np.ceil(_WITHIN_STEP * np.abs(np.diff(speed)) / step), 1)
        counts = np.maximum(counts, 1).astype(np.int64)
        owner = np.repeat(np.arange(len(counts)), counts)
        level = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[owner]
        first, last = speed[owner], speed[owner + 1]
        wanted = first + level * (last - first)
        apart = last**2 - first**2
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(apart == 0.0, level, (wanted**2 - first**2) / apart)
        pieces.append(np.append(piece[owner], piece[-1]))
        parameters.append(np.append(u[owner] + share * np.where(counts > 1, np.diff(u), 0.0)[owner], u[-1]))
        sizes.append(len(owner) + 1)
    piece, u = np.concatenate(pieces), np.concatenate(parameters)
    speed, time = speeds_at(problem, profile, piece, u)
    point = problem.path.curve.evaluate(piece, u)[0]
    alone = (problem.path.move[:, 0] == problem.path.move[:, 1])[piece]
    group = np.repeat(along.group[moves], sizes)
    own = np.take_along_axis(speed, group[:, None], axis=1)[:, 0]
    ends = np.cumsum(sizes)[:-1]
    return list(zip(*(np.split(column, ends) for column in (point, own, time, alone)), strict=True))


def motions(program: Program) -> Callable[[int], Motion]:
    """Returns a function that makes the motion of a line or an arc from its index."""
    starts, arcs = program.starts(), {int(m): row for row, m in enumerate(program.arc_move)}
    return lambda m: Motion(program, m, starts[m], arcs.get(m))


class Motion:
    """A line or an arc of a program: positions as a function of the finished share of it."""

    def __init__(self, program: Program, move: int, start: Floats, arc: int | None) -> None:
        self.start, self._way = start, program.target[move] - start
        self.turn, self.plane, self.centre = 0.0, [], np.empty(0)
        if arc is None:
            return
        self.turn = float(program.arc_angle[arc])
        normal = int(program.arc_normal[arc])
        letters = ["XYZ"[(normal + 1) % 3], "XYZ"[(normal + 2) % 3]]
        self.plane = [program.axes.index(letter) for letter in letters]
        self.normal = program.axes.index("XYZ"[normal])
        self.centre = program.arc_centre[arc][[(normal + 1) % 3, (normal + 2) % 3]]
        spoke, last = start[self.plane] - self.centre, program.target[move][self.plane] - self.centre
        self._angle = math.atan2(spoke[1], spoke[0])
        self._radii = math.hypot(*spoke), math.hypot(*last)

    def at(self, share: float) -> Floats:
        """The position (axes,) at a share of the motion."""
        place = self.start + share * self._way
        if self.turn:
            angle, (first, last) = self._angle + share * self.turn, self._radii
            radius = first + share * (last - first)
            place[self.plane] = self.centre + radius * np.array([math.cos(angle), math.sin(angle)])
        return np.asarray(place)

    def shares(self, points: Floats) -> Floats:
        """The shares (n,) of the motion at the positions nearest to `points` (n, axes), which are in the
        order of the motion."""
        if not self.turn:
            return np.asarray((points - self.start) @ self._way / (self._way @ self._way))
        spokes = points[:, self.plane] - self.centre
        angles = np.unwrap(np.arctan2(spokes[:, 1], spokes[:, 0]))
        begin = self._angle + math.tau * round((angles[0] - self._angle) / math.tau)
        return np.asarray((angles - begin) / self.turn)

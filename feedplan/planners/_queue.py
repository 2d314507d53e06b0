"""The blocks that a controller knows ahead of the tool, and the controller's own limits along the path.

Controllers hold a number of blocks (also the lines into which arcs are divided), and must be able to stop at
the end of the last one. If the blocks after the one in motion have lengths L and accelerations a, the speed
at the end of the one in motion is limited to v² ≤ Σ 2 a L (grbl, `planner.c`: the last block is planned to a
stop; LinuxCNC, `tp.c`: `tpRunOptimization` goes back by ARC_BLEND_OPTIMIZATION_DEPTH segments).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from feedplan._solvers import look_ahead as native_look_ahead
from feedplan.arguments import number, positive
from feedplan.arrays import Floats, Integers
from feedplan.planners._segments import Segments


@dataclass(frozen=True)
class Chords:
    """How arcs are divided into lines: `tolerance` [mm] from the arc, or of `length` [mm] each."""

    tolerance: float | None = None
    length: float | None = None

    # The direction turns by at most a right angle from chord to chord.
    _HALF_TURN = 0.25 * math.pi

    def half_turn(self, radius: Floats) -> Floats:
        """Half the angle [rad] of a chord on a circle of `radius` (m,) [mm]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.tolerance is not None:
                half = 2.0 * np.arcsin(np.minimum(np.sqrt(0.5 * self.tolerance / radius), 1.0))
            else:
                half = 0.5 * float(self.length or 0.0) / radius
        return np.minimum(half, self._HALF_TURN)

    def count(self, parts: Segments) -> Floats:
        """The number of chords of each part (m,), not rounded; 1 on a line, 0 on parts of curves without
        curvature."""
        bent = np.isfinite(parts.radius)
        each = np.full(len(parts), np.inf)
        each[bent] = 2.0 * parts.radius[bent] * self.half_turn(parts.radius[bent])
        return np.where(bent, parts.length / each, np.where(np.isnan(parts.rate), 0.0, 1.0))


@dataclass(frozen=True)
class Queue:
    """The blocks that a controller knows, and its limits along the path.

    `ahead`: number of blocks known after the one in motion (None: all). `chords` divides curves into blocks;
    without it a whole piece is a block. `velocity` [mm/s] and `acceleration` [mm/s²] are the greatest along
    the path. `part` (pieces,) is the share of the acceleration along the path that each piece may use (None:
    all of it). `least_time` [s]: the least duration of a block of the program. `cruise`: the share of the
    distance between speeding up and slowing down that has constant speed (Klipper's minimum_cruise_ratio).
    """

    ahead: int | None = None
    chords: Chords | None = None
    velocity: float = math.inf
    acceleration: float = math.inf
    least_time: float = 0.0
    cruise: float = 0.0
    part: Floats | None = None

    def limited(self, parts: Segments, block: Integers) -> Segments:
        """The segments with speeds lowered by `least_time` and accelerations lowered by `part`; `block`
        (pieces,) is the block that each piece belongs to."""
        if self.part is not None:
            share = self.part[parts.piece]
            parts = replace(parts, slope=share * parts.slope, value=share * parts.value)
        if self.least_time == 0.0:
            return parts
        own = block[parts.piece]
        length = np.bincount(own, parts.length)[own]
        return replace(parts, speed=np.minimum(parts.speed, length / self.least_time))

    def known(self, parts: Segments, at_end: Floats) -> tuple[Segments, Floats]:
        """Segments and speeds at their ends (m + 1,) [mm/s] with which the tool can stop within known
        blocks."""
        gain = parts.slope * (parts.u1 - parts.u0)
        braking = gain[1]
        if self.ahead is not None:
            block = np.concatenate([[0.0], np.cumsum(self._blocks(parts))])
            reach = np.concatenate([[0.0], np.cumsum(braking)])
            seen = block + min(self.ahead, math.ceil(block[-1]))
            room = np.where(seen < block[-1], np.interp(seen, block, reach) - reach, np.inf)
            at_end = np.minimum(at_end, np.sqrt(room))
        if self.cruise > 0.0:
            parts = replace(parts, speed=np.minimum(parts.speed, self._smoothed(gain, at_end)))
            at_end = at_end.copy()
            at_end[:-1] = np.minimum(at_end[:-1], parts.speed)
            at_end[1:] = np.minimum(at_end[1:], parts.speed)
        return parts, at_end

    def _blocks(self, parts: Segments) -> Floats:
        """The number of blocks of each part (m,): whole numbers for whole pieces."""
        share = 1.0 / np.bincount(parts.piece)[parts.piece]
        if self.chords is None:
            return share
        count = self.chords.count(parts)
        whole = np.bincount(parts.piece, count)
        wanted = np.maximum(np.ceil(whole * (1.0 - 1e-9)), 1.0)
        with np.errstate(invalid="ignore"):
            scaled = count * (wanted / whole)[parts.piece]
        return np.where((whole > 0.0)[parts.piece], scaled, share)

    def _smoothed(self, gain: Floats, at_end: Floats) -> Floats:
        """The greatest speed of each part (m,) [mm/s] that leaves room for a constant speed (`cruise`).

        Klipper (`toolhead.py`): with accelerations multiplied by 1 − cruise, each hill between two minima of
        the speed has a peak; this peak is the greatest speed in the hill.
        """
        up, down = (1.0 - self.cruise) * gain
        columns = (np.stack([way, 0.0 * way, 0.0 * way], axis=1) for way in (up, down))
        square = native_look_ahead(at_end, *columns) ** 2
        start, end = square[:-1], square[1:]
        rounding = 1e-9 * np.maximum(start, end)
        rises, falls = end >= start + up - rounding, start >= end + down - rounding
        phase = np.where(rises, 0, np.where(falls, 2, 1))
        before, after = phase[:-1], phase[1:]
        hill = np.flatnonzero(np.concatenate([[True], (after < before) | ((after == 1) & (before == 1))]))
        peak = np.maximum.reduceat((down * start + up * end + up * down) / (up + down), hill)
        return np.asarray(np.sqrt(np.repeat(peak, np.diff(np.append(hill, len(up))))))


def along_path(name: str, given: float | None, unit: str) -> float:
    """The greatest velocity or acceleration along the path; None: infinite. Raises InputError unless
    positive."""
    if given is None:
        return math.inf
    return number(given, f"the greatest {name} along the path", f"a positive number [{unit}]", positive, unit)

"""The speed of controllers at the corner between two lines, by the rules of Marlin, Klipper and others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Literal

import numpy as np

from feedplan.arrays import Floats
from feedplan.planners._segments import both_ways, in_direction

# The speed limit between short lines: none ("free"), by half of each line ("half", Klipper), or by the arc
# that they approximate ("arc", Marlin).
ShortLines = Literal["free", "half", "arc"]
# Marlin treats lines as chords of an arc if they are shorter than ARC_LENGTH [mm] and the cosine of the turn
# exceeds ARC_COSINE.
ARC_LENGTH, ARC_COSINE = 1.0, math.sqrt(0.5)


@dataclass(frozen=True)
class Junctions:
    """A controller's rule for corners: by `deviation` [mm], by `square_corner_velocity` [mm/s], or by the
    velocity jumps `axis_jumps` [mm/s] of the axes; `acceleration` [mm/s²] is the greatest along the path.
    """

    deviation: float
    square_corner_velocity: float | None = None
    axis_jumps: Sequence[float] | None = None
    short_lines: ShortLines = "free"
    acceleration: float = math.inf

    def square(self, into: Floats, out: Floats, before: Floats, after: Floats, limits: Floats) -> Floats:
        """The greatest v² (m,) [mm²/s²] from lines along `into` to lines along `out`, unit vectors (m, axes).

        `before` and `after` (m,) are the lengths of the lines [mm], `limits` (2, axes) the acceleration
        limits of the axes in positive and negative direction. The result is infinite where the direction does
        not change.
        """
        jump = out - into
        size = np.linalg.norm(jump, axis=1)
        # jump| = 2 sin(turn/2); the form 1 − s = sin²(turn/2)/(1 + s) is accurate at small turns.
        sine = np.minimum(0.5 * size, 1.0)
        along = np.minimum(
            reduce(np.minimum, [*both_ways(limits, into), *both_ways(limits, out)]), self.acceleration
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            across = np.minimum(in_direction(limits, jump / size[:, None]), self.acceleration)
            square = self._by_rule(sine, along, across, into, out)
            square = np.minimum(square, self._between_short_lines(sine, along, across, before, after))
        return np.where(size > 0.0, square, np.inf)

    def _by_rule(self, sine: Floats, along: Floats, across: Floats, into: Floats, out: Floats) -> Floats:
        if self.axis_jumps is not None:
            # For an axis that reverses, the greater of its two speeds counts.
            same = into * out > 0.0
            jumped = np.where(same, np.abs(out - into), np.maximum(np.abs(into), np.abs(out)))
            return np.asarray((np.array(self.axis_jumps) / jumped).min(axis=1) ** 2)
        factor = self.deviation * across
        if self.square_corner_velocity is not None:
            # Klipper converts square_corner_velocity to a deviation with the acceleration along the path, and
            # then uses the line's own acceleration.
            part = along / self.acceleration if math.isfinite(self.acceleration) else np.ones(len(along))
            factor = self.square_corner_velocity**2 * (math.sqrt(2.0) - 1.0) * part
        s = np.sqrt(1.0 - sine**2)
        return np.asarray(factor * s * (1.0 + s) / sine**2)

    def _between_short_lines(
        self, sine: Floats, along: Floats, across: Floats, before: Floats, after: Floats
    ) -> Floats:
        if self.short_lines == "half":
            return np.asarray(0.5 * along * np.minimum(before, after) * np.sqrt(1.0 - sine**2) / sine)
        if self.short_lines == "arc":
            bend = (after < ARC_LENGTH) & (1.0 - 2.0 * sine**2 > ARC_COSINE)
            return np.where(bend, 0.5 * across * after / np.arcsin(sine), np.inf)
        return np.full(len(sine), np.inf)

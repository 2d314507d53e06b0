"""The worst places found by checks made in numpy, in the form in which the native audit gives its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

# Name, axis (−1: none), worst value, limit, ratio, time, source line.
Finding = tuple[str, int, float, float, float, float, int]
Findings = tuple[list[Finding], int]


class Worst:
    """Keeps the worst place of every check."""

    def __init__(self) -> None:
        self.samples = 0
        self._found: dict[tuple[str, int], Finding] = {}

    def offer(
        self,
        name: str,
        value: ArrayLike,
        limit: ArrayLike,
        time: ArrayLike,
        line: ArrayLike,
        axis: int = -1,
    ) -> None:
        """Values at places, each with its limit. What is not a number is the worst there is."""
        values, limits, times, lines = (
            array.ravel() for array in np.broadcast_arrays(value, limit, time, line)
        )
        if not len(values):
            return
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(values <= 0.0, 0.0, values / limits)
        ratio = np.where(np.isnan(ratio), np.inf, ratio)
        worst = int(np.argmax(ratio))
        self.offer_ratio(
            name, max(float(values[worst]), 0.0), float(limits[worst]), float(ratio[worst]),
            float(times[worst]), int(lines[worst]), axis,
        )  # fmt: skip

    def offer_ratio(
        self, name: str, value: float, limit: float, ratio: float, time: float, line: int, axis: int = -1
    ) -> None:
        """One value whose ratio is not that to its limit."""
        known = self._found.get((name, axis))
        if known is None or ratio > known[4]:
            self._found[name, axis] = (name, axis, value, limit, ratio, time, line)

    def findings(self) -> Findings:
        """What was found, and how many samples were looked at."""
        return list(self._found.values()), self.samples

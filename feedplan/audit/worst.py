"""The worst places found by checks made in numpy, in the form in which the native audit gives its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats

# Name, axis (−1: none), worst value, limit, ratio, time, source line.
Finding = tuple[str, int, float, float, float, float, int]
# What was found, and the number of samples that were taken for it.
Findings = tuple[list[Finding], int]


class Worst:
    """Keeps the worst place of every check; it measures samples that the native audit has counted."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, int], Finding] = {}

    def offer(
        self, name: str, value: Floats, limit: Floats, time: Floats, line: NDArray[np.int32], axis: int
    ) -> None:
        """Values of an axis at places (n,), each with its limit. What is not a number is the worst there
        is."""
        if not len(value):
            return
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.where(value <= 0.0, 0.0, value / limit)
        ratios[np.isnan(ratios)] = np.inf
        worst = int(np.argmax(ratios))
        ratio, known = float(ratios[worst]), self._found.get((name, axis))
        if known is None or ratio > known[4]:
            place = float(limit[worst]), ratio, float(time[worst]), int(line[worst])
            self._found[name, axis] = (name, axis, max(float(value[worst]), 0.0), *place)

    def findings(self) -> Findings:
        """What was found."""
        return list(self._found.values()), 0

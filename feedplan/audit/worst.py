"""Collects the worst place of each check made in NumPy, in the same form as the native audit's findings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats

# Name, axis (−1: none), worst value, limit, ratio, time, source line.
Finding = tuple[str, int, float, float, float, float, int]
# The findings, and the number of samples that they come from.
Findings = tuple[list[Finding], int]


class Worst:
    """Keeps the worst place of every check; the native audit has counted the samples already."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, int], Finding] = {}

    def offer(
        self, name: str, value: Floats, limit: Floats, time: Floats, line: NDArray[np.int32], axis: int
    ) -> None:
        """Compares values of an axis at places (n,) with their limits; keeps the worst (NaN is worst)."""
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
        """The findings, with 0 samples."""
        return list(self._found.values()), 0

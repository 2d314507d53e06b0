"""Reduces millions of samples to the few thousand points of a chart; peaks and corners are kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import buckets, thin
from feedplan.arrays import Floats

Array = NDArray[Any]
# Columns that belong together.
Columns = tuple[Array, ...]


class Envelope:
    """The least and the greatest value of each bucket of consecutive samples, for several columns at once.

    `count` is the number of samples that `add` will get. At most about `points` points of each column are
    kept: both extremes of each bucket at their own x, so that no peak is lost. If there are fewer samples
    than `points`, all are kept.
    """

    def __init__(self, count: int, points: int) -> None:
        self._width = 1 if count <= points else -(-2 * count // points)
        self._rest: Columns = ()
        self._parts: list[Columns] = []
        self._means: list[tuple[Floats, Floats]] = []
        self._last: float | None = None
        self._done = 0

    def add(self, x: Floats, tag: NDArray[np.integer], *values: Floats) -> None:
        """Takes the next samples: `x` (n,), an integer tag for each, and `values`, each (n, columns)."""
        samples: Columns = (x, tag, *values)
        if self._rest:
            first, samples = _divided(samples, self._width - len(self._rest[0]))
            self._rest = _joined([self._rest, first])
            if len(self._rest[0]) < self._width:
                return
            self._keep(self._rest, self._width)
        whole, self._rest = _divided(samples, len(samples[0]) // self._width * self._width)
        self._keep(whole, self._width)

    def curve(self, column: int) -> tuple[Floats, Floats, NDArray[np.integer]]:
        """x, value and tag of the kept points of one column, in order."""
        self._finish()
        if not self._parts:
            return np.empty(0), np.empty(0), np.empty(0, np.int64)
        number, x, value, tag = (
            np.concatenate([part[i][column].ravel() for part in self._parts]) for i in range(4)
        )
        single = np.concatenate(([True], np.diff(number) != 0))
        return x[single], value[single], tag[single]

    def mean(self, column: int, points: int) -> tuple[Floats, Floats]:
        """x and mean of one column over at most `points` intervals of x, for curves that oscillate too fast
        to draw."""
        self._finish()
        if not self._means:
            return np.empty(0), np.empty(0)
        x = np.concatenate([part[0] for part in self._means])
        value = np.concatenate([part[1][column] for part in self._means])
        starts = np.arange(0, len(x), max(1, -(-len(x) // points)))
        sizes = np.diff(np.append(starts, len(x)))
        return np.add.reduceat(x, starts) / sizes, np.add.reduceat(value, starts) / sizes

    def _finish(self) -> None:
        if self._rest:
            self._keep(self._rest, len(self._rest[0]))
        self._rest = ()

    def _keep(self, samples: Columns, width: int) -> None:
        x, tag, *values = samples
        if len(x) == 0:
            return
        # The weight of a sample is its distance in x from the sample before; if all these distances are 0,
        # the weights are equal.
        before = x[0] if self._last is None else self._last
        weight = np.diff(x, prepend=before).reshape(-1, width)
        weight[weight.sum(axis=1) <= 0] = 1.0
        picks, sums = zip(*(buckets(table, weight.ravel(), width) for table in values), strict=True)
        pick = np.concatenate(picks)
        value = np.concatenate(
            [table[own, np.arange(len(own))[:, None, None]] for table, own in zip(values, picks, strict=True)]
        )
        self._parts.append((pick + self._done, x[pick], value, tag[pick]))
        self._means.append((x.reshape(-1, width).mean(axis=1), np.concatenate(sums) / weight.sum(axis=1)))
        self._last = float(x[-1])
        self._done += len(x)


class Polyline:
    """A polyline with few points that stays near the polyline of all samples; corners are kept.

    A point is removed if it lies, in all its columns, within the tolerance of the straight line between its
    neighbours. The distances of earlier removals are added, so that the tolerance holds for every sample. It
    starts at `tolerance` and doubles until at most `limit` points are left.
    """

    def __init__(self, limit: int, tolerance: float) -> None:
        self._limit = limit
        self.tolerance = tolerance
        # Points, the part of the tolerance that is already used between each point and the next, and tags.
        self._kept: Columns = ()
        self._pending: list[Columns] = []

    def add(self, points: Floats, *tags: Array) -> None:
        """Takes the next samples: `points` (n, 4), scaled so that one tolerance holds for all columns, and
        columns of their tags."""
        self._pending.append((points, np.zeros(len(points)), *tags))
        if sum(len(points) for points, *_ in self._pending) >= 2 * self._limit:
            self._settle()

    def result(self, limit: int | None = None, tolerance: float = 0.0) -> tuple[Floats, Columns, float]:
        """The kept points, their tags and the tolerance; reduced further to `limit` points or to a greater
        `tolerance`, if given."""
        self._settle()
        if not self._kept:
            return np.empty((0, 4)), (), self.tolerance
        kept, own = self._kept, self.tolerance
        if tolerance > own:
            kept, own = _thin(kept, tolerance), tolerance
        kept, own = _limited(kept, own, self._limit if limit is None else limit)
        return kept[0], kept[2:], own

    def _settle(self) -> None:
        if not self._pending:
            return
        new = _thin(_joined(self._pending), self.tolerance)
        kept = _thin(_joined([self._kept, new]), self.tolerance) if self._kept else new
        self._kept, self.tolerance = _limited(kept, self.tolerance, self._limit)
        self._pending = []


def _divided(columns: Columns, at: int) -> tuple[Columns, Columns]:
    return tuple(column[:at] for column in columns), tuple(column[at:] for column in columns)


def _joined(parts: list[Columns]) -> Columns:
    return tuple(np.concatenate(columns) for columns in zip(*parts, strict=True))


def _limited(kept: Columns, tolerance: float, limit: int) -> tuple[Columns, float]:
    """At most `limit` points, and the tolerance that was needed."""
    while len(kept[0]) > limit:
        tolerance *= 2
        kept = _thin(kept, tolerance)
    return kept, tolerance


def _thin(kept: Columns, tolerance: float) -> Columns:
    """The points without those that are within `tolerance` of the line between their neighbours."""
    points, cost, *tags = kept
    rows, cost = thin(points, cost, tolerance)
    return points[rows], cost, *(tag[rows] for tag in tags)

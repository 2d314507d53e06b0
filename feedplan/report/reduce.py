"""Reduces millions of samples to the few thousand points that a chart can show; peaks and corners stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Points, their tags, and the part of the tolerance already used between each point and the next.
Kept = tuple[Floats, NDArray[np.int64], Floats]


class Envelope:
    """The least and the greatest value of each bucket of consecutive samples, for several columns at once.

    `count` is the number of samples that `add` will get. About `points` of each column are kept at most: both
    extremes of a bucket at their own x, so that no peak is lost. With fewer samples than `points` all are
    kept.
    """

    def __init__(self, count: int, points: int) -> None:
        self._width = 1 if count <= points else -(-2 * count // points)
        self._rest: tuple[Floats, Floats, NDArray[np.int64]] | None = None
        self._parts: list[tuple[NDArray[np.int64], Floats, Floats, NDArray[np.int64]]] = []
        self._means: list[tuple[Floats, Floats]] = []
        self._last: float | None = None
        self._done = 0

    def add(self, x: Floats, values: Floats, tag: NDArray[np.int64] | None = None) -> None:
        """Takes the next samples: `x` (n,), `values` (n, columns), and an integer tag for each."""
        tag = np.zeros(len(x), np.int64) if tag is None else tag.astype(np.int64)
        if self._rest is not None:
            x = np.concatenate((self._rest[0], x))
            values = np.concatenate((self._rest[1], values))
            tag = np.concatenate((self._rest[2], tag))
        whole = len(x) // self._width * self._width
        self._keep(x[:whole], values[:whole], tag[:whole], self._width)
        self._rest = (x[whole:], values[whole:], tag[whole:])

    def curve(self, column: int) -> tuple[Floats, Floats, NDArray[np.int64]]:
        """x, value and tag of the points kept of one column, in order."""
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
        if self._rest is not None and len(self._rest[0]):
            self._keep(*self._rest, len(self._rest[0]))
        self._rest = None

    def _keep(self, x: Floats, values: Floats, tag: NDArray[np.int64], width: int) -> None:
        if len(x) == 0:
            return
        columns = np.ascontiguousarray(values.T).reshape(values.shape[1], -1, width)
        # A gap (NaN) is not an extreme, but stays if all of the bucket is a gap.
        gap = np.isnan(columns)
        low, high = columns, columns
        if gap.any():
            low, high = np.where(gap, np.inf, columns), np.where(gap, -np.inf, columns)
        least, greatest = low.argmin(axis=2), high.argmax(axis=2)
        start = np.arange(columns.shape[1]) * width
        pick = np.sort(np.stack([start + least, start + greatest], axis=-1), axis=-1)
        value = np.take_along_axis(values.T[:, :, None], pick.reshape(len(pick), -1, 1), axis=1)
        self._parts.append((pick + self._done, x[pick], value.reshape(pick.shape), tag[pick]))
        # The weight of a sample is its distance in x from the sample before; without distances all weights
        # are equal.
        before = x[0] if self._last is None else self._last
        weight = np.diff(x, prepend=before).reshape(-1, width)
        weight[weight.sum(axis=1) <= 0] = 1.0
        with np.errstate(invalid="ignore"):
            mean = np.einsum("cbw,bw->cb", columns, weight) / weight.sum(axis=1)
        self._means.append((x.reshape(-1, width).mean(axis=1), mean))
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
        self._kept: list[Kept] = []
        self._pending: list[tuple[Floats, NDArray[np.int64]]] = []
        self._pending_count = 0

    def add(self, points: Floats, tag: NDArray[np.int64]) -> None:
        """Takes the next samples: `points` (n, columns), scaled so that one tolerance suits all, and their
        tags."""
        self._pending.append((points, tag))
        self._pending_count += len(points)
        if self._pending_count >= 2 * self._limit:
            self._settle()

    def result(
        self, limit: int | None = None, tolerance: float = 0.0
    ) -> tuple[Floats, NDArray[np.int64], float]:
        """The points kept, their tags and the tolerance; reduced further to `limit` points or to a greater
        `tolerance`, if given."""
        self._settle()
        if not self._kept:
            return np.empty((0, 0)), np.empty(0, np.int64), self.tolerance
        kept, own = self._kept[0], self.tolerance
        if tolerance > own:
            kept, own = _thin(*kept[:2], kept[2].copy(), tolerance), tolerance
        kept, own = _limited(kept, own, self._limit if limit is None else limit)
        return kept[0], kept[1], own

    def _settle(self) -> None:
        if self._pending:
            points = np.concatenate([part[0] for part in self._pending])
            tag = np.concatenate([part[1] for part in self._pending])
            self._kept.append(_thin(points, tag, np.zeros(len(points)), self.tolerance))
            self._pending, self._pending_count = [], 0
        if not self._kept:
            return
        points, tag, cost = (np.concatenate([part[i] for part in self._kept]) for i in range(3))
        if len(self._kept) > 1:
            points, tag, cost = _thin(points, tag, cost, self.tolerance)
        kept, self.tolerance = _limited((points, tag, cost), self.tolerance, self._limit)
        self._kept = [kept]


def _limited(kept: Kept, tolerance: float, limit: int) -> tuple[Kept, float]:
    """At most `limit` points, and the tolerance that was needed."""
    while len(kept[0]) > limit:
        tolerance *= 2
        kept = _thin(*kept[:2], kept[2].copy(), tolerance)
    return kept, tolerance


def _thin(points: Floats, tag: NDArray[np.int64], cost: Floats, tolerance: float) -> Kept:
    """Removes points within `tolerance`; `cost` is the part of it already used between each point and the
    next."""
    kept = np.arange(len(points))
    idle = 0
    parity = 1
    while idle < 2 and len(points) > 2:
        # Every second point is a candidate: its neighbours stay, so all candidates can be judged at once.
        before, middle, after = (slice(parity + k, len(points) - 1 + k, 2) for k in (-1, 0, 1))
        spent = np.maximum(cost[before], cost[middle])
        total = spent + _distance(points[middle], points[before], points[after])
        gone = total <= tolerance
        keep = np.ones(len(points), dtype=bool)
        keep[middle] = ~gone
        cost[before][gone] = total[gone]
        points, kept, cost = points[keep], kept[keep], cost[keep]
        idle = idle + 1 if np.count_nonzero(gone) <= len(points) // 50 else 0
        parity = 3 - parity
    return points, tag[kept], cost


def _distance(points: Floats, a: Floats, b: Floats) -> Floats:
    """Distance of each point from the segment a–b of its row."""
    along = b - a
    square = np.einsum("ij,ij->i", along, along)
    t = np.einsum("ij,ij->i", points - a, along) / np.where(square > 0, square, 1.0)
    off = points - a - np.clip(t, 0.0, 1.0)[:, None] * along
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", off, off)))

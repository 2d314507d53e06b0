"""The feed limit of each piece (the programmed feed or the user's) and the factor with which each axis
velocity counts in that speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from feedplan.arguments import number, positive
from feedplan.arrays import Floats
from feedplan.errors import InputError, at_line
from feedplan.geometry.feed_groups import feed_groups, leading_feed, moving_axes
from feedplan.geometry.path import Path

# The least feed [mm/s, or the unit of the axes per second]: with slower ones rounding of the times matters.
LEAST_FEED = 1e-6


@dataclass(frozen=True)
class FeedRequest:
    """The user's changes to the programmed feeds: `feed` [mm/s] replaces them, `override` multiplies them."""

    feed: float | None = None
    override: float = 1.0

    def __post_init__(self) -> None:
        remedy = "a positive factor (1 is the programmed feed)"
        object.__setattr__(self, "override", number(self.override, "feed override", remedy, positive))
        if self.feed is not None:
            feed = number(self.feed, "feed", "a positive feed", positive, "mm/s")
            object.__setattr__(self, "feed", feed)

    def of(self, feed: Floats) -> Floats:
        """The programmed feeds with the user's changes; infinite feeds (no limit) stay infinite."""
        given = feed if self.feed is None else np.where(np.isfinite(feed), self.feed, feed)
        return np.asarray(given * self.override)


def feed_limit(path: Path, greatest: float, request: FeedRequest) -> Floats:
    """Greatest speed of each piece (n,) [mm/s]. `greatest` [mm/s] is the speed of rapids and limits all.

    Raises InputError for a feed below `LEAST_FEED`.
    """
    limit = np.minimum(request.of(path.feed), greatest)
    slow = int(limit.argmin())
    if limit[slow] < LEAST_FEED:
        line = int(path.line[slow])
        raise InputError(
            f"{at_line(line)}the feed is {limit[slow]:g} mm/s: give one from {LEAST_FEED:g} mm/s", line
        )
    return limit


def feed_share(path: Path, greatest: float, request: FeedRequest) -> Floats | None:
    """Factor of each axis velocity in the speed that `feed_limit` limits (n, axes); None if all moving axes
    have the factor 1.

    It is 1 for the axes along which the feed counts, and 0 for axes without a feed. Where a piece has feeds
    along two groups of axes, the factor of the second group is first feed / second feed: limiting the root of
    the sum of squares then keeps both feeds.
    """
    if path.group_feed is None:
        return None
    by_group = np.minimum(request.of(path.group_feed), greatest)
    by_group[np.isinf(path.group_feed)] = np.inf
    first = leading_feed(by_group, np.ones(len(path)))
    by_axis = (first[:, None] / by_group) @ feed_groups(path.axes)
    by_axis[np.isinf(by_group).all(axis=1)] = 1.0
    by_axis[((by_axis == 1.0) | ~moving_axes(path.curve)).all(axis=1)] = 1.0
    return None if (by_axis == 1.0).all() else np.ascontiguousarray(by_axis)

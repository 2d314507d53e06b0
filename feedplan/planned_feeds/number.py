"""Numbers as a program writes them: no exponents, rounded so that a feed is never above what is meant."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# An F word keeps so many significant digits: it is below the speed that is meant by less than 1e-4 of it.
FEED_DIGITS = 5
# What rounding a feed down takes off at most; an F that is above the plan by no more stays.
FEED_ROUNDING = 10.0 ** (1 - FEED_DIGITS)
# Decimals of a place inside a block [mm, inch, deg]: a thousandth of what reading back may differ by.
PLACE_DECIMALS = 12


def rounded_down(feeds: Array) -> Array:
    """Feeds (k,), all positive, with so many digits."""
    scale = 10.0 ** (FEED_DIGITS - 1 - np.floor(np.log10(feeds)))
    return np.floor(feeds * scale) / scale


def feed_texts(feeds: Array, point: bool = False) -> list[bytes]:
    """Rounded feeds (k,) as they are written; `point`: with a decimal point in any case."""
    return [_feed_text(feed, point) for feed in feeds.tolist()]


def _feed_text(feed: float, point: bool) -> bytes:
    text = repr(feed)
    if "e" in text:
        text = f"{Decimal(text):f}"
    if text.endswith(".0"):
        text = text[: -1 if point else -2]
    elif point and "." not in text:
        text += "."
    return text.encode()


def exact_text(value: float) -> bytes:
    """A feed as it is, but for rounding."""
    return f"{value:.12f}".rstrip("0").rstrip(".").encode()


def place_text(value: float | Decimal, decimals: int = PLACE_DECIMALS) -> bytes:
    """A coordinate, with a decimal point as controls want it, and without zeros behind."""
    rounded = Decimal(value).quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_EVEN)
    text = f"{rounded:f}".rstrip("0") if rounded else "0."
    return text.encode()

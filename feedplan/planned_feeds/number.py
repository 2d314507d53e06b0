"""Writes numbers as text of a program: without exponents, feeds rounded down."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np

from feedplan.arrays import Floats

# Significant digits of an F word: the relative rounding error is less than 1e-4.
FEED_DIGITS = 5
# The greatest relative error of a rounded feed; an F that exceeds the plan by less is kept.
FEED_ROUNDING = 10.0 ** (1 - FEED_DIGITS)
# Decimals of a coordinate [mm, inch, deg]: rounding is a thousandth of what reading back allows.
PLACE_DECIMALS = 12


def rounded_down(feeds: Floats) -> Floats:
    """Positive feeds (k,), rounded down to FEED_DIGITS digits."""
    scale = 10.0 ** (FEED_DIGITS - 1 - np.floor(np.log10(feeds)))
    return np.floor(feeds * scale) / scale


def feed_texts(feeds: Floats, point: bool = False) -> list[bytes]:
    """Rounded feeds (k,) as text; `point`: always with a decimal point."""
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
    """A feed with up to 12 decimals."""
    return f"{value:.12f}".rstrip("0").rstrip(".").encode()


def place_text(value: float | Decimal, decimals: int = PLACE_DECIMALS) -> bytes:
    """A coordinate with the decimal point that controls need, and without trailing zeros."""
    rounded = Decimal(value).quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_EVEN)
    text = f"{rounded:f}".rstrip("0") if rounded else "0."
    return text.encode()

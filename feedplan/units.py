"""Numbers with units as text, and for JSON. All quantities in feedplan are in mm, degrees and seconds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

MM_PER_INCH = 25.4
SECONDS_PER_MINUTE = 60.0


def mm_per_min(speed: float) -> float:
    """A speed [mm/s] in mm/min, the unit of part programs."""
    return speed * SECONDS_PER_MINUTE


def shared_unit(units: Iterable[str], otherwise: str) -> str:
    """The common unit; "units" if they differ, as for robots with linear joints; `otherwise` if none."""
    different = set(units)
    return "units" if len(different) > 1 else next(iter(different), otherwise)


def counted(number: int, noun: str) -> str:
    """`1 run`, `2 runs`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def finite(value: float) -> float | None:
    """The number, or None if it is infinite or NaN, which JSON cannot express."""
    return value if math.isfinite(value) else None


def duration_text(seconds: float) -> str:
    """A duration as readable text: `842 µs`, `1.234 s`, `12 min 03.4 s`, `2 h 05 min 10 s`."""
    # Rounded before choosing the unit, so that the text never shows, for example, 60.0 s.
    if round(seconds, 6) < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    if round(seconds, 4) < 1.0:
        return f"{seconds * 1e3:.1f} ms"
    if round(seconds, 3) < SECONDS_PER_MINUTE:
        return f"{seconds:.3f} s"
    minutes, rest = divmod(round(seconds, 1), SECONDS_PER_MINUTE)
    if minutes < 60:
        return f"{minutes:.0f} min {rest:04.1f} s"
    minutes, rest = divmod(round(seconds, 0), SECONDS_PER_MINUTE)
    hours, minutes = divmod(minutes, 60)
    return f"{hours:.0f} h {minutes:02.0f} min {rest:02.0f} s"


def difference_text(difference: float, of: float, word: str = "") -> str:
    """`12.0 s, 7.0 %`: the absolute value of a difference of times [s], and its share of a time [s].

    A `word` such as `less` is added after the seconds.
    """
    part = 100.0 * abs(difference) / of if of > 0.0 else 0.0
    seconds = " ".join(filter(None, (duration_text(abs(difference)), word)))
    return f"{seconds}, {part:.1f} %"


def way_unit(summary: Mapping[str, Any]) -> str:
    """The unit of distances from a plan's path: that of its length, or of angles if it only turns."""
    units: Mapping[str, str] = summary["units"]
    return units["angle" if summary["turn"] > 0 and summary["length"] == 0 else "length"]


def tolerance_text(least: float, greatest: float, unit: str = "mm") -> str:
    """`0.01 mm`, or the least and the greatest tolerance of a path that has several."""
    return f"{greatest:g} {unit}" if least == greatest else f"{least:g} to {greatest:g} {unit}"


def distance_text(distance: float, unit: str = "mm", form: str = ".3g") -> str:
    """A small distance: `9.39 µm` for mm, to a tenth of a nanometre; `0.00939 rad` for other units."""
    return f"{round(1e3 * distance, 4) + 0.0:{form}} µm" if unit == "mm" else f"{distance:{form}} {unit}"


def ratio_text(number: float, other: float) -> str:
    """The ratio of two counts: `3.0 : 1`, `0.048 : 1`."""
    ratio = number / other
    return f"{ratio:.1f} : 1" if ratio >= 1 else f"{ratio:.2g} : 1"

"""Checks of the values of a machine; an error is one sentence with place, value and remedy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Integral
from typing import Any

from feedplan.arguments import is_number, is_text, shown
from feedplan.errors import MachineError

# Numbers may exceed the ends of their ranges by this share, because the ends are rounded quotients.
ROUNDING = 1e-12


def require(condition: bool, what: str, value: object, remedy: str) -> None:
    """Raises MachineError unless the condition holds."""
    if not condition:
        raise MachineError(f"{what} is {shown(value)}: give {remedy}")


def one_by_one(values: Any, what: str, remedy: str) -> tuple[Any, ...]:
    """The values as a tuple; raises MachineError where they cannot be iterated."""
    require(isinstance(values, Iterable), what, values, remedy)
    return tuple(values)


def numbers(values: Any, count: int, what: str, remedy: str, infinite: bool = False) -> tuple[float, ...]:
    """`count` numbers as floats; raises MachineError for anything else."""
    given = one_by_one(values, what, remedy)
    good = len(given) == count and all(map(is_number, given))
    require(good and (infinite or all(map(math.isfinite, given))), what, values, remedy)
    return tuple(map(float, given))


def set_within(
    owner: object, key: str, place: str, unit: str, ends: tuple[float, float], infinite: bool = False
) -> None:
    """Converts a field to a float; raises MachineError unless it is between the ends, or allowed infinite."""
    value = getattr(owner, key)
    good = is_number(value) and (_within(value, ends) or (infinite and value == math.inf))
    remedy = f"a number from {ends[0]:g} to {ends[1]:g} [{unit}]{', or inf' if infinite else ''}"
    require(good, place + key, value, remedy)
    object.__setattr__(owner, key, float(value))


def set_limit(owner: object, key: str, place: str, unit: str, ends: tuple[float, float]) -> None:
    """Converts a field to a float between the ends, or to a negative and a positive one where directions
    differ. Raises MachineError for other values."""
    value = getattr(owner, key)
    if not isinstance(value, (list, tuple)):
        return set_within(owner, key, place, unit, ends)
    good = len(value) == 2 and all(map(is_number, value))
    good = good and all(_within(size, ends) for size in (-value[0], value[1]))
    remedy = (
        f"a number from {ends[0]:g} to {ends[1]:g} [{unit}], or a negative and a positive one of such size"
    )
    require(good, place + key, value, remedy)
    least, greatest = map(float, value)
    object.__setattr__(owner, key, greatest if greatest == -least else (least, greatest))
    return None


def _within(value: float, ends: tuple[float, float]) -> bool:
    return (1.0 - ROUNDING) * ends[0] <= value <= (1.0 + ROUNDING) * ends[1]


def require_text(value: object, what: str) -> None:
    """Raises MachineError unless the value is a non-empty text that a file can hold."""
    require(is_text(value) and value != "", what, value, "a text")


def written(value: Any, what: str) -> Any:
    """A value in the types of a machine file: text, true or false, a number, or a list or table of these.

    Tuples and arrays become lists. Raises MachineError for what a file cannot hold.
    """
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, Mapping):
        for key in value:
            require_text(key, f"{what}: a key")
        return {key: written(entry, f"{what} {key}") for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [written(entry, what) for entry in value]
    if isinstance(value, bool) or is_text(value):
        return value
    remedy = "text, true or false, a number, or a list or table of these, as a machine file can hold"
    require(is_number(value) and value == value, what, value, remedy)
    return int(value) if isinstance(value, Integral) else float(value)

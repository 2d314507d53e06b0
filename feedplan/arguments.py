"""Checks arguments of users: returns them in the wanted type, or raises one sentence with the remedy."""

from __future__ import annotations

import math
import os
import reprlib
from collections.abc import Callable, Iterable
from numbers import Integral, Real
from pathlib import Path as FilePath
from typing import Any, TypeVar

import numpy as np

from feedplan.errors import InputError

Wanted = TypeVar("Wanted")
Name = TypeVar("Name", bound=str)

_SHOWN = reprlib.Repr()
_SHOWN.maxstring = _SHOWN.maxother = _SHOWN.maxlong = 40
_LONGEST = 60


def shown(value: object) -> str:
    """A text for any value, on one short line."""
    if type(value).__module__ == "numpy" and getattr(value, "shape", None) == ():
        value = value.item()  # type: ignore[attr-defined]  # without the name of its type
    try:
        text = " ".join(_SHOWN.repr(value).split())
    except ValueError:  # Python prints no integer of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def refuse(what: str, value: object, remedy: str) -> InputError:
    """The error for a value that cannot be used: `the feed is -1: give a positive feed [mm/s]`."""
    return InputError(f"{what} is {shown(value)}: give {remedy}")


def is_number(value: object) -> bool:
    """Whether a value is a real number, of any type, that a float can hold; True and False are not."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def is_text(value: object) -> bool:
    """Whether a value is text without lone surrogates, which cannot be written to a file."""
    return isinstance(value, str) and not any("\ud800" <= letter <= "\udfff" for letter in value)


def printable(text: str) -> str:
    """The text with a replacement character for each byte of a file name that is not UTF-8."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def is_whole(value: object, least: int = 1, most: float = math.inf) -> bool:
    """Whether a value is a whole number, of any type, from `least` to `most`."""
    return isinstance(value, Integral) and not isinstance(value, bool) and least <= int(value) <= most


def number(
    value: object,
    what: str,
    remedy: str,
    within: Callable[[float], bool] = math.isfinite,
    unit: str = "",
) -> float:
    """The value as a float; raises InputError unless it is a number for which `within` is true."""
    if is_number(value):
        given = float(value)  # type: ignore[arg-type]
        if within(given):
            return given
        raise InputError(f"{what} is {given:g}{unit and ' '}{unit}: give {remedy}")
    raise refuse(what, value, remedy)


def positive(value: float) -> bool:
    """Finite and greater than 0."""
    return 0.0 < value < math.inf


def not_negative(value: float) -> bool:
    """Finite and 0 or more."""
    return 0.0 <= value < math.inf


def whole(value: object, what: str, remedy: str, least: int = 1, most: float = math.inf) -> int:
    """The value as an integer; raises InputError unless it is a whole number from `least` to `most`."""
    if is_whole(value, least, most):
        return int(value)  # type: ignore[call-overload,no-any-return]
    raise refuse(what, value, remedy)


def flag(value: object, what: str) -> bool:
    """True or False, also NumPy's; raises InputError for anything else."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise refuse(what, value, "True or False")


def one_of(value: object, kind: str, known: Iterable[Name]) -> Name:
    """The value if it is one of the names `known`; else raises InputError that lists them."""
    names = tuple(known)
    for name in names:
        if isinstance(value, str) and value == name:
            return name
    raise InputError(f"there is no {kind} {shown(value)}: use one of {', '.join(names)}")


def list_of_names(value: object, what: str, remedy: str) -> tuple[str, ...]:
    """The names of a list; raises InputError for a single text instead of a list, and for other values."""
    if isinstance(value, Iterable) and not isinstance(value, (str, bytes)):
        given = tuple(value)
        if all(isinstance(name, str) for name in given):
            return given
    raise refuse(what, value, remedy)


def instance(value: object, wanted: type[Wanted], what: str, remedy: str) -> Wanted:
    """The value if it is of the wanted type; raises InputError for anything else."""
    if isinstance(value, wanted):
        return value
    raise refuse(what, value, remedy)


def file_path(value: object, what: str, remedy: str) -> FilePath:
    """The value as a path; raises InputError for other values."""
    text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else None
    if not isinstance(text, str) or not text:
        raise refuse(what, value, remedy)
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        text = "\0"
    if "\0" in text:
        raise InputError(f"{shown(value)} is not the path of a file: give {remedy}")
    return FilePath(text)


def callback(value: Any, told: str = "the stage and the part done") -> Any:
    """A function, or None; raises InputError for anything else."""
    if value is None or callable(value):
        return value
    raise refuse("progress", value, f"a function that is called with {told}, or None")

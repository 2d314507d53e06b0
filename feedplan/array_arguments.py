"""Checks users' arrays of control points, places and times: type, shape and range."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan.arguments import is_number, shown
from feedplan.arrays import Flags, Floats
from feedplan.errors import InputError

MAX_AXES = 9


def point_array(control_points: ArrayLike, weights: ArrayLike | None) -> tuple[Floats, Floats | None]:
    """Control points as (n, axes), where (n,) counts as one axis, and their weights."""
    control = floats(control_points, "control points")
    if control.ndim == 1:
        control = control[:, None]
    if control.ndim != 2 or not 1 <= control.shape[1] <= MAX_AXES:
        raise InputError(
            f"control points of shape {control.shape}: give (points, axes) with 1 to {MAX_AXES} axes"
        )
    if weights is None:
        return control, None
    weight = floats(weights, "weights", 1)
    if len(weight) != len(control):
        raise InputError(f"{len(weight)} weights for {len(control)} control points: give one for each")
    return control, weight


def places(piece: ArrayLike, u: ArrayLike) -> tuple[NDArray[np.uint32], Floats]:
    """Pieces and parameters of places, both as arrays (m,)."""
    pieces, at = whole_numbers(piece, "pieces"), floats(u, "parameters")
    refuse_where(pieces < 0, lambda i: f"place {i} is on piece {pieces[i]}: pieces are counted from 0")
    if at.ndim > 1 or len({len(pieces), len(at)} - {1}) > 1:
        raise InputError(f"{len(pieces)} pieces and parameters of shape {at.shape}: give one for each place")
    pieces, at = np.broadcast_arrays(pieces, at)
    return (
        np.ascontiguousarray(np.minimum(pieces, 2**32 - 1), dtype=np.uint32),
        np.ascontiguousarray(at, dtype=np.float64),
    )


def whole_numbers(values: ArrayLike, name: str) -> NDArray[Any]:
    """An array (n,) of whole numbers of any type; a single number gives an array of one."""
    try:
        given = np.atleast_1d(np.asarray(values))
    except ValueError:  # lists of different lengths
        given = np.empty((0, 0))
    if given.dtype.kind == "f" and (np.abs(given) < 2**53).all() and (given == np.floor(given)).all():
        given = given.astype(np.int64)
    if given.ndim != 1 or given.dtype.kind not in "iu":
        raise InputError(f"{name} are {shown(values)}: give whole numbers from 0")
    return given


def floats(values: ArrayLike, name: str, dimensions: int | None = None) -> Floats:
    """A C-contiguous array of numbers, with `dimensions` dimensions if given."""
    try:
        given = np.asarray(values)
        # Objects may be numbers, such as fractions, so they are checked one by one; NumPy would also accept
        # texts and truth values. Masked values are not numbers; there are none before numpy.ma is imported,
        # and a process forked while a thread imports it would wait for ever.
        if (
            given.dtype.kind not in "iufO"
            or (given.dtype.kind == "O" and not all(map(is_number, given.flat)))
            or ("numpy.ma" in sys.modules and np.ma.is_masked(values))
        ):
            raise TypeError
        array = np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} are not all real numbers: correct the list") from None
    if dimensions is not None and given.ndim != dimensions:
        raise InputError(f"{name} of shape {given.shape}: give a list of {dimensions} dimension")
    return array


def within(given: ArrayLike, name: str, end: float, unit: str) -> Floats:
    """A number or numbers (n,) from 0 to `end`; `name` says what they are. Raises InputError for others."""
    try:
        values = floats(given, name).reshape(np.shape(given))
    except InputError:
        raise InputError(f"the {name} is {shown(given)}: give a number or a list of numbers") from None
    if values.ndim > 1:
        raise InputError(f"the {name}s have {values.ndim} dimensions: give a number or a list of numbers")
    # The end of a plan or path is a sum, which may differ by rounding.
    outside = ~((values >= 0.0) & (values <= end * (1.0 + 1e-12)))
    if outside.any():
        worst = float(values[outside].flat[0])
        # Enough digits to distinguish a value just beyond the end from the end.
        raise InputError(f"the {name} is {worst:.13g} {unit}: give one from 0 to {end:.13g} {unit}")
    return values


def refuse_where(bad: Flags, sentence: Callable[[int], str]) -> None:
    """Raises InputError with the sentence for the first index where `bad` is true."""
    if bad.any():
        raise InputError(sentence(int(bad.argmax())))

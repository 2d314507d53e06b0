"""Arrays as users give them to the geometry kernels: numbers of the right shape, or a sentence why not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan.errors import InputError

MAX_AXES = 9


def points(
    control_points: ArrayLike, weights: ArrayLike | None
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Control points (n, axes), of one axis also (n,), and their weights."""
    control = floats(control_points, "control points")
    if control.ndim == 1:
        control = control[:, None]
    if control.ndim != 2 or not 1 <= control.shape[1] <= MAX_AXES:
        raise InputError(
            f"control points of shape {control.shape}: give (points, axes) with 1 to {MAX_AXES} axes"
        )
    return control, None if weights is None else floats(weights, "weights", 1)


def places(piece: ArrayLike, u: ArrayLike) -> tuple[NDArray[np.uint32], NDArray[np.float64]]:
    """Pieces and parameters of places (m,)."""
    pieces, at = np.atleast_1d(np.asarray(piece)), np.atleast_1d(np.asarray(u, dtype=np.float64))
    if pieces.size and pieces.dtype.kind not in "iu":
        raise InputError(f"pieces are given as {pieces.dtype}: give whole numbers from 0")
    refuse(pieces < 0, lambda i: f"place {i} is on piece {pieces[i]}: pieces are counted from 0")
    pieces, at = np.broadcast_arrays(pieces, at)
    return (
        np.ascontiguousarray(np.minimum(pieces, 2**32 - 1), dtype=np.uint32),
        np.ascontiguousarray(at, dtype=np.float64),
    )


def floats(values: ArrayLike, name: str, dimensions: int | None = None) -> NDArray[np.float64]:
    """A C-contiguous array of numbers with so many dimensions."""
    try:
        given = np.asarray(values)
        if given.dtype.kind == "c":
            raise TypeError
        array = np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} are not all real numbers: correct the list") from None
    if dimensions is not None and given.ndim != dimensions:
        raise InputError(f"{name} of shape {given.shape}: give a list of {dimensions} dimension")
    return array


def refuse(bad: NDArray[np.bool_], sentence: Callable[[int], str]) -> None:
    """Raises the sentence for the first index that is bad."""
    if bad.any():
        raise InputError(sentence(int(bad.argmax())))

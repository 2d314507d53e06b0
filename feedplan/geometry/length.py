"""Lengths along a path, and the places at given lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import PathLength as NativePathLength
from feedplan.curves.length import Places
from feedplan.errors import InputError
from feedplan.geometry.path import Path


class PathLength:
    """The length of a path as a function of the place on it, tabulated with a proven error.

    Source: Cheatham 2007, chapter 3, corrected; Zhang et al. 2010, section 4.2, for `newton`.
    """

    def __init__(self, path: Path) -> None:
        if len(path) == 0:
            raise InputError("the path is empty: it has no length table")
        self._table = NativePathLength(
            np.ascontiguousarray(path.curve.by_piece, dtype=np.float64),
            np.ascontiguousarray(path.width, dtype=np.float64),
        )

    @property
    def total(self) -> float:
        """Length of the path [mm]."""
        return self._table.total

    @property
    def error(self) -> float:
        """The greatest proven error of one piece's length [mm]."""
        return self._table.error

    def length(self, piece: ArrayLike, u: ArrayLike) -> NDArray[np.float64]:
        """Length from the start of the path to the places (n,) [mm]."""
        return self._table.lengths(
            np.ascontiguousarray(piece, dtype=np.uint32), np.ascontiguousarray(u, dtype=np.float64)
        )

    def locate(self, lengths: ArrayLike, tolerance: float, interpolator: str = "sarfraz") -> Places:
        """The places at lengths (n,) [mm], within `tolerance` [mm]; a length beyond an end gives that end.

        `sarfraz` finds each by itself, in parallel; `newton` finds each from the one before.
        """
        if interpolator not in ("sarfraz", "newton"):
            raise InputError(f"there is no interpolator '{interpolator}': use one of sarfraz, newton")
        array = np.ascontiguousarray(lengths, dtype=np.float64)
        return Places(*self._table.locate(array, tolerance, interpolator == "newton"))

"""The length along a curve of any degree, and its inverse: the places at given lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feedplan._solvers import CurveLength as Native
from feedplan.array_arguments import floats, places
from feedplan.arrays import Floats
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.lazy import cached_property


class CurveLength:
    """The length of a curve as a function of the place on it, tabulated to a proven error.

    `accuracy` is the allowed relative error of the length of each piece; rounding adds to it. Source:
    Cheatham 2007, chapter 3, corrected, extended to curves of any degree, with intervals halved towards
    cusps. Raises InputError for an empty curve and an accuracy that is not possible.
    """

    def __init__(self, curve: CompositeCurve, accuracy: float = 1e-13) -> None:
        if len(curve) == 0:
            raise InputError("the curve is empty: give at least one piece")
        if not 1e-16 <= accuracy < 1:
            raise InputError(f"the accuracy of lengths is {accuracy:g}: give a part from 1e-16 to 1")
        self._curve, self._accuracy = curve, accuracy

    def __reduce__(self) -> tuple[type[CurveLength], tuple[CompositeCurve, float]]:
        return CurveLength, (self._curve, self._accuracy)

    @cached_property
    def _table(self) -> Native:
        return Native(self._curve.native, self._accuracy)

    @property
    def total(self) -> float:
        """Length of the curve [mm]."""
        return self._table.total

    @property
    def error(self) -> float:
        """Error bound of every length on the curve [mm]."""
        return self._table.error

    def length(self, piece: ArrayLike, u: ArrayLike) -> Floats:
        """Length from the start of the curve to places (m,) [mm]."""
        return self._table.lengths(*places(piece, u))

    def locate(self, lengths: ArrayLike, tolerance: float = 1e-12) -> tuple[NDArray[np.uint32], Floats]:
        """The pieces and the parameters u (m,) at lengths (m,) [mm], within `tolerance` [mm]; a length beyond
        an end of the curve gives that end."""
        return self._table.locate(floats(lengths, "lengths", 1), tolerance)

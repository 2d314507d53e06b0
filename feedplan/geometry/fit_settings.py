"""The settings of a path's fit: tolerances, the longest chord that is fitted, and where chains are broken."""

from __future__ import annotations

from dataclasses import dataclass, fields

from feedplan.arguments import not_negative, number
from feedplan.errors import InputError


@dataclass(frozen=True)
class FitSettings:
    """How closely and how smoothly a program is followed.

    - `default_tolerance` [mm] holds in G64 without P, and where a program has no path-control mode. Parts
      with tolerances of a tenth of a millimetre leave about a hundredth to the controller.
    - `exact_tolerance` [mm] is the tolerance of arcs in every mode, and of the exact path; lines and splines
      are exact. The ends of programmed arcs are rounded numbers, so a circle through both ends may be half of
      it away from the programmed arc; an arc that is farther away is a spiral and becomes quadratics within
      the same distance. Half of it also limits the error of a helix along its axis. The other half is used to
      smooth joints.
    - `fit_share` is the greatest share of the tolerance that the fit uses; corners are rounded by the rest.
    - `max_chord` [mm]: longer G1 chords stay lines. A long chord among short ones was meant as a line.
    - `alpha`: chains are broken where their curvature exceeds alpha·a_max/F² (Zhang et al. 2010, eq. 2; they
      take 4 or 9), where a_max is the combined acceleration of the axes and F the greatest feed of the chain.
    - `corner_angle` [deg]: a chain that turns less at a breaking point stays smooth there. A polygon of 14 or
      more equal chords is read as a curve, a twelve-sided one as corners.
    """

    default_tolerance: float = 0.01
    exact_tolerance: float = 0.001
    fit_share: float = 0.5
    max_chord: float = 5.0
    alpha: float = 4.0
    corner_angle: float = 27.5

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            number(value, f"fit setting {field.name}", "a positive number", lambda given: given > 0)
        if self.fit_share >= 1:
            raise InputError(f"fit setting fit_share is {self.fit_share}: give a number below 1")


def tolerance_of(given: float) -> float:
    """A tolerance [mm] as a float; raises InputError for a negative one or another value."""
    return number(
        given, "the tolerance", "0 (exact lines with stops) or a positive number [mm]", not_negative
    )

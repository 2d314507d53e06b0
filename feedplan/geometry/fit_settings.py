"""How closely and how smoothly a path follows a program."""

from __future__ import annotations

from dataclasses import dataclass, fields

from feedplan.arguments import not_negative, number
from feedplan.errors import InputError


@dataclass(frozen=True)
class FitSettings:
    """How closely and how smoothly a program is followed.

    `default_tolerance` [mm] holds in G64 stretches without a P, and where a program says nothing: a hundredth
    is what machining tolerances leave to a controller.
    `exact_tolerance` [mm] is what "exactly" means for arcs in every mode; lines are exact, and splines but
    for smoothed joints. An arc becomes the circle through both its ends, which rounding took off the
    programmed one. Half of that bounds how far it is from the programmed arc, whose radius goes with the
    angle: beyond it is a spiral and becomes quadratics within as much. It also bounds how far a helix is off
    along its axis while on its cylinder. The other half smooths joints.
    `fit_share` is the part of the tolerance that the fit may use: where the program gives no Q, and at most.
    Corners are rounded by what the fit leaves.
    `max_chord` [mm]: longer G1 chords stay lines. A long chord among short ones was meant as a line.
    `alpha`: chains are broken where their curvature exceeds alpha·a_max/F² (Zhang et al. 2010, eq. 2; they
    take 4 or 9), a_max being the combined acceleration of the axes and F the greatest feed of the chain.
    `corner_angle` [deg]: a chain that turns less at a breaking point stays smooth there. A polygon of 14 or
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
    """A tolerance [mm] as it is used; raises InputError for one that cannot be."""
    return number(
        given, "the tolerance", "0 (exact lines with stops) or a positive number [mm]", not_negative
    )

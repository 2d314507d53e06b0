"""Paths along curves as they are, problems with no limits but those given, profiles from rows of numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.profile import OF_PHASES, PhaseLaw, SpeedProfile

# A speed [mm/s] and an acceleration [mm/s²] that limit nothing.
FREE = 1e9
# Piece, law, axis, value, u0, u1, p0, p1 and duration of a phase; a0 and a1 may follow.
Phase = tuple[int, PhaseLaw, int, float, float, float, float, float, float]


def path_along(curve: CompositeCurve, axes: Sequence[str] = "XYZABC", **columns: Any) -> Path:
    """One run over the curve's own pieces, each on a line and a move of its own, at no feed but a given one.

    `Path.from_curve` cuts pieces at corners and joins lines. `columns` are others of the path; one number of
    `feed` or `tolerance` is that of all pieces.
    """
    number, runs = np.arange(len(curve)), columns.pop("runs", [0, len(curve)])
    own = {"feed": FREE, "tolerance": 0.0, "line": 10 * (number + 1), "dwell": np.zeros(len(runs) - 1)}
    own |= {"move": np.stack([number, number], axis=1)} | columns
    for name in ("feed", "tolerance"):
        own[name] = np.broadcast_to(own[name], len(curve))
    return Path(axes=tuple(axes[: curve.axes]), curve=curve, runs=np.array(runs), **own)


def problem_along(path: Path, velocity: Any = FREE, acceleration: Any = FREE, **others: Any) -> Problem:
    """The path at its feeds within a velocity and an acceleration of all axes or of each, from rest to rest.

    `others` are more limits of the problem, and speeds at its ends.
    """
    junction = np.full(len(path) + 1, math.inf)
    junction[0], junction[-1] = (others.get(f"{end}_speed", 0.0) for end in ("start", "end"))
    free = {"feed": path.feed, "max_jerk": np.full(len(path.axes), math.inf), "junction_speed": junction}
    limits = (np.broadcast_to(limit, len(path.axes)) for limit in (velocity, acceleration))
    return Problem(path, *limits, **{**free, "chord_tolerance": math.inf, "period": 0.001, **others})


def profile_of(*phases: tuple[Any, ...], runs: Sequence[int] | None = None) -> SpeedProfile:
    """The profile of these phases in their order, as one run or as those between the offsets `runs`."""
    columns = dict(zip(OF_PHASES, zip(*phases, strict=True), strict=False))
    return SpeedProfile(**columns, runs=[0, len(phases)] if runs is None else runs)

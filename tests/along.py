"""Helpers: paths along given curves, problems with only the given limits, profiles from rows of numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.profile import OF_PHASES, PhaseLaw, SpeedProfile

# A speed [mm/s] and an acceleration [mm/s²] so high that they limit nothing.
FREE = 1e9
# Piece, law, axis, value, u0, u1, p0, p1 and duration of a phase; a0 and a1 may be added.
Phase = tuple[int, PhaseLaw, int, float, float, float, float, float, float]


def path_along(curve: CompositeCurve, axes: Sequence[str] = "XYZABC", **columns: Any) -> Path:
    """One run over the curve's own pieces; each piece has its own line and move, and no effective feed.

    Unlike `Path.from_curve` it neither cuts pieces at corners nor joins lines. `columns` are further columns
    of the path; a single number for `feed` or `tolerance` holds for all pieces.
    """
    number, runs = np.arange(len(curve)), columns.pop("runs", [0, len(curve)])
    own = {"feed": FREE, "tolerance": 0.0, "line": 10 * (number + 1), "dwell": np.zeros(len(runs) - 1)}
    own |= {"move": np.stack([number, number], axis=1)} | columns
    for name in ("feed", "tolerance"):
        own[name] = np.broadcast_to(own[name], len(curve))
    return Path(axes=tuple(axes[: curve.axes]), curve=curve, runs=np.array(runs), **own)


def problem_along(path: Path, velocity: Any = FREE, acceleration: Any = FREE, **others: Any) -> Problem:
    """The problem of the path with its feeds, from rest to rest; a single limit holds for every axis.

    `others` are further limits of the problem, and speeds at its ends.
    """
    junction = np.full(len(path) + 1, math.inf)
    junction[0], junction[-1] = (others.get(f"{end}_speed", 0.0) for end in ("start", "end"))
    free = {"feed": path.feed, "max_jerk": np.full(len(path.axes), math.inf), "junction_speed": junction}
    limits = (np.broadcast_to(limit, len(path.axes)) for limit in (velocity, acceleration))
    return Problem(path, *limits, **{**free, "chord_tolerance": math.inf, "period": 0.001, **others})


def profile_of(*phases: tuple[Any, ...], runs: Sequence[int] | None = None) -> SpeedProfile:
    """The profile of these phases in order, as one run or split into runs at the offsets `runs`."""
    columns = dict(zip(OF_PHASES, zip(*phases, strict=True), strict=False))
    return SpeedProfile(**columns, runs=[0, len(phases)] if runs is None else runs)

"""A speed profile: the exact phases of p = (du/dt)² along a path."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from feedplan._solvers import Profile, Sampler
from feedplan.arrays import Floats, Integers
from feedplan.constraints.problem import Problem
from feedplan.lazy import cached_property
from feedplan.native import OfNative
from feedplan.progress import Listener, tell
from feedplan.units import counted

# The `axis` of a phase whose constant belongs to no axis.
NO_AXIS = 255


class PhaseLaw(IntEnum):
    """The quantity that is constant on a phase of the profile; `value` is the constant."""

    AXIS_ACCELERATION = 0  # q'_k s + q''_k p = value [mm/s²], signed
    PARAMETER_ACCELERATION = 1  # s = p'/2 = value [mm/s²], so that p is linear in u
    FEED = 2  # the speed that the feed limits: |C'|² p = value [mm²/s²], with the problem's `feed_share`
    AXIS_VELOCITY = 3  # one axis's speed: q'_k² p = value [mm²/s²]
    SPEED_LINE = 4  # |C'|² p is linear in u from end to end [mm²/s²]; value is 0
    PATH_JERK = 5  # the jerk along the path v̈ = value [mm/s³]: v is a quadratic polynomial of time
    SPEED_CUBIC = 6  # v² is a cubic polynomial of the length from end to end, slopes 2a; value is 0


# Columns with an entry for each phase, and columns that are lists of pieces.
OF_PHASES = ("piece", "kind", "axis", "value", "u0", "u1", "p0", "p1", "duration", "a0", "a1")
OF_PIECES = ("slowed", "kinked")
_DTYPES = {
    **dict.fromkeys(("value", "u0", "u1", "p0", "p1", "duration", "a0", "a1", "run_bounds"), np.float64),
    **dict.fromkeys(("piece", "slowed", "kinked"), np.uint32),
    **dict.fromkeys(("kind", "axis"), np.uint8),
    "runs": np.int64,
}


@dataclass(frozen=True, eq=False)
class SpeedProfile(OfNative[Profile]):
    """Phases in the order of the path.

    For each phase: `piece` (index into the path), `kind` (PhaseLaw), `axis` (the axis that the phase's
    constant belongs to, 255 for none), `value` (see PhaseLaw), `u0`, `u1` (local parameter, u0 < u1), `p0`,
    `p1` (p at both ends [mm²/s²]), `duration` [s]. `runs` (r + 1,) are the offsets of the path's runs in the
    phases. `slowed` (m,) are pieces on which the plan stops although it need not, because rounding hides how
    the path continues; each stop is listed once.

    In FEED and SPEED_LINE, |C'|² is the problem's `tip_speed` where it has one; q are the joints. Between the
    ends p follows exactly from the kind: it is never interpolated. On AXIS_ACCELERATION of axis k, axis l
    accelerates with (q'_l·value − W_kl p)/q'_k, W_kl = q''_k q'_l − q''_l q'_k; this form is accurate where
    q'' p is large. On PARAMETER_ACCELERATION, `axis` is the axis whose acceleration limit determines p where
    s is 0, if there is one.

    A phase may begin or end with C' = 0, where the tool rests: p is its limit value there, or 0 if there is
    none. On PATH_JERK and SPEED_CUBIC `a0`, `a1` are the acceleration along the path at both ends, v̇
    [mm/s²]; they are 0 on all other kinds. Speed v = |C'| √p and length are measured along the path, by the
    problem's `way_speed` where it has one. PATH_JERK: v1 = v0 + a0·T + value·T²/2, a1 = a0 + value·T, T is
    the duration. SPEED_CUBIC: v0, v1 > 0.

    `kinked` (m,) are pieces at whose start a jump of the curvature limits the speed. `stopped`: a time limit
    ended the planning early. `excess` [s]: the planner's estimate of time − least time on its grid, not a
    proof; NaN if it gives none. `run_bounds` (r,) or empty: a lower bound of the time of each run that the
    planner has proven [s], NaN where it has proven none.

    All arrays are read-only. Raises InputError where arrays of the phases differ in length.
    """

    piece: NDArray[np.uint32]
    kind: NDArray[np.uint8]
    axis: NDArray[np.uint8]
    value: Floats
    u0: Floats
    u1: Floats
    p0: Floats
    p1: Floats
    duration: Floats
    runs: Integers
    slowed: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, dtype=np.uint32))
    a0: Floats = field(default_factory=lambda: np.empty(0))
    a1: Floats = field(default_factory=lambda: np.empty(0))
    kinked: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, dtype=np.uint32))
    stopped: bool = False
    excess: float = math.nan
    run_bounds: Floats = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        for name, dtype in _DTYPES.items():
            column = np.asarray(getattr(self, name))
            if name in ("a0", "a1") and len(column) == 0:
                column = np.zeros(len(self.piece))
            object.__setattr__(self, name, np.ascontiguousarray(column, dtype))
        self._hold(Profile(self))

    def __len__(self) -> int:
        return len(self.piece)

    def __repr__(self) -> str:
        return f"<SpeedProfile of {counted(len(self), 'phase')}: {self.time:.6g} s>"

    @property
    def time(self) -> float:
        """Time in motion, without dwells [s]."""
        return float(self.duration.sum())

    @property
    def lower_bound(self) -> float:
        """The planner's proven lower bound of the time in motion [s]; NaN where it has proven none."""
        return min(math.fsum(self.run_bounds), self.time) if len(self.run_bounds) else math.nan

    @property
    def run_times(self) -> Floats:
        """Time of each run [s], shape (runs,)."""
        ends = np.concatenate(([0.0], np.cumsum(self.duration)))
        return np.asarray(np.diff(ends[self.runs]))

    @cached_property
    def _samplers(self) -> WeakKeyDictionary[Problem, Sampler]:
        return WeakKeyDictionary()

    def sampler(self, problem: Problem, progress: Listener | None = None) -> Sampler:
        """The native sampler of the motion along the problem's path, with setpoints at the problem's period.

        It is made once for each problem; `progress` is called with the finished share. Raises InputError for
        a profile of another path.
        """
        if problem not in self._samplers:
            self._samplers[problem] = Sampler(problem, self, problem.period, progress)
        tell(progress, 1.0)
        return self._samplers[problem]


def joined_runs(taken: Iterable[tuple[SpeedProfile, slice, int]], **others: Any) -> SpeedProfile:
    """A profile from runs of several profiles, in order.

    `taken` are profiles, each with a slice of its runs and a number that is added to the indices of its
    pieces; `others` are the fields of the result that do not follow from these columns.
    """
    columns: dict[str, list[NDArray[Any]]] = {name: [] for name in (*OF_PHASES, *OF_PIECES)}
    runs = [np.zeros(1, dtype=np.int64)]
    for profile, own, more in taken:
        offsets = profile.runs[own.start : own.stop + 1]
        for name in OF_PHASES:
            columns[name].append(getattr(profile, name)[offsets[0] : offsets[-1]])
        pieces = columns["piece"][-1]
        columns["piece"][-1] = pieces.astype(np.int64) + more
        for name in OF_PIECES:
            listed = getattr(profile, name)
            columns[name].append(listed[np.isin(listed, pieces)].astype(np.int64) + more)
        runs.append(runs[-1][-1] + offsets[1:] - offsets[0])
    joined: dict[str, Any] = {name: np.concatenate(parts) for name, parts in columns.items()}
    return SpeedProfile(**joined, runs=np.concatenate(runs), **others)

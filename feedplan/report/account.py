"""Divides a plan's time and length by active limit, source line, cause of stops, feed and rapid motion."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from feedplan.constraints.problem import Problem
from feedplan.constraints.tool_motion import ToolMotion
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.progress import Listener, part, tell
from feedplan.report.activity import Activity, activity
from feedplan.report.losses import Share, SlowLine, slowest_lines, time_per_limit
from feedplan.report.stops import Stops, stops_by_cause


@dataclass(frozen=True)
class Total:
    """A total of motion: its `time` [s] and `length` [mm], and the angle that rotary axes `turn` while no
    other axis moves [deg]; `turn_time` [s] is the time of this turning. `ToolMotion.units` may name other
    units."""

    time: float
    length: float
    turn: float
    turn_time: float

    @property
    def mean(self) -> float:
        """Mean speed, without the parts where only rotary axes turn [mm/s]."""
        moving = self.time - self.turn_time
        return self.length / moving if moving > 0 and self.length > 0 else 0.0

    @property
    def mean_turn(self) -> float:
        """Mean speed of rotary axes that turn alone [deg/s]."""
        return self.turn / self.turn_time if self.turn_time > 0 else 0.0


@dataclass(frozen=True, eq=False)
class Account:
    """The account: `limits` with their times, the longest first; `slow`, the lines that lose most time;
    `stops` by cause; totals of motion at a `feed`, of `rapid` motion and of `all`; the least and the greatest
    requested `tolerance` [mm]; `activity`, the active limit at each moment."""

    motion: ToolMotion
    activity: Activity
    limits: tuple[Share, ...]
    slow: tuple[SlowLine, ...]
    stops: tuple[Stops, ...]
    feed: Total
    rapid: Total
    all: Total
    tolerance: tuple[float, float]

    def to_json(self) -> dict[str, Any]:
        """The numbers by name, as in plan.json."""
        return {
            "length": self.all.length,
            "turn": self.all.turn,
            "mean_speed": self.all.mean,
            "mean_turn": self.all.mean_turn,
            "totals": {"feed": asdict(self.feed), "rapid": asdict(self.rapid)},
            "limits": {share.limit: {"time": share.time, "part": share.part} for share in self.limits},
            "stops_by_cause": [asdict(stops) for stops in self.stops],
            "tolerance": {"least": self.tolerance[0], "greatest": self.tolerance[1]},
        }


def account(
    problem: Problem,
    profile: SpeedProfile,
    program: Program | None,
    jerk: bool,
    progress: Listener | None = None,
) -> Account:
    """The account of a profile on its path; `jerk` is true if the profile's method limits jerk."""
    path, motion = problem.path, problem.tool_motion
    lengths = motion.lengths
    tell(progress, 0.5)
    time = np.bincount(profile.piece.astype(np.int64), profile.duration, len(path))
    moments = activity(problem, profile, jerk, part(progress, 0.5, 0.95))

    def total(own: Any) -> Total:
        turns = own & motion.turns
        moved = own & ~motion.turns
        return Total(
            *(math.fsum(of.tolist()) for of in (time[own], lengths[moved], lengths[turns], time[turns])),
        )

    feed = np.isfinite(path.feed)
    tolerance = path.tolerance if len(path) else np.zeros(1)
    limits, slow = time_per_limit(problem, moments), slowest_lines(problem, profile, moments)
    tell(progress, 1.0)
    return Account(
        motion=motion,
        activity=moments,
        limits=tuple(limits),
        slow=tuple(slow),
        stops=tuple(stops_by_cause(problem, program, moments)),
        feed=total(feed),
        rapid=total(~feed),
        all=total(np.ones(len(path), dtype=bool)),
        tolerance=(float(tolerance.min()), float(tolerance.max())),
    )

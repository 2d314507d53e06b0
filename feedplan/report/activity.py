"""The active limit at moments of a plan, computed from the plan's states and the limits of its problem.

The use of a limit is value / limit. The active limit is the one with the greatest use, if this use is at
least `ACTIVE`; else no limit is active, and the motion is in a transition between limits. The result does not
depend on the method, because phase laws are not used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feedplan.arrays import Floats, Integers
from feedplan.constraints.problem import Problem, feed_square
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener, part, tell
from feedplan.report.limits import chord_speed, parameter_speed

# A limit is active from this use on.
ACTIVE = 0.95
NONE = "no limit active (transition)"

# The greatest number of moments in total, and in each phase.
_MOMENTS = 100_000
_MOMENTS_PER_PHASE = 33


@dataclass(frozen=True, eq=False)
class Activity:
    """Moments of a plan in motion, in order (m,).

    `weight` is the time that each moment represents [s]; `run`, `piece` and `position` (`path_position`) are
    its run, piece and position on the path; `speed` is the tool's [mm/s, deg/s where it only turns]; `active`
    is the index in `names` of the active limit; `pace` is speed / (speed that feed and axis velocities alone
    would allow).
    """

    names: tuple[str, ...]
    weight: Floats
    piece: NDArray[np.uint32]
    run: Integers
    speed: Floats
    active: Integers
    pace: Floats
    position: Integers

    def at(self, position: Integers) -> Integers:
        """Indices of the last moments at or before these positions on the path; 0 if there is none before."""
        return np.maximum(np.searchsorted(self.position, position, "right") - 1, 0)

    @property
    def lost(self) -> Floats:
        """The part of `weight` that would be saved at the speed that feed and axis velocities alone allow
        [s]."""
        return self.weight * np.maximum(1.0 - self.pace, 0.0)


def activity(
    problem: Problem,
    profile: SpeedProfile,
    jerk: bool,
    progress: Listener | None = None,
) -> Activity:
    """The activity of all limits; jerk limits are included if `jerk` is true."""
    time, weight, run = _moments(problem, profile)
    reader = profile.sampler(problem, part(progress, 0.0, 0.6))
    tell(progress, 0.6)
    states = reader.at(time)
    tell(progress, 0.8)
    _, _, velocity, acceleration, jerks, _, piece, u, *_ = states
    _, tangent, second = problem.curve.evaluate(piece, u, 2)
    tell(progress, 0.85)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = parameter_speed(tangent, velocity)
        feed = np.where(np.isfinite(problem.path.feed[piece]), problem.feed[piece], np.inf)
        at_feed = np.sqrt(feed_square(problem, piece, u)) * rate / feed
        chord = np.linalg.norm(velocity, axis=1) / chord_speed(problem, tangent, second)
        at_velocity = problem.use("velocity", velocity)
        groups = {"velocity": at_velocity, "acceleration": problem.use("acceleration", acceleration)}
        if jerk:
            groups["jerk"] = np.abs(jerks) / problem.max_jerk
        speed = problem.tool_motion.slope(piece, u) * rate
    tell(progress, 0.9)
    names = ("feed", "chord error", *(f"{axis} {name}" for name in groups for axis in problem.axes), NONE)
    use = np.nan_to_num(np.column_stack([at_feed, chord, *groups.values()]), posinf=0.0)
    # If the uses of several limits differ only by rounding, the first of these limits counts as active.
    most = use.max(axis=1, initial=0.0)
    active = np.where(most >= ACTIVE, (use >= most[:, None] * (1.0 - 1e-6)).argmax(axis=1), len(names) - 1)
    pace = np.column_stack([at_feed, at_velocity]).max(axis=1, initial=0.0)
    tell(progress, 1.0)
    position = path_position(problem, piece, u)
    return Activity(names, weight, piece, run, np.nan_to_num(speed), active, np.nan_to_num(pace), position)


def path_position(problem: Problem, piece: NDArray[np.integer], u: Floats) -> Integers:
    """Positions on a path as integers that increase along it: 2^20 for each piece."""
    part = u / problem.path.curve.width[piece]
    return np.asarray((piece.astype(np.int64) << 20) + np.round(part * ((1 << 20) - 1)).astype(np.int64))


def _moments(problem: Problem, profile: SpeedProfile) -> tuple[Floats, Floats, Integers]:
    """Times on the plan's clock, the time that each represents [s], and its run.

    Each phase is divided equally; if there are too many phases, the whole time is divided equally.
    """
    count = len(profile)
    if 0 < count <= _MOMENTS:
        parts = int(np.clip(_MOMENTS // count, 1, _MOMENTS_PER_PHASE))
        weight = np.repeat(profile.duration / parts, parts)
        start = np.repeat(np.cumsum(profile.duration) - profile.duration, parts)
        time = start + weight * (np.tile(np.arange(parts), count) + 0.5)
    else:
        weight = np.full(_MOMENTS if count else 0, profile.time / _MOMENTS)
        time = weight * (np.arange(len(weight)) + 0.5)
    ends = np.cumsum(profile.run_times)
    run = np.minimum(np.searchsorted(ends, time, side="right"), max(len(ends) - 1, 0))
    pauses = problem.path.start_dwell + np.cumsum(problem.path.dwell) - problem.path.dwell
    return time + pauses[run] if len(time) else time, weight, run

"""Audits a profile whose limits belong to joints that are not the path's axes.

Every arc is sampled at some ten places. Between two of them the acceleration of a joint is the difference of
its velocities over the time; what velocities and times may be wrong by is allowed for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from feedplan.audit.joint_jerk import audit_joint_jerk
from feedplan.audit.joint_motion import BY_WAY, Motion, motion
from feedplan.audit.joint_path import EPS, ROUNDINGS, TURN, Array, JointPath, Numbers
from feedplan.audit.worst import Worst
from feedplan.constraints.problem import Problem
from feedplan.profile import ArcKind, SpeedProfile

# What the pass mark allows beyond a limit.
EXCESS = 1e-6

# How far the end of an arc may lie from the start of the next, in mm of parameter.
GAP = 1e-9

# Arcs measured at once: the memory for their places stays below some 100 MB.
CHUNK = 4096

# The chord error is measured with tangents this share of the piece apart.
TANGENTS = 1e-4


def audit_joint_profile(
    problem: Problem,
    profile: SpeedProfile,
    jump: Array,
    travel: Array,
    progress: Callable[[float], None] = lambda done: None,
    jerk: bool = False,
) -> Worst:
    """Velocity, acceleration and jumps of the joints, feed, chord error, times and order of the arcs.

    `jump` (joints,) is what velocities may jump by at corners, `travel` (joints, 2). With `jerk` that of the
    joints too, and the jumps of their accelerations.
    """
    worst = Worst()
    # What is not a number, or too great for one, is found as such.
    with np.errstate(all="ignore"):
        good = _order(problem, profile, worst)
        starts = arc_starts(problem, profile)
        auditor = _Auditor(JointPath(problem), profile, jump, travel, starts, worst)
        for first in range(0, len(profile), CHUNK):
            arcs = np.arange(first, min(first + CHUNK, len(profile)))
            progress(first / len(profile))
            auditor.arcs(arcs[good[arcs]])
            if jerk:
                audit_joint_jerk(auditor.path, profile, arcs, good, starts, worst)
        auditor.finish()
    return worst


def arc_starts(problem: Problem, profile: SpeedProfile) -> Array:
    """When each arc begins and the last one ends, pauses included [s], (arcs + 1,)."""
    pauses = np.zeros(len(profile) + 1)
    pauses[0] = problem.path.start_dwell
    count = min(len(profile.runs) - 2, len(problem.path.dwell))
    inside = np.clip(profile.runs[1 : count + 1], 0, len(profile))
    np.add.at(pauses, inside, problem.path.dwell[: len(inside)])
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(np.cumsum(np.concatenate([[0.0], profile.duration]) + pauses))


def has_good_numbers(problem: Problem, profile: SpeedProfile) -> NDArray[np.bool_]:
    """Which arcs have numbers that can be measured (arcs,)."""
    path = problem.path
    good = (profile.piece < len(path)) & (profile.kind <= max(ArcKind))
    ends = (profile.u0, profile.u1, profile.p0, profile.p1, profile.a0, profile.a1)
    for column in (profile.value, profile.duration, *ends):
        good &= np.isfinite(column)
    good &= np.isin(profile.kind, BY_WAY) | ((profile.a0 == 0.0) & (profile.a1 == 0.0))
    good &= (profile.p0 >= 0.0) & (profile.p1 >= 0.0) & (profile.duration >= 0.0)
    needs = np.isin(profile.kind, (ArcKind.AXIS_ACCELERATION, ArcKind.AXIS_VELOCITY))
    return np.asarray(good & (~needs | (profile.axis < len(problem.axes))))


def _order(problem: Problem, profile: SpeedProfile, worst: Worst) -> NDArray[np.bool_]:
    """Numbers, and arcs that cover every piece in order; returns which arcs can be measured."""
    path = problem.path
    starts = arc_starts(problem, profile)[:-1]
    piece = np.minimum(profile.piece, max(len(path) - 1, 0)).astype(np.int64)
    line = path.line[piece] if len(path) else np.zeros(len(piece), np.int32)
    good = has_good_numbers(problem, profile)
    worst.offer("numbers", np.where(good, 0.0, np.inf), 0.0, starts, line)
    if not len(path):
        return good
    slack = 8.0 * EPS * path.width[piece]
    with np.errstate(invalid="ignore"):
        inside = (profile.u1 > profile.u0) & (profile.u0 >= 0.0) & (profile.u1 <= path.width[piece] + slack)
    worst.offer("order", np.where(inside | ~good, 0.0, np.inf), GAP, starts, line)
    good &= inside
    runs = profile.runs
    fits = len(runs) == len(path.runs) and runs[0] == 0 and runs[-1] == len(profile)
    if not (fits and (np.diff(runs) >= 0).all()):
        worst.offer("order", np.inf, GAP, 0.0, path.line[0])
        return good
    # Arc by arc the parameter from the start of the path; pieces passed over show as gaps.
    arcs_of = np.searchsorted(runs, np.arange(len(profile)), side="right") - 1
    first = np.isin(np.arange(len(profile)), runs[:-1])
    before = np.concatenate([[0], piece[:-1]])
    ended = np.concatenate([[0.0], profile.u1[:-1]])
    goes_on = ~first & (piece == before)
    follows = ~first & (piece == before + 1)
    begins = first & (piece == path.runs[arcs_of])
    with np.errstate(invalid="ignore"):
        gap = np.select(
            [goes_on, follows, begins],
            [
                np.abs(profile.u0 - ended),
                np.abs(profile.u0) + np.abs(path.width[before] - ended),
                np.abs(profile.u0),
            ],
            np.inf,
        )
    worst.offer("order", gap - 2.0 * slack, GAP, starts, line)
    for run in range(len(runs) - 1):
        last = runs[run + 1] - 1
        whole = path.runs[run] == path.runs[run + 1]
        if last >= runs[run]:
            end = path.runs[run + 1] - 1
            whole = piece[last] == end and path.width[end] - profile.u1[last] <= GAP + slack[last]
        if not whole:
            worst.offer("order", np.inf, GAP, starts[max(last, 0)], path.line[path.runs[run + 1] - 1])
    return good


class _Auditor:
    """What arcs show, chunk after chunk."""

    def __init__(
        self,
        path: JointPath,
        profile: SpeedProfile,
        jump: Array,
        travel: Array,
        starts: Array,
        worst: Worst,
    ) -> None:
        self.path, self.problem, self.profile = path, path.problem, profile
        self.jump, self.travel, self.starts, self.worst = jump, travel, starts, worst
        self.names = len(self.problem.axes)
        # Least and greatest position of the joints so far, angles continuous, with time and source line; the
        # position last seen.
        self.reach = np.full((2, self.names), np.nan)
        self.reached = np.zeros((2, self.names), [("time", float), ("line", int)])
        self.last: tuple[int, Array, Array] | None = None
        # What these angles are off by, in whole turns [deg]; not a number before a joint's turn is known.
        self.turns = np.full(self.names, np.nan)
        # The arc before the chunk: velocities of its end with their errors, speed, piece.
        self.before: tuple[int, Array, Array, float] | None = None

    def negligible(self, time: Array) -> Array:
        """Jumps of velocity that mean nothing (n, joints): what the pass mark adds in that time."""
        longest = np.maximum(time, self.problem.period)
        return np.asarray(EXCESS * self.problem.limits("acceleration").min(axis=0) * longest[:, None])

    def arcs(self, arcs: Numbers) -> None:
        """Offers what some arcs show."""
        if not len(arcs):
            return
        path, problem, profile, worst = self.path, self.problem, self.profile, self.worst
        state = motion(path, profile, arcs)
        piece = profile.piece[arcs].astype(np.int64)
        line = problem.path.line[piece][:, None]
        worst.samples += state.u.size
        clock = self.starts[arcs][:, None] + state.elapsed
        middle = 0.5 * (clock[:, 1:] + clock[:, :-1])
        velocity, error = state.velocity, state.velocity_error
        with np.errstate(all="ignore"):
            change, moved = np.diff(velocity, axis=1), np.diff(state.way, axis=1)
            acceleration = (np.abs(change) - error[:, 1:] - error[:, :-1]) / state.time[..., None]
            acceleration -= np.abs(acceleration) * state.time_error[..., None]
            mean = np.abs(moved) / state.time[..., None]
            unknown = 2.0 * ROUNDINGS * EPS * np.abs(state.position).max(axis=(1, 2))[:, None, None]
            mean -= unknown / state.time[..., None] + mean * state.time_error[..., None]
        # Places that rounding has put together have nothing between them.
        together = np.diff(state.u, axis=1) == 0.0
        acceleration[together] = mean[together] = 0.0
        limits = problem.limit("velocity", velocity), problem.limit("velocity", moved)
        strength = problem.limit("acceleration", change)
        for k in range(self.names):
            size = np.abs(velocity[:, :, k]) - error[:, :, k]
            worst.offer("velocity", size, limits[0][:, :, k], clock, line, k)
            worst.offer("velocity", mean[:, :, k], limits[1][:, :, k], middle, line, k)
            worst.offer("acceleration", acceleration[:, :, k], strength[:, :, k], middle, line, k)
        self._tip(state, piece, clock, line)
        self._durations(state, line[:, 0])
        self._ends(state, piece, line[:, 0])
        self._reach(state, piece, clock, line)

    def _tip(self, state: Motion, piece: Numbers, clock: Array, line: NDArray[np.int32]) -> None:
        """Feed and chord error of the tip."""
        problem, count = self.problem, state.u.shape[1]
        many = np.repeat(piece, count)
        speed = self.path.feed_slope(many, state.u.ravel()).reshape(state.u.shape)
        with np.errstate(all="ignore"):
            size = np.linalg.norm(state.velocity_error, axis=2) / np.linalg.norm(state.velocity, axis=2)
            speed = speed * state.root_p * (1.0 - np.nan_to_num(size, posinf=0.0) - ROUNDINGS * EPS)
        self.worst.offer("feed", speed, problem.feed[piece][:, None], clock, line)
        if np.isfinite(problem.chord_tolerance):
            curvature = self._curvature(many, state.u.ravel()).reshape(state.u.shape)
            half = 0.5 * speed * problem.period
            reach = half * curvature
            with np.errstate(invalid="ignore"):
                sagitta = np.where(reach < 1.0, half * reach / (1.0 + np.sqrt(1.0 - reach**2)), half)
            linear = self.path.feed_axes[piece] & np.array([n in ("X", "Y", "Z") for n in problem.path.axes])
            sagitta = np.where(linear.any(axis=1)[:, None], sagitta, 0.0)
            self.worst.offer("chord", sagitta, problem.chord_tolerance, clock, line)

    def _curvature(self, piece: Numbers, u: Array) -> Array:
        """Turn of the tip's direction over the way (n,), between two places of the piece."""
        width = self.problem.path.width[piece]
        step = TANGENTS * width
        centre = np.clip(u, step, width - step)
        sides = []
        for at in (centre - step, centre, centre + step):
            slope = np.where(self.path.feed_axes[piece], self.path.tip(piece, at)[1], 0.0)
            sides.append(slope)
        with np.errstate(all="ignore"):
            directions = [side / np.linalg.norm(side, axis=1)[:, None] for side in (sides[0], sides[2])]
            turn = np.linalg.norm(directions[1] - directions[0], axis=1)
            way = 2.0 * step * np.linalg.norm(sides[1], axis=1)
            return np.asarray(np.nan_to_num(np.maximum(turn - ROUNDINGS * EPS, 0.0) / way, posinf=0.0))

    def _durations(self, state: Motion, line: NDArray[np.int32]) -> None:
        with np.errstate(all="ignore"):
            total = state.time.sum(axis=1)
            doubt = (state.time * state.time_error).sum(axis=1) / total
            error = np.abs(self.profile.duration[state.arcs] - total) / total - doubt
        self.worst.offer("duration", error, EXCESS, self.starts[state.arcs], line)

    def _ends(self, state: Motion, piece: Numbers, line: NDArray[np.int32]) -> None:
        """Recorded p against the law's, and what jumps from arc to arc."""
        profile, problem, worst = self.profile, self.problem, self.worst
        arcs = state.arcs
        duration = profile.duration[arcs]
        roots = np.sqrt(np.stack([profile.p0[arcs], profile.p1[arcs]], axis=1))
        ends = [0, state.u.shape[1] - 1]
        recorded, doubt = [], []
        for side, end in enumerate(ends):
            slope, error = state.slope[:, end], state.slope_error[:, end]
            recorded.append(slope * roots[:, side, None])
            doubt.append(error * roots[:, side, None] + ROUNDINGS * EPS * np.abs(recorded[side]))
            with np.errstate(invalid="ignore"):
                away = np.abs(state.velocity[:, end] - recorded[side])
                away -= doubt[side] + state.velocity_error[:, end]
            # Where the arc's own joint stands the other joints have no velocity to compare.
            away = np.where(roots[:, side, None] == state.root_p[:, end, None], 0.0, away)
            time = self.starts[arcs] + side * duration
            for k in range(self.names):
                worst.offer("jump", away[:, k], self.negligible(duration)[:, k], time, line, k)
        tip = [self.path.feed_slope(piece, state.u[:, end]) for end in ends]
        speeds = [tip[side] * roots[:, side] for side in (0, 1)]
        # To the arc before, of this chunk or of the one before it.
        if self.before is None:
            index, old_velocity, old_doubt, old_speed = -2, recorded[1][0], doubt[1][0], speeds[1][0]
        else:
            index, old_velocity, old_doubt, old_speed = self.before
        arc_before = np.concatenate([[index], arcs[:-1]])
        velocity = np.concatenate([old_velocity[None], recorded[1][:-1]])
        unknown = np.concatenate([old_doubt[None], doubt[1][:-1]])
        speed = np.concatenate([[old_speed], speeds[1][:-1]])
        joined = (arc_before == arcs - 1) & ~np.isin(arcs, profile.runs)
        before = profile.piece[np.maximum(arcs - 1, 0)].astype(np.int64)
        corner = (piece != before) & joined
        # Where the feed is about other axes the speed is another quantity.
        alike = (self.path.feed_axes[piece] == self.path.feed_axes[before]).all(axis=1)
        jump = np.where(joined[:, None], np.abs(recorded[0] - velocity) - doubt[0] - unknown, 0.0)
        limit = corner[:, None] * self.jump + self.negligible(duration)
        for k in range(self.names):
            worst.offer("jump", jump[:, k], limit[:, k], self.starts[arcs], line, k)
        rounding = ROUNDINGS * EPS * (speed + speeds[0])
        slack = self.slow(duration, tip[0], state.slope[:, 0])
        steps = np.where(corner & alike, np.abs(speeds[0] - speed) - rounding, 0.0)
        worst.offer("continuity", steps, slack, self.starts[arcs], line)
        over = np.where(corner, np.maximum(speeds[0], speed) - rounding, 0.0)
        worst.offer("junction", over, problem.junction_speed[piece] + slack, self.starts[arcs], line)
        self._run_ends(arcs, speeds, slack, line)
        self.before = int(arcs[-1]), recorded[1][-1], doubt[1][-1], float(speeds[1][-1])

    def slow(self, duration: Array, tip: Array, slope: Array) -> Array:
        """Jumps of the tip's speed that mean nothing to any joint (n,)."""
        with np.errstate(all="ignore"):
            shares = self.negligible(duration) / np.abs(slope) * tip[:, None]
        least = np.min(np.where(np.isfinite(shares), shares, np.inf), axis=1)
        period = EXCESS * float(self.problem.limits("acceleration").min()) * self.problem.period
        return np.asarray(np.where(np.isfinite(least), np.maximum(least, period), period))

    def _run_ends(self, arcs: Numbers, speeds: list[Array], slack: Array, line: NDArray[np.int32]) -> None:
        """Speeds at the ends of runs: at rest, but for the ends of the path."""
        profile, problem = self.profile, self.problem
        count = len(profile)
        at_start, at_end = np.isin(arcs, profile.runs[:-1]), np.isin(arcs + 1, profile.runs[1:])
        wanted = [np.where(arcs == 0, problem.start_speed, 0.0)]
        wanted.append(np.where(arcs + 1 == count, problem.end_speed, 0.0))
        for side, here in enumerate((at_start, at_end)):
            off = np.where(here, np.abs(speeds[side] - wanted[side]), 0.0)
            off -= ROUNDINGS * EPS * (speeds[side] + wanted[side])
            time = self.starts[arcs] + side * profile.duration[arcs]
            self.worst.offer("junction", off, slack, time, line)

    def _reach(self, state: Motion, piece: Numbers, clock: Array, line: NDArray[np.int32]) -> None:
        """Positions so far, angles continuous from arc to arc."""
        first = state.position[:, 0]
        if self.last is None:
            offset = first[0]
        else:
            number, position, seen = self.last
            before = np.array([number])
            offset = seen + self.path.between(piece[:1], position[None], first[:1], before)[0]
        steps = self.path.between(piece[1:], state.position[:-1, -1], first[1:], piece[:-1])
        ways = state.way[:-1, -1] + steps
        begin = offset + np.concatenate([np.zeros((1, self.names)), np.cumsum(ways, axis=0)])
        # Angles known up to whole turns are those that they are where they are known.
        known = ~self.path.turning[self.path.run[piece]] & np.isnan(self.turns)
        for k in np.flatnonzero(known.any(axis=0)):
            row = int(known[:, k].argmax())
            self.turns[k] = TURN * np.round((first[row, k] - begin[row, k]) / TURN)
        positions = begin[:, None] + state.way
        flat, times = positions.reshape(-1, self.names), clock.ravel()
        lines = np.broadcast_to(line, clock.shape).ravel()
        for end, sign in enumerate((-1.0, 1.0)):
            at = np.where(np.isnan(flat), -np.inf, sign * flat).argmax(axis=0)
            value = flat[at, np.arange(self.names)]
            with np.errstate(invalid="ignore"):
                farther = ~(sign * value <= sign * self.reach[end])
            self.reach[end, farther] = value[farther]
            self.reached["time"][end, farther] = times[at[farther]]
            self.reached["line"][end, farther] = lines[at[farther]]
        self.last = int(piece[-1]), state.position[-1, -1], positions[-1, -1]

    def finish(self) -> None:
        """The travel; angles that are known up to whole turns everywhere on the turn that suits them best."""
        for k in range(self.names):
            lower, upper = (float(bound) for bound in self.travel[k])
            least, most = (float(q) for q in self.reach[:, k])
            if not (np.isfinite(upper - lower) and np.isfinite(most - least)):
                continue
            middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
            turns = float(self.turns[k])
            if np.isnan(turns):
                turns = TURN * np.round((middle - 0.5 * (least + most)) / TURN)
            least, most = least + turns, most + turns
            end = int(most - middle > middle - least)
            value, bound = (most, upper) if end else (least, lower)
            ratio = (abs(value - middle) - 2.0 * ROUNDINGS * EPS * abs(value)) / half
            time, line = self.reached[end, k].item()
            self.worst.offer_ratio("travel", value, bound, ratio, time, line, k)

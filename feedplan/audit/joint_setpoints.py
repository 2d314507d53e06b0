"""The places of joint setpoints on the path of the tool tip, and when the profile is there.

A setpoint is compared with K(C(u)): u on the arc that the profile is on at its time, moved along it until no
nearer place is found. How far the setpoint stays off is one error, how far the profile gets between the time
of the setpoint and being at that place the other. The clock starts every run anew: setpoints may wait at a
stop for their next period.
"""

from __future__ import annotations

import numpy as np

from feedplan.audit.joint_motion import motion
from feedplan.audit.joint_path import EPS, ROUNDINGS, Array, JointPath, Numbers
from feedplan.audit.joint_profile import arc_starts, has_good_numbers
from feedplan.audit.worst import Worst
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.setpoints import SetpointChunk

# How far a setpoint may lie from its place beyond rounding [mm, deg], and as a share of its step.
PLACE, STEP_SHARE = 1e-6, 1e-6

# What times may be off, as a share of the period.
UNEVEN = 1e-6

# A recorded velocity may differ from the profile's by this share of what one period of acceleration changes.
VELOCITY_SHARE = 1e-3

# Setpoints looked at together, steps towards the nearest place, and how far apart the places that a step is
# told from are, as a share of the arc.
BLOCK, MOST_STEPS, NEARBY = 8192, 12, 1e-6

# Time, position, piece, u and tip of a setpoint.
Row = tuple[float, Array, int, float, Array]


class JointSetpoints:
    """Looks at setpoints chunk by chunk; what two chunks share is kept, nothing else."""

    def __init__(self, problem: Problem, profile: SpeedProfile, jump: Array, period: float) -> None:
        self.problem, self.profile, self.jump, self.period = problem, profile, jump, period
        self.path = JointPath(problem)
        # What accelerations are at most in one direction, and in both (joints,).
        self.strongest = problem.limits("acceleration").max(axis=0)
        self.both_ways = problem.limits("acceleration").min(axis=0)
        self.worst = Worst()
        self.starts = arc_starts(problem, profile)
        runs = problem.path.runs
        count = len(profile)
        same = len(profile.runs) == len(runs) and profile.runs[0] == 0 and profile.runs[-1] == count
        good = count > 0 and same and bool((np.diff(profile.runs) > 0).all())
        self.usable = good and bool(has_good_numbers(problem, profile).all())
        self.usable &= bool(
            (profile.u1 > profile.u0).all() and (np.diff(profile.piece.astype(int)) >= 0).all()
        )
        # When the runs began, as far as the setpoints have shown.
        self.clock: list[float] = []
        self.held: SetpointChunk | None = None
        # Row before the block: time, position, piece, u, tip.
        self.last: Row | None = None
        if not self.usable:
            self.worst.offer("place", np.inf, PLACE, 0.0, 0)

    def push(self, chunk: SetpointChunk) -> None:
        """The next setpoints; the last of them waits for the next chunk."""
        if not self.usable or not len(chunk.t):
            return
        rows = chunk if self.held is None else _joined(self.held, chunk)
        with np.errstate(all="ignore"):
            self._take(rows, len(rows.t) - 1)
        self.held = _part(rows, len(rows.t) - 1, len(rows.t))

    def finish(self) -> Worst:
        """The last setpoint must be the end of the path."""
        if self.usable and self.held is not None:
            with np.errstate(all="ignore"):
                self._take(self.held, len(self.held.t), last=True)
            piece = np.array([len(self.problem.path) - 1])
            end = self.path.at(piece, self.problem.path.width[piece])
            away = self._off(piece, self.held.position[-1:], end)
            line = self.problem.path.line[-1]
            self.worst.offer("place", away, PLACE, self.held.t[-1], line)
        elif self.usable:
            self.worst.offer("place", np.inf, PLACE, 0.0, 0)
        return self.worst

    def _off(self, piece: Numbers, position: Array, place: Array) -> Array:
        """Distance (n,) of positions from places, less rounding; the same angle on whichever turn."""
        away = np.linalg.norm(self.path.between(piece, place, position), axis=1)
        return np.asarray(away - self._rounding(piece, np.maximum(np.abs(position), np.abs(place))))

    def _rounding(self, piece: Numbers, position: Array) -> Array:
        """What rounding makes of a distance (n,): relative to the greatest coordinate of joints and tip."""
        curve = self.problem.path.curve
        first = np.abs(curve.control_points[curve.offsets[piece]]).max(axis=1)
        size = np.maximum(np.abs(position).max(axis=1), first)
        return np.asarray(ROUNDINGS * EPS * np.sqrt(position.shape[1]) * size)

    def _take(self, rows: SetpointChunk, count: int, last: bool = False) -> None:
        if self.last is None and len(rows.t):
            start = self.path.at(np.zeros(1, np.int64), np.zeros(1))
            away = self._off(np.zeros(1, np.int64), rows.position[:1], start)
            line = self.problem.path.line[0]
            self.worst.offer("place", away, PLACE, rows.t[0], line)
            self.worst.offer("grid", abs(float(rows.t[0])), UNEVEN * self.period, rows.t[0], line)
        self._extend_clock(rows, last)
        for first in range(0, count, BLOCK):
            self._block(_part(rows, first, min(first + BLOCK, count)))

    def _due(self, run: int) -> float:
        """When a run is due to begin."""
        if run == 0:
            return self.problem.path.start_dwell
        first, end = self.profile.runs[run - 1], self.profile.runs[run]
        last = end - 1
        motion_time = self.starts[last] + self.profile.duration[last] - self.starts[first]
        return float(self.clock[run - 1] + motion_time + self.problem.path.dwell[run - 1])

    def _extend_clock(self, rows: SetpointChunk, last: bool) -> None:
        """Adds the starts of the runs that the rows reach: at the next row where they stand on the stop."""
        path = self.problem.path
        while len(self.clock) < len(self.profile.runs) - 1:
            run = len(self.clock)
            due = self._due(run)
            slack = UNEVEN * self.period + ROUNDINGS * EPS * due
            n = int(np.searchsorted(rows.t, due - slack))
            left = len(rows.t) - n
            if left == 0:
                break
            piece = np.array([path.runs[run]])
            stop = self.path.at(piece, np.zeros(1))

            def stands(row: int, piece: Numbers = piece, stop: Array = stop) -> bool:
                return bool(self._off(piece, rows.position[row : row + 1], stop)[0] <= 1e-9)

            on_time = rows.t[n] <= due + slack
            if left == 1 and on_time and not last:
                break
            if left > 1 and on_time and stands(n + 1):
                self.clock.append(float(rows.t[n + 1]))
            else:
                self.clock.append(float(rows.t[n]) if stands(n) else due)

    def _arcs(self, t: Array) -> tuple[Numbers, Array]:
        """The arc that each time falls into, and the time since the arc began."""
        clock = np.array(self.clock) if self.clock else np.full(1, self.problem.path.start_dwell)
        run = np.clip(np.searchsorted(clock, t, side="right") - 1, 0, None)
        first, end = self.profile.runs[run], self.profile.runs[run + 1]
        own = t - (clock[run] - self.starts[first])
        arc = np.clip(np.searchsorted(self.starts[:-1], own, side="right") - 1, first, end - 1)
        return arc, own - self.starts[arc]

    def _block(self, rows: SetpointChunk) -> None:
        problem, worst, profile = self.problem, self.worst, self.profile
        arc, since = self._arcs(np.nan_to_num(rows.t))
        since = np.clip(since, 0.0, profile.duration[arc])
        piece = profile.piece[arc].astype(np.int64)
        line = problem.path.line[piece]
        finite = np.isfinite(rows.t) & np.isfinite(rows.position).all(axis=1)
        worst.offer("numbers", np.where(finite, 0.0, np.inf), 0.0, rows.t, line)
        target = np.where(finite[:, None], rows.position, 0.0)
        u, place = self._nearest(arc, since, target)
        off = self._off(piece, target, place)
        worst.offer("place", np.where(finite, off, np.inf), PLACE, rows.t, line)
        state = motion(self.path, profile, arc, np.stack([profile.u0[arc], u, profile.u1[arc]], axis=1))
        velocity, error = state.velocity[:, 1], state.velocity_error[:, 1]
        with np.errstate(all="ignore"):
            wait = np.abs(state.time[:, 0] - since)
            wait -= np.nan_to_num(state.time[:, 0] * state.time_error[:, 0])
            wait -= EPS * np.abs(rows.t) * (arc + ROUNDINGS)
            wait = np.maximum(wait, 0.0)
            acceleration = float(np.linalg.norm(self.strongest))
            late = wait * (np.linalg.norm(velocity, axis=1) + 0.5 * wait * acceleration)
        tip = self.path.tip(piece, u)[0]
        before = (rows.t[0], rows.position[0], piece[0], u[0], tip[0]) if self.last is None else self.last
        self.last = rows.t[-1], rows.position[-1].copy(), int(piece[-1]), float(u[-1]), tip[-1]
        earlier = np.concatenate([before[1][None], rows.position[:-1]])
        step = np.linalg.norm(self.path.between(piece, earlier, target), axis=1)
        allowed = np.maximum(PLACE, STEP_SHARE * step)
        worst.offer("place", late, allowed, rows.t, line)
        self._recorded(rows, piece, u, velocity, error, off, late)
        self._steps(rows.t, before, piece, u, tip, off)
        worst.samples += len(rows.t)

    def _nearest(self, arc: Numbers, since: Array, target: Array) -> tuple[Array, Array]:
        """The place (n,) of its arc that each position is nearest to, and the joints there."""
        profile = self.profile
        piece = profile.piece[arc].astype(np.int64)
        low, high = profile.u0[arc], profile.u1[arc]
        near, far = np.sqrt(profile.p0[arc]), np.sqrt(profile.p1[arc])
        with np.errstate(all="ignore"):
            x = np.clip(since / profile.duration[arc], 0.0, 1.0)
            share = np.nan_to_num(x * (2.0 * near + (far - near) * x) / (near + far), nan=0.5)
        u = np.clip(low + (high - low) * share, low, high)
        place = self.path.at(piece, u)
        away = np.linalg.norm(self.path.between(piece, place, target), axis=1)
        step = NEARBY * (high - low)
        # No place is known more closely: next to rest it would be passed at another time.
        known = self._rounding(piece, target)
        for _ in range(MOST_STEPS):
            side = np.where(u + step > high, -step, step)
            slope = self.path.between(piece, place, self.path.at(piece, u + side)) / side[:, None]
            with np.errstate(all="ignore"):
                move = (self.path.between(piece, place, target) * slope).sum(axis=1) / (slope**2).sum(axis=1)
            new = np.clip(u + np.nan_to_num(move), low, high)
            there = self.path.at(piece, new)
            distance = np.linalg.norm(self.path.between(piece, there, target), axis=1)
            better = distance + known < away
            if not better.any():
                break
            u, away = np.where(better, new, u), np.where(better, distance, away)
            place = np.where(better[:, None], there, place)
        return u, place

    def _recorded(
        self,
        rows: SetpointChunk,
        piece: Numbers,
        u: Array,
        velocity: Array,
        error: Array,
        off: Array,
        late: Array,
    ) -> None:
        """Recorded velocities against the profile's, where the setpoint is on its place."""
        problem = self.problem
        if rows.velocity.shape != rows.position.shape:
            return
        rest = problem.path.width[piece] - u
        at_joint = np.minimum(u, rest) <= PLACE
        away = np.maximum(off, 0.0) + late + ROUNDINGS * EPS * np.abs(rows.position).max(axis=1)
        good = (off <= PLACE) & np.isfinite(velocity).all(axis=1)
        for k, (most, both) in enumerate(zip(self.strongest, self.both_ways, strict=True)):
            # From rest, a place known to `away` is passed at a speed known to this.
            unknown = np.sqrt(2.0 * most * away) + error[:, k]
            value = np.where(good, np.abs(rows.velocity[:, k] - velocity[:, k]) - unknown, 0.0)
            limit = VELOCITY_SHARE * both * self.period + np.where(at_joint, self.jump[k], 0.0)
            self.worst.offer("recorded_velocity", value, limit, rows.t, problem.path.line[piece], k)

    def _steps(self, t: Array, before: Row, piece: Numbers, u: Array, tip: Array, off: Array) -> None:
        """Speed and chord error of the tip from each setpoint to the next."""
        problem, path = self.problem, self.path
        t0 = np.concatenate([[before[0]], t[:-1]])
        piece0 = np.concatenate([[before[2]], piece[:-1]])
        u0 = np.concatenate([[before[3]], u[:-1]])
        tip0 = np.concatenate([before[4][None], tip[:-1]])
        time = t - t0
        is_step = (time > 0.0) & (time <= 2.0 * self.period) & (piece - piece0 <= 1) & (piece >= piece0)
        line = problem.path.line[piece]
        crosses = piece != piece0
        # To the end of the piece before, and from the start of this one, whose words may mean another thing.
        until = np.where(crosses, problem.path.width[piece0], u)
        since = np.where(crosses, 0.0, u)
        parts = [
            (piece0, tip0, path.tip(piece0, until)[0]),
            (piece, path.tip(piece, since)[0], tip),
        ]
        rounding = ROUNDINGS * EPS * np.maximum(np.abs(tip), np.abs(tip0)).max(axis=1)
        way, least = np.zeros(len(t)), np.zeros(len(t))
        for number, start, end in parts:
            step = np.maximum(path.feed_way(number, start, end) - 2.0 * rounding, 0.0)
            way, least = way + step, least + step / problem.feed[number]
        with np.errstate(all="ignore"):
            speed = np.where(is_step, way / time, 0.0)
            feed = np.where(way > 0.0, way / least, problem.feed[piece])
        self.worst.offer("feed", speed, feed, t, line)
        if not np.isfinite(problem.chord_tolerance):
            return
        # From one run to the next the tool stands still: each side has a chord of its own.
        stops = (path.run[piece] != path.run[piece0])[:, None]
        chords = [
            (piece0, u0, until, tip0, np.where(stops, parts[0][2], tip)),
            (piece, np.where(crosses, 0.0, u0), u, np.where(stops, parts[1][1], tip0), tip),
        ]
        error = np.zeros(len(t))
        for number, start, end, from_, to in chords:
            named = [name in ("X", "Y", "Z") for name in problem.path.axes]
            linear = path.feed_axes[number] & np.array(named)
            for share in (0.25, 0.5, 0.75, 1.0):
                point = path.tip(number, start + share * (end - start))[0]
                error = np.maximum(error, _from_chord(point * linear, from_ * linear, to * linear))
            length = np.linalg.norm((to - from_) * linear, axis=1)
        with np.errstate(all="ignore"):
            before_length = np.concatenate([length[:1], length[:-1]])
            after_length = np.concatenate([length[1:], length[-1:]])
            # The limit is that of a circle: where the tip gains speed the path leans to one end of the chord.
            gain = np.maximum(np.abs(length - before_length), np.abs(after_length - length)) / length
        error = np.where(is_step, error - rounding - np.maximum(off, 0.0), 0.0)
        limit = problem.chord_tolerance * (1.0 + 0.5 * np.clip(np.nan_to_num(gain), 0.0, 1.0))
        self.worst.offer("chord", error, limit, t, line)


def _from_chord(point: Array, start: Array, end: Array) -> Array:
    """Distance (n,) of points from straight lines, ends included."""
    along, to = end - start, point - start
    with np.errstate(all="ignore"):
        share = np.nan_to_num((to * along).sum(axis=1) / (along**2).sum(axis=1))
    share = np.clip(share, 0.0, 1.0)
    return np.asarray(np.linalg.norm(to - share[:, None] * along, axis=1))


def _part(rows: SetpointChunk, first: int, end: int) -> SetpointChunk:
    """Some rows; what is not compared is left out."""
    columns = (rows.t, rows.position, rows.velocity)
    t, position, velocity = (column[first:end] for column in columns)
    empty = np.empty((0, position.shape[1]))
    return SetpointChunk(t, position, velocity, empty, empty, np.empty(0, np.int32), rows.axes)


def _joined(before: SetpointChunk, after: SetpointChunk) -> SetpointChunk:
    t, position, velocity = (
        np.concatenate([getattr(part, name) for part in (before, after)])
        for name in ("t", "position", "velocity")
    )
    empty = np.empty((0, position.shape[1]))
    return SetpointChunk(t, position, velocity, empty, empty, np.empty(0, np.int32), after.axes)

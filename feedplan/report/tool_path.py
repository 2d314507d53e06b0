"""Reduces the tool path to the few points (with speeds) that a page draws, in one pass over the setpoints."""

from __future__ import annotations

from typing import Any

import numpy as np

from feedplan.arrays import Floats
from feedplan.constraints.problem import Problem
from feedplan.report.activity import Activity, path_position
from feedplan.report.limits import parameter_speed
from feedplan.report.reduce import Polyline
from feedplan.setpoints import SetpointChunk

# The greatest number of points of the tool path in a report.
POINTS = 60_000
# The greatest number of points in the service's page, which gets them uncompressed.
MANY_POINTS = 500_000

# Allowed deviation of the drawn tool path as a share of its extent: a tenth of a pixel before zooming.
_TOLERANCE = 1e-4
# The least allowed deviation, for zooming.
_FINEST = 1e-5
# Allowed deviation of the drawn speed as a share of the top speed, for a path with the deviation
# `_TOLERANCE`.
_SPEED_TOLERANCE = 0.01


class ToolPath:
    """Takes all setpoints chunk by chunk; at most `points` points are kept."""

    def __init__(self, problem: Problem, points: int = POINTS) -> None:
        self._axes = problem.axes
        self._problem, self._motion = problem, problem.tool_motion
        self._linear = [self._axes.index(name) for name in "XYZ" if name in self._axes]
        columns = [column for column, name in enumerate(problem.path.axes) if name in ("X", "Y", "Z")]
        # Column by column, so that the points are not copied.
        control = problem.path.curve.control_points
        sides = [np.ptp(control[:, column]) for column in columns if len(control)]
        extent = float(np.linalg.norm(sides)) or 1.0
        cut = problem.feed[np.isfinite(problem.path.feed)]
        top = float((cut if len(cut) else problem.feed).max(initial=0.0)) or 1.0
        self._speed_weight = _TOLERANCE * extent / (_SPEED_TOLERANCE * top)
        self._overview = _TOLERANCE * extent
        self._path = Polyline(points, (_TOLERANCE if points <= POINTS else _FINEST) * extent)
        self._length, self._before = 0.0, (0.0, 0.0)
        self._marks: list[list[float]] = []
        self._is_cut = np.isfinite(problem.path.feed)
        self._top = self._cutting = 0.0

    def add(self, chunk: SetpointChunk) -> Floats:
        """Takes the next setpoints; returns the tool's speed at each, in drawn units per second."""
        points, speed = self._tool(chunk)
        if len(chunk) == 0:
            return speed
        length = self._lengths(chunk.t, speed)
        weighted = np.column_stack((points, self._speed_weight * speed))
        self._path.add(weighted, chunk.line, chunk.t, length, chunk.piece, chunk.u)
        top = float(speed.max())
        self._top = max(self._top, top)
        if top > self._cutting:
            self._cutting = max(self._cutting, float(speed[self._is_cut[chunk.piece]].max(initial=0.0)))
        return speed

    def mark(self, chunk: SetpointChunk, time: float) -> None:
        """Marks the tool's position at the first setpoint of a chunk at or after a time [s]."""
        points, _ = self._tool(chunk)
        self._marks.append(points[min(int(np.searchsorted(chunk.t, time)), len(chunk) - 1)].tolist())

    def data(self, activity: Activity, points: int | None = None) -> dict[str, Any]:
        """Points in X, Y, Z with their values, and the marks; at most `points` if given.

        The values at each point: `speed`, source `line`, `time` [s], `length` up to it, programmed `feed` (0:
        rapid), the number of the `active` limit in `limits`, and `lost`, the part of the time (0 to 255) that
        would be saved at the speed that feed and axis velocities alone allow. `tolerance` is the greatest
        deviation of the line [mm]. `cutting_speed` is the greatest speed on moves with a feed, the top of the
        colour scale. `unit` is that of the length: mm, or deg if only rotary axes move.
        """
        kept, tags, tolerance = self._path.result(points, 0.0 if points is None else self._overview)
        empty: Any = np.empty((5, 0), np.int64)
        line, t, length, piece, u = tags or empty
        feed = self._problem.path.feed[piece]
        moment = activity.at(path_position(self._problem, piece, u))
        known = len(activity.weight) > 0
        return {
            **{name: kept[:, k] for k, name in enumerate("xyz")},
            "speed": kept[:, 3] / self._speed_weight,
            "line": line,
            "time": t.round(6),
            "length": length.round(6),
            "feed": np.where(np.isfinite(feed), self._problem.feed[piece], 0.0),
            "active": (activity.active[moment] if known else moment).astype(np.uint8),
            "lost": np.round(
                255.0 * np.clip(1.0 - activity.pace[moment] if known else 0.0 * moment, 0.0, 1.0)
            ).astype(np.uint8),
            "limits": list(activity.names),
            "unit": self._motion.unit,
            "cutting_speed": self._cutting or self._top,
            "marks": self._marks,
            "tolerance": tolerance,
        }

    def _lengths(self, t: Floats, speed: Floats) -> Floats:
        """The length up to each setpoint, by the trapezoid rule."""
        before, last = self._before
        steps = np.diff(t, prepend=before) * 0.5 * (speed + np.concatenate(([last], speed[:-1])))
        length = self._length + np.cumsum(steps)
        self._length, self._before = float(length[-1]), (float(t[-1]), float(speed[-1]))
        return np.asarray(length)

    def _tool(self, chunk: SetpointChunk) -> tuple[Floats, Floats]:
        """The tool's position in X, Y, Z and its speed in drawn units; 0 where it only turns."""
        problem, motion = self._problem, self._motion
        if problem.tip_curve is not None and problem.joints is not None:
            (points,) = problem.tip_curve.evaluate(chunk.piece, chunk.u)
            tangent = problem.joints.evaluate(chunk.piece, chunk.u, 1)[1]
            speed = motion.slope(chunk.piece, chunk.u) * parameter_speed(tangent, chunk.velocity)
        else:
            points = np.zeros((len(chunk), 3))
            for column in self._linear:
                points[:, "XYZ".index(self._axes[column])] = chunk.position[:, column]
            counts = 1.0 if motion.share is None else motion.share[chunk.piece]
            speed = np.linalg.norm(chunk.velocity * counts, axis=1)
        return points, speed if motion.drawn.all() else speed * motion.drawn[chunk.piece]

"""What the charts of the page show, reduced while the setpoints pass by once."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.audit import Audit
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.report.limits import limit_samples, samples_per_arc
from feedplan.report.reduce import Envelope, Polyline
from feedplan.setpoints import SetpointChunk

# Points kept. The page draws at most a few thousand of them at once and takes the finer ones on zooming in.
_TIME_POINTS = 240_000  # of all curves over time together
_TIME_POINTS_PER_CURVE = 24_000
_LENGTH_POINTS = 12_000  # of each curve over length
_MEAN_POINTS = 1_000  # of the mean of each curve, drawn where it oscillates too fast for a line
_PATH_POINTS = 60_000

# The tool path may be drawn this far beside itself, as a part of its extent: a tenth of a pixel at first.
_PATH_TOLERANCE = 1e-4
# A difference in speed weighs like one of length: this part of the top speed like `_PATH_TOLERANCE`.
_SPEED_TOLERANCE = 0.01


def packed(array: NDArray[Any]) -> dict[str, str]:
    """An array as the page reads it: base64 of 32-bit numbers, little-endian."""
    if array.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return {"f4": base64.b64encode(array.astype("<f4").tobytes()).decode()}
    return {"i4": base64.b64encode(array.astype("<i4").tobytes()).decode()}


class SetpointFigures:
    """Takes all setpoints chunk by chunk; holds the curves over time and the tool path.

    `count` setpoints will come; `marks` are times [s] whose place on the tool path is wanted.
    """

    def __init__(self, problem: Problem, count: int, marks: Sequence[float] = ()) -> None:
        self._axes = problem.axes
        self._problem = problem
        columns = 1 + 3 * len(self._axes)
        self._curves = Envelope(count, min(_TIME_POINTS_PER_CURVE, _TIME_POINTS // columns))
        self._linear = [self._axes.index(name) for name in "XYZ" if name in self._axes]
        columns_of_tool = [column for column, name in enumerate(problem.path.axes) if name in "XYZ"]
        low = problem.path.curve.control_points[:, columns_of_tool]
        extent = float(np.linalg.norm(np.ptp(low, axis=0))) if low.size else 0.0
        tolerance = _PATH_TOLERANCE * extent if extent > 0 else 1.0
        cut = problem.feed[np.isfinite(problem.path.feed)]
        top = float((cut if len(cut) else problem.feed).max(initial=0.0)) or 1.0
        self._speed_weight = tolerance / (_SPEED_TOLERANCE * top)
        self._path = Polyline(_PATH_POINTS, tolerance)
        self._marks = np.asarray(marks, dtype=np.float64)
        self._mark_places = np.full((len(self._marks), 3), np.nan)
        self.count = 0
        self.duration = 0.0

    def add(self, chunk: SetpointChunk) -> None:
        """The next setpoints."""
        if len(chunk.t) == 0:
            return
        places, speed = self._tool(chunk)
        curves = np.column_stack((speed, chunk.velocity, chunk.acceleration, chunk.jerk))
        line = chunk.line.astype(np.int64)
        self._curves.add(chunk.t, curves, line)
        self._path.add(np.column_stack((places, self._speed_weight * speed)), line)
        near = np.searchsorted(chunk.t, self._marks)
        inside = (self._marks <= chunk.t[-1]) & np.isnan(self._mark_places[:, 0])
        self._mark_places[inside] = places[np.minimum(near[inside], len(places) - 1)]
        self.count += len(chunk.t)
        self.duration = float(chunk.t[-1])

    def over_time(self) -> dict[str, Any]:
        """Speed with its source lines, and velocity, acceleration and jerk of each axis, over time."""
        axes = len(self._axes)
        result: dict[str, Any] = {"speed": _curve(self._curves, 0, with_line=True)}
        for group, name in enumerate(("velocity", "acceleration", "jerk")):
            result[name] = [_curve(self._curves, 1 + group * axes + k) for k in range(axes)]
        return result

    def tool_path(self) -> dict[str, Any]:
        """Points in X, Y, Z with speed and source line; the marks; how far off the drawn line may be [mm]."""
        points, line = self._path.result()
        points = points if points.size else np.empty((0, 4))
        return {
            **{name: packed(points[:, k]) for k, name in enumerate("xyz")},
            "speed": packed(points[:, 3] / self._speed_weight),
            "line": packed(line),
            "marks": np.nan_to_num(self._mark_places).tolist(),
            "tolerance": self._path.tolerance,
        }

    def _tool(self, chunk: SetpointChunk) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the tool is in X, Y, Z, and how fast."""
        tool, joints = self._problem.tip_curve, self._problem.joints
        if tool is not None and joints is not None:
            place, tangent = tool.evaluate(chunk.piece, chunk.u, 1)
            slope = np.linalg.norm(joints.evaluate(chunk.piece, chunk.u, 1)[1], axis=1)
            rate = np.linalg.norm(chunk.velocity, axis=1) / np.where(slope > 0, slope, np.inf)
            return place, np.linalg.norm(tangent, axis=1) * rate
        places = np.zeros((len(chunk), 3))
        for column in self._linear:
            places[:, "XYZ".index(self._axes[column])] = chunk.position[:, column]
        return places, np.linalg.norm(chunk.velocity, axis=1)


def _curve(curves: Envelope, column: int, with_line: bool = False) -> dict[str, Any]:
    """A column as the page reads it: x, y, the mean, and the source lines where they are wanted."""
    x, y, line = curves.curve(column)
    mean_x, mean = curves.mean(column, _MEAN_POINTS)
    result: dict[str, Any] = {
        "x": packed(x),
        "y": packed(y),
        "mean": {"x": packed(mean_x), "y": packed(mean)},
    }
    return result | ({"line": packed(line)} if with_line else {})


def over_length(problem: Problem, profile: SpeedProfile) -> dict[str, Any]:
    """Speed and the limits on it over the path's length; limits that hold nowhere are left out.

    `cutting_speed` is the greatest speed on moves with a feed: rapids would flatten the colours.
    """
    names = ("speed", "acceleration", "feed", "velocity", "chord")
    count = len(profile) * samples_per_arc(profile)
    curves = Envelope(count, _LENGTH_POINTS)
    is_cut = np.isfinite(problem.path.feed)[profile.piece.astype(np.int64)]
    top = cutting = 0.0
    for block in limit_samples(problem, profile):
        table = np.column_stack([getattr(block, name) for name in names])
        piece = profile.piece[block.arc].astype(np.int64)
        curves.add(block.length, table, problem.path.line[piece].astype(np.int64))
        speed = block.speed[np.isfinite(block.speed)]
        top = max(top, float(speed.max(initial=0.0)))
        cut = block.speed[is_cut[block.arc]]
        cutting = max(cutting, float(cut[np.isfinite(cut)].max(initial=0.0)))
    result: dict[str, Any] = {"top_speed": top, "cutting_speed": cutting or top}
    for column, name in enumerate(names):
        if name == "speed":
            result[name] = _curve(curves, column, with_line=True)
            continue
        length, value, _ = curves.curve(column)
        if np.isfinite(value).any():
            # Far above everything else a limit says no more than "not here"; the chart ends before.
            value = np.minimum(value, 20.0 * top) if top > 0 else value
            result[name] = {"x": packed(length), "y": packed(value)}
    return result


def chart_data(
    problem: Problem, profile: SpeedProfile, figures: SetpointFigures, audit: Audit
) -> dict[str, Any]:
    """Everything the page's script draws."""
    limits = {
        name: [float(value) if np.isfinite(value) else None for value in getattr(problem, f"max_{name}")]
        for name in ("velocity", "acceleration", "jerk")
    }
    judged = {check.name for check in audit.checks if check.judged}
    return {
        "axes": list(problem.axes),
        "limits": limits,
        "judged": sorted(judged),
        "feed": float(problem.feed.max()) if len(problem.feed) else None,
        "duration": figures.duration,
        "path": figures.tool_path(),
        "length": over_length(problem, profile),
        "time": figures.over_time(),
        "failures": [{"name": check.name, "axis": check.axis, "time": check.time} for check in audit.broken],
    }

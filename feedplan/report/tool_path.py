"""The tool path as a page draws it: few points with their speed, reduced while the setpoints pass by once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.report.limits import parameter_speed
from feedplan.report.reduce import Polyline, packed
from feedplan.report.tool_motion import ToolMotion
from feedplan.setpoints import SetpointChunk

_POINTS = 60_000

# The tool path may be drawn this far beside itself, as a part of its extent: a tenth of a pixel at first.
_TOLERANCE = 1e-4
# A difference in speed weighs like one of length: this part of the top speed like `_TOLERANCE`.
_SPEED_TOLERANCE = 0.01


class ToolPath:
    """Takes all setpoints chunk by chunk.

    `marks` are times [s] whose place on the tool path is wanted; at most `points` points are kept.
    """

    def __init__(
        self, problem: Problem, motion: ToolMotion, marks: Sequence[float] = (), points: int = _POINTS
    ) -> None:
        self._axes = problem.axes
        self._problem, self._motion = problem, motion
        self._linear = [self._axes.index(name) for name in "XYZ" if name in self._axes]
        columns = [column for column, name in enumerate(problem.path.axes) if name in ("X", "Y", "Z")]
        low = problem.path.curve.control_points[:, columns]
        extent = float(np.linalg.norm(np.ptp(low, axis=0))) if low.size else 0.0
        tolerance = _TOLERANCE * extent if extent > 0 else 1.0
        cut = problem.feed[np.isfinite(problem.path.feed)]
        top = float((cut if len(cut) else problem.feed).max(initial=0.0)) or 1.0
        self._speed_weight = tolerance / (_SPEED_TOLERANCE * top)
        self._path = Polyline(points, tolerance)
        self._marks = np.asarray(marks, dtype=np.float64)
        self._mark_places = np.full((len(self._marks), 3), np.nan)
        self._is_cut = np.isfinite(problem.path.feed)
        self._top = self._cutting = 0.0

    def add(self, chunk: SetpointChunk) -> NDArray[np.float64]:
        """The next setpoints; returns the tool's speed at each, in the unit drawn a second."""
        places, speed = self._tool(chunk)
        if len(chunk) == 0:
            return speed
        tags = np.column_stack((chunk.line, np.round(1e6 * chunk.t))).astype(np.int64)
        self._path.add(np.column_stack((places, self._speed_weight * speed)), tags)
        self._top = max(self._top, float(speed.max()))
        self._cutting = max(self._cutting, float(speed[self._is_cut[chunk.piece]].max(initial=0.0)))
        near = np.searchsorted(chunk.t, self._marks)
        inside = (self._marks <= chunk.t[-1]) & np.isnan(self._mark_places[:, 0])
        self._mark_places[inside] = places[np.minimum(near[inside], len(places) - 1)]
        return speed

    def data(self) -> dict[str, Any]:
        """Points in X, Y, Z with speed, source line and time; the marks; how far off the line may be [mm].

        `cutting_speed` is the greatest speed on moves with a feed: rapids would flatten the colours. `unit`
        is that of the way, mm, or deg where nothing but rotary axes moves.
        """
        points, tags = self._path.result()
        points = points if points.size else np.empty((0, 4))
        tags = tags if tags.size else np.empty((0, 2), np.int64)
        return {
            **{name: packed(points[:, k]) for k, name in enumerate("xyz")},
            "speed": packed(points[:, 3] / self._speed_weight),
            "line": packed(tags[:, 0]),
            "time": packed(1e-6 * tags[:, 1]),
            "unit": self._motion.unit,
            "cutting_speed": self._cutting or self._top,
            "marks": np.nan_to_num(self._mark_places).tolist(),
            "tolerance": self._path.tolerance,
        }

    def _tool(self, chunk: SetpointChunk) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the tool is in X, Y, Z, and how fast it is in the unit drawn; 0 where it only turns."""
        problem, motion = self._problem, self._motion
        if problem.tip_curve is not None and problem.joints is not None:
            (places,) = problem.tip_curve.evaluate(chunk.piece, chunk.u)
            tangent = problem.joints.evaluate(chunk.piece, chunk.u, 1)[1]
            speed = motion.slope(chunk.piece, chunk.u) * parameter_speed(tangent, chunk.velocity)
        else:
            places = np.zeros((len(chunk), 3))
            for column in self._linear:
                places[:, "XYZ".index(self._axes[column])] = chunk.position[:, column]
            counts = 1.0 if motion.share is None else motion.share[chunk.piece]
            speed = np.linalg.norm(chunk.velocity * counts, axis=1)
        return places, speed if motion.drawn.all() else speed * motion.drawn[chunk.piece]

"""Computes the data of the page's charts, reduced from the setpoints in one pass over them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from feedplan.audit import Audit
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener
from feedplan.report.account import Account
from feedplan.report.limits import drawn_phases, limit_samples, samples_per_phase
from feedplan.report.reduce import Envelope
from feedplan.report.tool_path import ToolPath
from feedplan.setpoints import SetpointChunk
from feedplan.units import finite

# Number of points that are kept. The page draws a few thousand of them at a time, and more detail when it is
# zoomed.
_TIME_POINTS = 240_000  # all curves over time together
_TIME_POINTS_PER_CURVE = 24_000
_LENGTH_POINTS = 12_000  # each curve over length
_MEAN_POINTS = 1_000  # the mean of each curve, drawn where the curve oscillates too fast for a line


class SetpointFigures:
    """Takes all setpoints chunk by chunk; keeps the curves over time and the tool path.

    `count` is the number of setpoints that will be added; they are also added to `path`.
    """

    def __init__(self, problem: Problem, path: ToolPath, count: int) -> None:
        self._axes = problem.axes
        columns = 1 + 3 * len(self._axes)
        self._curves = Envelope(count, min(_TIME_POINTS_PER_CURVE, _TIME_POINTS // columns))
        self.path = path
        self.duration = 0.0

    def add(self, chunk: SetpointChunk) -> None:
        """Adds the next setpoints."""
        if len(chunk.t) == 0:
            return
        speed = self.path.add(chunk)
        rates = (chunk.velocity, chunk.acceleration, chunk.jerk)
        self._curves.add(chunk.t, chunk.line, speed[:, None], *rates)
        self.duration = float(chunk.t[-1])

    def over_time(self) -> dict[str, Any]:
        """Curves over time: speed with its source lines, and velocity, acceleration and jerk of each axis."""
        axes = len(self._axes)
        result: dict[str, Any] = {"speed": _curve(self._curves, 0, with_line=True)}
        for group, name in enumerate(("velocity", "acceleration", "jerk")):
            result[name] = [_curve(self._curves, 1 + group * axes + k) for k in range(axes)]
        return result


def _curve(curves: Envelope, column: int, with_line: bool = False) -> dict[str, Any]:
    """A column in the form that the page reads: x, y, the mean, and the source lines if requested."""
    x, y, line = curves.curve(column)
    mean_x, mean = curves.mean(column, _MEAN_POINTS)
    result: dict[str, Any] = {"x": x, "y": y, "mean": {"x": mean_x, "y": mean}}
    return result | ({"line": line} if with_line else {})


def over_length(problem: Problem, profile: SpeedProfile, progress: Listener | None = None) -> dict[str, Any]:
    """Speed and its limits over the path's length; limits that are infinite everywhere are left out.

    `cutting_speed` is the greatest speed on moves with a feed; it is the top of the colour scale, because
    with rapids the colours of cutting moves would hardly differ.
    """
    names = ("speed", "acceleration", "feed", "velocity", "chord")
    count = len(drawn_phases(problem, profile)) * samples_per_phase(profile)
    curves = Envelope(count, _LENGTH_POINTS)
    is_cut = np.isfinite(problem.path.feed)[profile.piece.astype(np.int64)]
    top = cutting = 0.0
    for block in limit_samples(problem, profile, progress):
        line = problem.path.line[profile.piece[block.phase]]
        curves.add(block.length, line, *(getattr(block, name)[:, None] for name in names))
        speed = block.speed[np.isfinite(block.speed)]
        top = max(top, float(speed.max(initial=0.0)))
        cut = block.speed[is_cut[block.phase]]
        cutting = max(cutting, float(cut[np.isfinite(cut)].max(initial=0.0)))
    result: dict[str, Any] = {"top_speed": top, "cutting_speed": cutting or top}
    for column, name in enumerate(names):
        if name == "speed":
            result[name] = _curve(curves, column, with_line=True)
            continue
        length, value, _ = curves.curve(column)
        if np.isfinite(value).any():
            # A limit far above all speeds is cut off, so that the speeds determine the chart's scale.
            value = np.minimum(value, 20.0 * top) if top > 0 else value
            result[name] = {"x": length, "y": value}
    return result


def chart_data(
    problem: Problem,
    account: Account,
    figures: SetpointFigures,
    audit: Audit,
    length: Mapping[str, Any],
) -> dict[str, Any]:
    """All data that a page draws, with its arrays; `length` is the result of `over_length`."""
    limits = {
        name: [finite(float(value)) for value in getattr(problem, f"max_{name}")]
        for name in ("velocity", "acceleration", "jerk")
    }
    least = {name: getattr(problem, f"min_{name}").tolist() for name in ("velocity", "acceleration")}
    judged = {check.name for check in audit.checks if check.judged}
    return {
        "axes": list(problem.axes),
        "units": list(problem.units),
        "limits": limits,
        "least": least,
        "judged": sorted(judged),
        "feed": float(problem.feed.max()) if len(problem.feed) else None,
        "duration": figures.duration,
        "path": figures.path.data(account.activity),
        "length": length,
        "time": figures.over_time(),
        "slow": [asdict(line) for line in account.slow],
        "failures": [{"name": check.name, "axis": check.axis, "time": check.time} for check in audit.broken],
    }

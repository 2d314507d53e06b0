"""Sarfraz predictor-corrector against Newton–Raphson at constant feed, on small and large steps: number of
rounds, error of the length, and time to compute setpoints with all derivatives."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.problems import quadratic_spline
from benchmarks.results import Cell, Result
from feedplan.constraints.problem import Problem
from feedplan.geometry.path import Path
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.setpoints import INTERPOLATORS, Setpoints

FEED = 50.0  # [mm/s]


def curves() -> dict[str, Path]:
    """A surface pass, large curves, and folds: turns of nearly 180 degrees within micrometres."""
    rng = np.random.default_rng(1)
    direction = np.cumsum(rng.normal(0, 0.15, (400, 3)), axis=0) + np.array([4.0, 0.0, 0.0])
    surface = np.cumsum(direction / np.linalg.norm(direction, axis=1)[:, None], axis=0)
    angle = np.linspace(0, 6 * np.pi, 19)
    large = np.stack([100 * np.cos(angle), 40 * np.sin(2 * angle)], axis=1)
    fold = np.stack([np.tile([0.0, 10.0], 40), np.arange(80) * 1e-3], axis=1)
    named = {"surface pass": surface, "large curves": large, "folds": fold}
    return {name: quadratic_spline(points, FEED) for name, points in named.items()}


def constant_feed(path: Path) -> SpeedProfile:
    """A profile at the constant speed `FEED`, one phase for each piece; it starts and ends in motion."""
    count = len(path)
    joints = np.append(path.lengths.length(np.arange(count), np.zeros(count)), path.length)
    edges = np.diff(path.curve.by_piece, axis=1)
    p = (FEED * path.width[:, None] / 2 / np.linalg.norm(edges, axis=2)) ** 2
    return SpeedProfile(
        piece=np.arange(count, dtype=np.uint32),
        kind=np.full(count, PhaseLaw.FEED, np.uint8),
        axis=np.full(count, 255, np.uint8),
        value=np.full(count, FEED**2),
        u0=np.zeros(count),
        u1=path.width,
        p0=p[:, 0],
        p1=p[:, 1],
        duration=np.diff(joints) / FEED,
        runs=np.array([0, count]),
    )


def unlimited(path: Path) -> Problem:
    """A problem without limits: setpoints need only its path and feed."""
    count, axes = len(path), len(path.axes)
    return Problem(
        path=path,
        max_velocity=np.full(axes, np.inf),
        max_acceleration=np.full(axes, np.inf),
        max_jerk=np.full(axes, np.inf),
        feed=path.feed,
        junction_speed=np.full(count + 1, np.inf),
        chord_tolerance=np.inf,
        period=0.001,
    )


def stream_rows(name: str, path: Path, steps: tuple[float, ...]) -> list[dict[str, Cell]]:
    """Times the setpoint stream."""
    profile, problem = constant_feed(path), unlimited(path)
    rows: list[dict[str, Cell]] = []
    for step in steps:
        for interpolator in INTERPOLATORS:
            stream = Setpoints(problem, profile, step / FEED, interpolator)
            begin = time.perf_counter()
            count = sum(len(chunk) for chunk in stream.chunks())
            seconds = time.perf_counter() - begin
            stats = stream.stats
            rows.append(
                {
                    "curve": name,
                    "step [mm]": step,
                    "steps": count,
                    "interpolator": interpolator,
                    "worst rounds": stats.iterations,
                    "error [steps]": stats.length_error,
                    "ns a step": seconds / count * 1e9,
                }
            )
    return rows


def run(quick: bool = False) -> Result:
    """Runs both interpolators on small and large steps."""
    steps = (0.1, 1.0) if quick else (0.001, 0.01, 0.1, 1.0)
    rows: list[dict[str, Cell]] = []
    for name, path in curves().items():
        rows += stream_rows(name, path, steps)
    return Result(
        f"Interpolators at {FEED:g} mm/s",
        tuple(rows),
        ("The error is the proven bound.",),
    )

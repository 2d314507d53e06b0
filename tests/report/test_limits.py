"""The limit curve and the speed caps over length: by hand, against linear programming, along a profile."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.report.limits import LimitSamples, limit_curve, limit_samples


def sampled(problem: Any, profile: SpeedProfile) -> LimitSamples:
    blocks = list(limit_samples(problem, profile))
    names = ("length", "speed", "acceleration", "feed", "velocity", "chord", "phase")
    return LimitSamples(*(np.concatenate([getattr(block, name) for block in blocks]) for name in names))


def test_on_a_bend_the_cross_axis_carries_all() -> None:
    # Along X with curvature 1/10 mm: Y has the acceleration v²/10, so 500 mm/s² allow v² = 5000 mm²/s².
    most = np.array([300.0, 500.0])
    p = limit_curve(np.array([[1.0, 0.0]]), np.array([[0.0, 0.1]]), most, -most)
    assert p == pytest.approx([5000.0])


def test_straight_pieces_and_one_axis_have_no_limit_curve() -> None:
    tangent = np.array([[0.6, 0.8], [1.0, 0.0]])
    assert np.isinf(limit_curve(tangent, 0.3 * tangent, np.ones(2), -np.ones(2))).all()
    assert np.isinf(limit_curve(np.ones((1, 1)), np.ones((1, 1)), np.ones(1), -np.ones(1))).all()


@pytest.mark.parametrize("axes", [2, 3, 6])
def test_the_limit_curve_is_the_optimum_of_the_linear_programme(axes: int) -> None:
    random = np.random.default_rng(axes)
    tangent, second = random.normal(size=(2, 40, axes))
    tangent[::5, 0] = 0.0
    most, least = random.uniform(0.5, 3.0, axes), -random.uniform(0.5, 3.0, axes)
    best = limit_curve(tangent, second, most, least)
    for q, bend, p in zip(tangent, second, best, strict=True):
        rows = np.vstack([np.stack([q, bend], axis=1), -np.stack([q, bend], axis=1)])
        found = linprog([0, -1], A_ub=rows, b_ub=np.append(most, -least), bounds=[(None, None), (0, None)])
        assert p == pytest.approx(found.x[1], rel=1e-9)


def test_the_square_rises_to_its_feed_and_stops_at_its_corners(square: Any) -> None:
    samples = sampled(square.problem, square.profile)
    assert samples.length[-1] == pytest.approx(80.0, abs=1e-12)
    assert (np.diff(samples.length) >= 0).all()
    side = samples.length % 20.0
    to_corner = np.minimum(side, 20.0 - side)
    assert samples.speed == pytest.approx(np.minimum(np.sqrt(2 * 500.0 * to_corner), 50.0), abs=1e-5)
    assert (samples.feed == 50.0).all()
    assert samples.velocity == pytest.approx(100.0)
    assert np.isinf(samples.acceleration).all()
    assert np.isinf(samples.chord).all()


def bend(
    square: Any, kind: PhaseLaw, axis: int, value: float, p: tuple[float, float]
) -> tuple[Any, SpeedProfile]:
    """A quarter turn from X to Y as a parabola, with parameter width 10, in one phase."""
    path: Path = replace(
        square.path,
        curve=CompositeCurve.from_pieces([[[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]], [10.0]),
        line=np.array([1], np.int32),
        runs=np.array([0, 1]),
        dwell=np.zeros(1),
    )
    one = {
        "piece": np.array([0], np.uint32),
        "kind": np.array([kind], np.uint8),
        "axis": np.array([axis], np.uint8),
    }
    ends = {"u0": np.array([0.0]), "u1": np.array([10.0]), "p0": np.array([p[0]]), "p1": np.array([p[1]])}
    profile = SpeedProfile(
        **one, **ends, value=np.array([value]), duration=np.array([1.0]), runs=np.array([0, 1])
    )
    return replace(square.problem, path=path, feed=np.array([50.0])), profile


# C' = (2 − 0.2 u, 0.2 u), so |C'|² is 4 at both ends and 2 in the middle.
@pytest.mark.parametrize(
    ("kind", "axis", "value", "ends", "middle"),
    [
        (PhaseLaw.PARAMETER_ACCELERATION, 0, 0.0, (100.0, 100.0), np.sqrt(200.0)),
        # p grows from 50 by 2·5·u.
        (PhaseLaw.PARAMETER_ACCELERATION, 255, 5.0, (50.0, 150.0), np.sqrt(200.0)),
        (PhaseLaw.FEED, 255, 1600.0, (400.0, 400.0), 40.0),
        # Y: p q'² grows by 2·A·Δy from 0; at u = 5 the tool is at y = 2.5 and q'_y = 1.
        (PhaseLaw.AXIS_ACCELERATION, 1, 100.0, (0.0, 500.0), np.sqrt(2.0 * 500.0)),
    ],
)
def test_each_kind_of_arc_has_its_speed_in_the_middle(
    square: Any, kind: PhaseLaw, axis: int, value: float, ends: tuple[float, float], middle: float
) -> None:
    samples = sampled(*bend(square, kind, axis, value, ends))
    assert samples.speed[len(samples.speed) // 2] == pytest.approx(middle, rel=1e-12)
    assert samples.length[-1] == pytest.approx(16.23225240140230, rel=1e-5)


def test_arcs_of_limited_jerk_have_the_speed_of_their_length(square: Any) -> None:
    length = 16.23225240140230
    # From rest at 600 mm/s³: s = 100 t³ and v = 300 t². The middle sample is at half of the length.
    time = (length / 100.0) ** (1 / 3)
    v1 = 300.0 * time**2
    problem, profile = bend(square, PhaseLaw.PATH_JERK, 255, 600.0, (0.0, (v1 / 2.0) ** 2))
    ends = {"a0": np.array([0.0]), "a1": np.array([600.0 * time])}
    samples = sampled(problem, replace(profile, duration=np.array([time]), **ends))
    middle = len(samples.speed) // 2
    assert samples.speed[middle] == pytest.approx(300.0 * (0.5 * length / 100.0) ** (2 / 3), rel=1e-6)
    assert samples.speed[[0, -1]] == pytest.approx([0.0, v1], rel=1e-6)
    # v² from 100 to 400 mm²/s² with acceleration 0 at both ends: its mean is reached half-way.
    problem, profile = bend(square, PhaseLaw.SPEED_CUBIC, 255, 0.0, (25.0, 100.0))
    samples = sampled(problem, profile)
    assert samples.speed[middle] == pytest.approx(math.sqrt(250.0), rel=1e-6)
    assert samples.speed[[0, -1]] == pytest.approx([10.0, 20.0], rel=1e-9)


def test_the_chord_error_limits_the_bend(square: Any) -> None:
    samples = sampled(*bend(square, PhaseLaw.PARAMETER_ACCELERATION, 0, 0.0, (100.0, 100.0)))
    # In the middle |C'| = √2 and |C' × C''| = 0.4: the radius is 2√2/0.4 = 5√2 mm.
    radius, tolerance, period = 5.0 * np.sqrt(2.0), 0.02, 0.001
    step = 2.0 * np.sqrt(2.0 * radius * tolerance - tolerance**2)
    assert samples.chord.min() == pytest.approx(step / period, rel=1e-12)
    assert samples.chord.argmin() == len(samples.chord) // 2

    problem, profile = bend(square, PhaseLaw.PARAMETER_ACCELERATION, 0, 0.0, (100.0, 100.0))
    coarse = sampled(replace(problem, chord_tolerance=100.0), profile)
    assert coarse.chord.min() == pytest.approx(2.0 * 100.0 / period)

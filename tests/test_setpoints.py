"""Setpoints against hand calculation, closed forms, numerical integration, and their own definition."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq

from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.path import Path
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.setpoints import INTERPOLATORS, Setpoints
from tests.along import Phase, path_along, problem_along, profile_of

INTERPOLATOR = pytest.mark.parametrize("interpolator", INTERPOLATORS)


def sampled(path: Path, profile: SpeedProfile, period: float, interpolator: str = "sarfraz") -> Setpoints:
    return Setpoints(problem_along(path), profile, period, interpolator)


def path_of(control_points: list[list[list[float]]], width: list[float], **columns: Any) -> Path:
    return path_along(CompositeCurve.from_pieces(control_points, width), **columns)


def line_arcs(piece: int, length: float, acceleration: float, speed: float) -> list[Phase]:
    """From rest to rest along a piece in +X: a trapezoid, or a triangle if `speed` cannot be reached."""
    a, kind = acceleration, PhaseLaw.AXIS_ACCELERATION
    v = min(speed, math.sqrt(a * length))
    ramp = v * v / (2 * a)
    arcs: list[Phase] = [(piece, kind, 0, a, 0.0, ramp, 0.0, v * v, v / a)]
    if length > 2 * ramp:
        cruise = length - 2 * ramp
        arcs.append((piece, PhaseLaw.FEED, 255, v * v, ramp, length - ramp, v * v, v * v, cruise / v))
    return [*arcs, (piece, kind, 0, -a, length - ramp, length, v * v, 0.0, v / a)]


def line_case(speed: float = 50.0) -> tuple[Path, SpeedProfile]:
    """10 mm in +X from rest to rest at 1000 mm/s²."""
    path = path_of([[[0.0, 2.0], [5.0, 2.0], [10.0, 2.0]]], [10.0])
    arcs = line_arcs(0, 10.0, 1000.0, speed)
    return path, profile_of(*arcs)


def parabola_case(feed: float = 20.0) -> tuple[Path, SpeedProfile]:
    """x = u, y = u²/2 on [0, 4] at constant feed; it starts and ends in motion."""
    path = path_of([[[0.0, 0.0], [2.0, 0.0], [4.0, 8.0]]], [4.0])
    duration = parabola_length(4.0) / feed
    ends = (feed**2, feed**2 / 17)
    return path, profile_of((0, PhaseLaw.FEED, 255, feed**2, 0.0, 4.0, *ends, duration))


def parabola_length(u: float) -> float:
    return float(quad(lambda x: math.hypot(1, x), 0, u, epsabs=1e-13)[0])


def two_runs(dwell: float) -> tuple[Path, SpeedProfile]:
    """10 mm in X in 0.25 s, a pause, then another 4 mm in about 0.126 s."""
    points = [[[0.0], [5.0], [10.0]], [[10.0], [12.0], [14.0]]]
    path = path_of(points, [10.0, 4.0], runs=[0, 1, 2], dwell=np.array([dwell, 0.0]))
    arcs = [*line_arcs(0, 10.0, 1000.0, 50.0), *line_arcs(1, 4.0, 1000.0, 100.0)]
    return path, profile_of(*arcs, runs=[0, 3, 5])


def zigzag(seed: int, count: int = 20) -> tuple[Path, SpeedProfile]:
    """X speeds up at 100 mm/s² until the middle and slows down again; Y is a C1 quadratic spline over X."""
    rng = np.random.default_rng(seed)
    slope = np.cumsum(rng.uniform(-1, 1, count + 1))
    width = rng.uniform(0.5, 2.0, count)
    points, arcs = [], []
    x = np.concatenate(([0.0], np.cumsum(width)))
    y, total, a = 0.0, float(x[-1]), 100.0
    for i, h in enumerate(width):
        middle = y + h * slope[i] / 2
        end = middle + h * slope[i + 1] / 2
        points.append([[x[i], y], [x[i] + h / 2, middle], [x[i + 1], end]])
        y = end
        cuts = [x[i], *([total / 2] if x[i] < total / 2 < x[i + 1] else []), x[i + 1]]
        for from_x, to_x in pairwise(cuts):
            up = to_x <= total / 2
            p0, p1 = (2 * a * (s if up else total - s) for s in (from_x, to_x))
            duration = 2 * (to_x - from_x) / (math.sqrt(max(p0, 0)) + math.sqrt(max(p1, 0)))
            u0, u1 = from_x - x[i], min(to_x - x[i], h)
            kind = PhaseLaw.AXIS_ACCELERATION
            arcs.append((i, kind, 0, a if up else -a, u0, u1, max(p0, 0), max(p1, 0), duration))
    return path_of(points, list(width)), profile_of(*arcs)


def trapezoid(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position and speed for 10 mm at 1000 mm/s² and up to 50 mm/s: ramps of 0.05 s, 0.15 s between them."""
    up, down = np.minimum(t, 0.05), np.clip(t - 0.2, 0.0, 0.05)
    cruise = np.clip(t - 0.05, 0.0, 0.15)
    return 500 * up**2 + 50 * cruise + 50 * down - 500 * down**2, 1000 * (up - down)


@INTERPOLATOR
def test_a_trapezoid_on_a_line_is_the_school_formula(interpolator: str) -> None:
    path, profile = line_case()
    chunk = sampled(path, profile, 0.001, interpolator).all()
    place, speed = trapezoid(chunk.t)
    assert len(chunk) == 251
    np.testing.assert_allclose(chunk.position[:, 0], place, atol=1e-11)
    np.testing.assert_allclose(chunk.velocity[:, 0], speed, atol=1e-8)
    assert (chunk.position[:, 1] == 2.0).all()
    assert (chunk.velocity[:, 1] == 0.0).all()
    assert chunk.acceleration[[0, 1, 49, 51, 199, 201, 249, 250], 0].tolist() == [
        *(0, 1000, 1000, 0, 0, -1000, -1000, 0)
    ]
    assert (chunk.jerk == 0).all()


@INTERPOLATOR
def test_a_triangle_peaks_half_way(interpolator: str) -> None:
    path, profile = line_case(speed=1e9)
    chunk = sampled(path, profile, 0.01, interpolator).all()
    assert len(chunk) == 21
    assert chunk.position[10, 0] == pytest.approx(5.0, abs=1e-12)
    assert chunk.velocity[10, 0] == pytest.approx(100.0, abs=1e-9)


@INTERPOLATOR
def test_constant_feed_on_a_parabola_keeps_a_millionth_of_a_step(interpolator: str) -> None:
    path, profile = parabola_case()
    stream = sampled(path, profile, 0.003, interpolator)
    chunk = stream.all()
    step = 20.0 * 0.003
    for t, (x, _) in zip(chunk.t[1:-1:7], chunk.position[1:-1:7], strict=True):
        exact = brentq(lambda u, s=20.0 * t: parabola_length(u) - s, 0, 4, xtol=1e-14)
        assert abs(parabola_length(x) - parabola_length(exact)) < 1e-6 * step
    np.testing.assert_allclose(np.hypot(*chunk.velocity.T), 20.0, rtol=1e-12)
    assert stream.stats.length_error < 1e-6
    assert 1 <= stream.stats.iterations <= 12


def test_the_curvature_of_a_parabola_gives_acceleration_and_jerk() -> None:
    # At the vertex of y = x²/2 with speed v: normal acceleration v², and jerk −v³ along X.
    path, profile = parabola_case()
    chunk = sampled(path, profile, 0.003).all()
    np.testing.assert_allclose(chunk.velocity[0], [20, 0], atol=1e-12)
    np.testing.assert_allclose(chunk.acceleration[0], [0, 400], atol=1e-11)
    np.testing.assert_allclose(chunk.jerk[0], [-8000, 0], atol=1e-9)


@INTERPOLATOR
def test_a_path_that_ends_in_motion_ends_at_its_true_time(interpolator: str) -> None:
    path, profile = parabola_case()
    stream = sampled(path, profile, 0.003, interpolator)
    chunk = stream.all()
    assert chunk.position[-1].tolist() == [4.0, 8.0]
    assert stream.duration == chunk.t[-1] == profile.time
    assert 0 < chunk.t[-1] - chunk.t[-2] <= 0.003
    assert np.hypot(*chunk.velocity[-1]) == pytest.approx(20.0, rel=1e-14)
    assert stream.count == math.ceil(profile.time / 0.003) + 1


@INTERPOLATOR
def test_every_run_starts_on_the_grid_and_waits_less_than_a_period(interpolator: str) -> None:
    path, profile = two_runs(dwell=0.1)
    period = 0.004
    stream = sampled(path, profile, period, interpolator)
    chunk = stream.all()
    first, second = (math.ceil(time / period - 1e-9) for time in (0.25 + 0.1, profile.run_times[1]))
    assert stream.count == 1 + first + second
    assert stream.duration == (first + second) * period
    # The tool arrives after 0.25 s, which is no multiple of the period, and rests until the next setpoint.
    resting = slice(math.ceil(0.25 / period), first + 1)
    assert (chunk.position[resting] == 10.0).all()
    for rates in (chunk.velocity, chunk.acceleration, chunk.jerk):
        assert (rates[resting] == 0).all()
        assert (rates[-1] == 0).all()
    assert chunk.position[resting.start - 1, 0] < 10.0 < chunk.position[first + 1, 0]
    assert chunk.position[first + 1, 0] - 10.0 == pytest.approx(500 * period**2, abs=1e-12)
    assert chunk.position[-1] == 14.0
    assert chunk.line[[0, first, first + 1, -1]].tolist() == [10, 10, 20, 20]
    assert chunk.piece[[0, first, first + 1, -1]].tolist() == [0, 0, 1, 1]
    assert chunk.u[[0, first, -1]].tolist() == [0.0, 10.0, 4.0]


@INTERPOLATOR
@pytest.mark.parametrize(("pause", "waiting"), [(0.02, 5), (0.021, 6), (1e-6, 1)])
def test_a_pause_before_the_first_run_delays_the_stream_by_whole_periods(
    interpolator: str, pause: float, waiting: int
) -> None:
    path, profile = two_runs(dwell=0.1)
    period = 0.004
    stream = sampled(replace(path, start_dwell=pause), profile, period, interpolator)
    whole, prompt = stream.all(), sampled(path, profile, period, interpolator).all()
    assert len(whole) == len(prompt) + waiting
    np.testing.assert_array_equal(whole.t, period * np.arange(len(whole)))
    for name in ("position", "velocity", "acceleration", "jerk", "line", "piece", "u"):
        column = getattr(whole, name)
        np.testing.assert_array_equal(column[waiting:], getattr(prompt, name), err_msg=name)
        assert (column[:waiting] == column[waiting]).all(), name
    for size in (1, 3, waiting, waiting + 1):
        chunks = list(stream.chunks(size))
        np.testing.assert_array_equal(np.concatenate([chunk.position for chunk in chunks]), whole.position)


@INTERPOLATOR
def test_a_period_longer_than_the_run_hits_its_end(interpolator: str) -> None:
    path, profile = two_runs(dwell=0.0)
    stream = sampled(path, profile, 5.0, interpolator)
    assert stream.all().position[:, 0].tolist() == [0.0, 10.0, 14.0]
    assert stream.duration == 10.0


@INTERPOLATOR
def test_a_thousand_runs_shorter_than_a_period_take_one_each(interpolator: str) -> None:
    x = np.arange(1001) * 1e-6
    points = [[[a], [(a + b) / 2], [b]] for a, b in pairwise(x)]
    width = np.diff(x)
    path = path_of(points, list(width), runs=range(1001))
    arcs = [line_arcs(i, float(h), 1000.0, 100.0) for i, h in enumerate(width)]
    runs = np.concatenate(([0], np.cumsum([len(run) for run in arcs])))
    profile = profile_of(*(arc for run in arcs for arc in run), runs=runs)
    chunk = sampled(path, profile, 0.001, interpolator).all()
    np.testing.assert_array_equal(chunk.position[:, 0], x)
    assert (chunk.velocity == 0).all()


@INTERPOLATOR
@pytest.mark.parametrize("case", [line_case(), parabola_case(), two_runs(0.1), zigzag(1)])
def test_chunks_of_any_size_make_the_same_stream(interpolator: str, case: tuple[Path, SpeedProfile]) -> None:
    stream = sampled(*case, 0.0031, interpolator)
    whole = stream.all()
    for size in (1, 7, 1000):
        parts = list(stream.chunks(size))
        assert [len(part) for part in parts[:-1]] == [size] * (len(parts) - 1)
        for name in ("t", "position", "velocity", "acceleration", "jerk", "line", "piece", "u"):
            joined = np.concatenate([getattr(part, name) for part in parts])
            np.testing.assert_array_equal(joined, getattr(whole, name))


@INTERPOLATOR
@given(seed=st.integers(0, 2**32 - 1), ratio=st.integers(2, 9))
def test_the_place_at_a_time_does_not_depend_on_the_period(interpolator: str, seed: int, ratio: int) -> None:
    path, profile = zigzag(seed)
    coarse = sampled(path, profile, 0.01 * ratio, interpolator).all()
    fine = sampled(path, profile, 0.01, interpolator).all()
    shared = min(len(coarse) - 1, (len(fine) - 1) // ratio)
    np.testing.assert_allclose(
        coarse.position[:shared], fine.position[: shared * ratio : ratio], atol=1e-8, rtol=0
    )


@INTERPOLATOR
@given(seed=st.integers(0, 2**32 - 1))
def test_positions_velocities_and_accelerations_belong_together(interpolator: str, seed: int) -> None:
    path, profile = zigzag(seed)
    period = 0.002
    chunk = sampled(path, profile, period, interpolator).all()
    # Within an arc the trapezium rule is off by at most T³ × jerk / 12; where the arc changes, by T² × jump.
    same = (np.diff(chunk.piece) == 0) & (np.sign(chunk.acceleration[1:, 0] * chunk.acceleration[:-1, 0]) > 0)
    step = np.diff(chunk.position, axis=0)
    trapezium = period / 2 * (chunk.velocity[1:] + chunk.velocity[:-1])
    jerk = np.maximum(np.abs(chunk.jerk[1:]), np.abs(chunk.jerk[:-1]))
    assert (np.abs(step - trapezium) <= 1.2 * period**3 / 12 * jerk + 1e-9)[same].all()
    change = np.diff(chunk.velocity, axis=0) - period / 2 * (chunk.acceleration[1:] + chunk.acceleration[:-1])
    assert (np.abs(change)[same] <= 1e-3 * (np.abs(chunk.acceleration[1:][same]) + 100) * period).all()


@INTERPOLATOR
@given(seed=st.integers(0, 2**32 - 1), period=st.floats(1e-3, 0.1))
def test_second_differences_stay_within_the_acceleration(interpolator: str, seed: int, period: float) -> None:
    path, profile = zigzag(seed)
    chunk = sampled(path, profile, period, interpolator).all()
    x = np.diff(chunk.position[:, 0], 2) / period**2
    assert np.abs(x).max(initial=0.0) <= 100 * (1 + 1e-6)
    assert (np.diff(chunk.position[:, 0]) >= 0).all()
    assert chunk.position[-1].tolist() == path.curve.by_piece[-1, 2].tolist()


@pytest.mark.parametrize("degree", [2, 3])
def test_the_parameter_moves_at_constant_acceleration(degree: int) -> None:
    # y = x²/2, C' = (1, u): u = ½·3·t² from rest to 6 in 2 s, then −6 mm/s² to rest at 9 in 1 s.
    path = path_of([[[0.0, 0.0], [4.5, 0.0], [9.0, 40.5]]], [9.0])
    path = replace(path, curve=path.curve.elevated(degree))
    kind = PhaseLaw.PARAMETER_ACCELERATION
    arcs: list[Phase] = [
        (0, kind, 255, 3.0, 0.0, 6.0, 0.0, 36.0, 2.0),
        (0, kind, 255, -6.0, 6.0, 9.0, 36.0, 0.0, 1.0),
    ]
    for interpolator in INTERPOLATORS:
        chunk = sampled(path, profile_of(*arcs), 0.01, interpolator).all()
        up = chunk.t <= 2.0
        rest = 3.0 - chunk.t
        u = np.where(up, 1.5 * chunk.t**2, 9.0 - 3.0 * rest**2)
        speed, s = np.where(up, 3.0 * chunk.t, 6.0 * rest), np.where(up, 3.0, -6.0)
        np.testing.assert_allclose(chunk.u, u, atol=1e-9)
        np.testing.assert_allclose(chunk.velocity[:, 1], u * speed, atol=1e-8)
        inside = (chunk.t != 2.0) & (chunk.t < 3.0)
        np.testing.assert_allclose(
            chunk.acceleration[inside, 1], (u * s + speed**2)[inside], rtol=1e-9, atol=1e-7
        )
        np.testing.assert_allclose(chunk.jerk[inside, 1], (3.0 * s * speed)[inside], rtol=1e-7, atol=1e-6)


def test_phases_of_constant_axis_velocity_and_of_constant_p_follow_their_law() -> None:
    # y = x²/2, C' = (1, u): y moves at a constant 6 mm/s on [1, 2]; p = 4 on [2, 4].
    path = path_of([[[0.0, 0.0], [2.0, 0.0], [4.0, 8.0]]], [4.0])
    arcs: list[Phase] = [
        (0, PhaseLaw.PARAMETER_ACCELERATION, 255, 0.0, 0.0, 1.0, 36.0, 36.0, 1 / 6),
        (0, PhaseLaw.AXIS_VELOCITY, 1, 36.0, 1.0, 2.0, 36.0, 9.0, 1.5 / 6),
        (0, PhaseLaw.PARAMETER_ACCELERATION, 255, 0.0, 2.0, 4.0, 4.0, 4.0, 1.0),
    ]
    profile = profile_of(*arcs)
    for interpolator in INTERPOLATORS:
        chunk = sampled(path, profile, 0.01, interpolator).all()
        u, ends = chunk.u, np.cumsum(profile.duration)
        on = [(chunk.t > start) & (chunk.t < end) for start, end in zip([0, *ends], ends, strict=False)]
        np.testing.assert_allclose(np.diff(chunk.position[on[1], 1]), 0.06, atol=1e-9)
        assert (chunk.velocity[on[1], 1] == 6.0).all()
        assert (chunk.acceleration[on[1], 1] == 0.0).all()
        np.testing.assert_allclose(np.diff(u[on[2]]), 0.02, atol=1e-9)


def test_both_interpolators_agree_and_report_their_work() -> None:
    path, profile = parabola_case()
    streams: dict[str, Setpoints] = {name: sampled(path, profile, 0.001, name) for name in INTERPOLATORS}
    chunks = {name: stream.all() for name, stream in streams.items()}
    np.testing.assert_allclose(chunks["sarfraz"].position, chunks["newton"].position, atol=1e-10)
    for stream in streams.values():
        assert 1 <= stream.stats.iterations <= 12
        assert 0 < stream.stats.length_error < 1e-6
    assert sampled(*line_case(speed=1e9), 0.001).stats.iterations == 0


@pytest.mark.parametrize("period", [0.0, -0.001, math.nan, math.inf, 1e-12])
def test_a_period_that_cannot_be_used_is_refused(period: float) -> None:
    with pytest.raises(InputError, match="period"):
        sampled(*line_case(), period)


def test_what_does_not_fit_is_refused_with_a_sentence() -> None:
    path, profile = two_runs(0.0)
    with pytest.raises(InputError, match="use one of sarfraz, newton"):
        sampled(path, profile, 0.001, "euler")
    with pytest.raises(InputError, match="give a size from 1"):
        sampled(path, profile, 0.001).chunks(0)
    with pytest.raises(InputError, match="by chunks"):
        sampled(path, profile, 1e-8).all()
    with pytest.raises(InputError, match="are more than 100000000: choose a longer period, or ask"):
        sampled(path, profile, 1e-9)
    with pytest.raises(InputError, match="does not belong to this path"):
        sampled(path, line_case()[1], 0.001)
    first = profile_of(*line_arcs(0, 10.0, 1000.0, 50.0), runs=[0, 3, 3])
    with pytest.raises(InputError, match="line 20: the profile has no phases in run 2"):
        sampled(path, first, 0.001)
    with pytest.raises(InputError, match="phase 3 of the profile is on no piece of its run"):
        sampled(path, replace(profile, runs=np.array([0, 5, 5])), 0.001)
    with pytest.raises(InputError, match="phase 0 of the profile is governed by axis 1"):
        sampled(path, replace(profile, axis=np.ones_like(profile.axis)), 0.001)
    moving, constant = parabola_case()
    with pytest.raises(InputError, match="plan with end speed 0"):
        sampled(replace(moving, dwell=np.array([1.0])), constant, 0.001)
    with pytest.raises(InputError, match=r"line 10: .* pauses 1 s there: plan with start speed 0"):
        sampled(replace(moving, start_dwell=1.0), constant, 0.001)
    for pause in (-1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="a pause that is negative or not finite"):
            sampled(replace(path, start_dwell=pause), profile, 0.001)
    nothing = replace(path, curve=CompositeCurve.from_pieces(np.empty((0, 3, 1)), []), runs=np.array([0]))
    with pytest.raises(InputError, match="the path is empty"):
        sampled(replace(nothing, dwell=np.empty(0)), profile, 0.001)


def test_a_run_that_ends_in_motion_before_the_last_is_refused() -> None:
    path, profile = two_runs(0.0)
    p1 = profile.p1.copy()
    p1[2] = 100.0
    with pytest.raises(InputError, match=r"line 10: the profile ends run 1 at 10\.0"):
        sampled(path, replace(profile, p1=p1), 0.001)


def test_numbers_do_not_depend_on_the_unit() -> None:
    # The same part, with lengths in micrometres.
    path, profile = zigzag(3)
    scale = 1000.0
    micro = replace(path, curve=CompositeCurve.from_pieces(path.curve.by_piece * scale, path.width))
    # C' grows with the scale; u and p stay the same.
    faster = replace(profile, value=profile.value * scale)
    first, second = sampled(path, profile, 0.003).all(), sampled(micro, faster, 0.003).all()
    np.testing.assert_allclose(second.position, first.position * scale, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(second.acceleration, first.acceleration * scale, rtol=1e-9, atol=1e-5)

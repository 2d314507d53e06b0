"""Knots of a plan: equal steps between stops, exact positions at stops, the times of the plan."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from feedplan import Machine, Path, plan
from feedplan.errors import InputError
from feedplan.knots import Knots
from feedplan.setpoints import SetpointChunk

PROGRAM = (
    "G21 G90 G64 P0.02\nF3000\nG4 P0.25\nM3\nG1 X20 Y1\nG3 X10 Y11 I-10\nM5\nG4 P0.5\nM8\nG1 Z1\nX0 Y0\nM2\n"
)


def joined(chunks: Any) -> SetpointChunk:
    names = ("t", "position", "velocity", "acceleration", "jerk", "line")
    parts = list(chunks)
    return SetpointChunk(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names},
        axes=parts[0].axes,
    )


def test_the_square_by_hand(square: Any) -> None:
    # Four sides of 0.5 s: steps of at most 0.15 s are four steps of 0.125 s each.
    knots = square.knots(0.15)
    assert (knots.count, knots.duration) == (17, 2.0)
    found = joined(knots.chunks())
    np.testing.assert_allclose(found.t, np.arange(17) * 0.125, atol=1e-15)
    # After 0.125 s: 2.5 mm in the ramp of 0.1 s, and 1.25 mm in 0.025 s at 50 mm/s.
    places = [0.0, 3.75, 10.0, 16.25, 20.0]
    np.testing.assert_allclose(found.position[:5, 0], places, atol=1e-12)
    np.testing.assert_allclose(found.velocity[:5, 0], [0.0, 50.0, 50.0, 50.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(found.position[4:9, 1], places, atol=1e-12)
    assert not found.velocity[::4].any()
    assert found.line.tolist() == [3] * 5 + [4] * 4 + [5] * 4 + [6] * 4
    assert repr(knots) == "<Knots: 17 of X Y Z, one every 0.15 s at most>"


@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited"])
@pytest.mark.parametrize("step", [0.001, 0.0137, 10.0])
def test_steps_are_equal_between_stops_and_stops_are_exact(method: Any, step: float) -> None:
    limit = {"time_limit": 0.0} if method == "jerk-limited" else {}
    made = plan(PROGRAM, Machine.load("mill"), method, **limit)
    knots = made.knots(step)
    found = joined(knots.chunks(7))
    assert len(found) == knots.count
    assert found.t[-1] == pytest.approx(made.time, rel=1e-12)
    assert knots.duration == found.t[-1]
    begins, times = [made.path.start_dwell], made.profile.run_times
    for time, pause in zip(times, made.path.dwell, strict=True):
        begins.append(begins[-1] + time + pause)
    resting = np.flatnonzero(~found.velocity.any(axis=1))
    expected = {0.0, *begins, *(begin + time for begin, time in zip(begins, times, strict=False))}
    np.testing.assert_allclose(
        np.unique(found.t[resting].round(9)), np.unique(np.round(list(expected), 9)), atol=2e-9
    )
    for first, last in itertools.pairwise(resting):
        steps = np.diff(found.t[first : last + 1])
        if len(steps) == 1:  # a pause
            assert (found.position[first] == found.position[last]).all()
            assert steps[0] in (0.25, 0.5)
        else:
            assert np.ptp(steps) <= 1e-14
            assert 0.5 * step < steps[0] <= step * (1.0 + 1e-12) or len(steps) == 2
    state = made.at(np.minimum(found.t, made.time))
    np.testing.assert_allclose(found.position, state.position, atol=1e-12)
    np.testing.assert_allclose(found.velocity, state.velocity, atol=1e-9)


def test_a_path_that_ends_in_motion_keeps_its_last_speed() -> None:
    path = Path.from_points([[0, 0, 0], [30, 0, 0]], 0.01)
    made = plan(path, Machine.load("mill"), end_speed=20.0)
    last = joined(made.knots(0.01).chunks())
    assert last.velocity[-1, 0] == pytest.approx(20.0, abs=1e-6)
    assert not last.velocity[0].any()


def test_a_step_that_cannot_be_used_is_refused(square: Any) -> None:
    with pytest.raises(InputError, match=r"the step is 0 s: give a positive number"):
        square.knots(0)
    with pytest.raises(InputError, match="a step of 1e-09 s makes more than 100000000 knots"):
        square.knots(1e-9)
    with pytest.raises(InputError, match="more than 5 knots: choose a longer one"):
        Knots(square.problem, square.profile, 0.01, 5)

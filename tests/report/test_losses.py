"""Time lost by each limit, and the slowest lines, of the square by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.report.activity import NONE, activity
from feedplan.report.losses import Share, SlowLine
from feedplan.report.losses import slowest_lines as slowest_of
from feedplan.report.losses import time_per_limit as time_of


def time_per_limit(problem: Any, profile: SpeedProfile) -> list[Share]:
    return time_of(problem, activity(problem, profile, False))


def slowest_lines(problem: Any, profile: SpeedProfile, count: int = 20) -> list[SlowLine]:
    return slowest_of(problem, profile, activity(problem, profile, False), count)


def test_the_square_is_at_its_feed_for_three_fifths(square: Any) -> None:
    shares = {share.limit: share for share in time_per_limit(square.problem, square.profile)}
    assert shares["feed"].time == pytest.approx(1.2)
    assert shares["feed"].part == pytest.approx(0.6)
    assert shares["X acceleration"].time == pytest.approx(0.4)
    assert shares["Y acceleration"].time == pytest.approx(0.4)
    assert set(shares) == {"feed", "X acceleration", "Y acceleration"}


def test_shares_come_longest_first_and_dwells_count(square: Any) -> None:
    path = replace(square.path, dwell=np.array([0.0, 8.0, 0.0, 0.0]))
    shares = time_per_limit(replace(square.problem, path=path), square.profile)
    assert (shares[0].limit, shares[0].time, shares[0].part) == ("dwell", 8.0, pytest.approx(0.8))
    assert [share.time for share in shares] == sorted((share.time for share in shares), reverse=True)
    assert sum(share.part for share in shares) == pytest.approx(1.0)


def test_a_flat_arc_counts_for_the_axis_that_holds_it(square: Any) -> None:
    kind = square.profile.kind.copy()
    kind[0] = PhaseLaw.PARAMETER_ACCELERATION
    shares = {
        share.limit: share.time
        for share in time_per_limit(square.problem, replace(square.profile, kind=kind))
    }
    assert shares["X acceleration"] == pytest.approx(0.4)


def test_each_side_loses_a_tenth_of_a_second_to_its_axis(square: Any) -> None:
    rows = slowest_lines(square.problem, square.profile)
    assert [row.line for row in rows] == [3, 4, 5, 6]
    for row, axis in zip(rows, "XYXY", strict=True):
        assert row.time == pytest.approx(0.5)
        assert row.lost == pytest.approx(0.1)
        assert (row.speed, row.wanted) == (pytest.approx(40.0), pytest.approx(50.0))
        assert row.limit == f"{axis} acceleration"
        assert row.part == pytest.approx(1.0)
        assert row.stops
        assert not row.rapid


def test_a_rapid_is_measured_against_its_axes(square: Any) -> None:
    path = replace(square.path, feed=np.full(4, np.inf))
    problem = replace(square.problem, path=path, feed=np.full(4, 1000.0))
    row = slowest_lines(problem, square.profile)[0]
    assert row.rapid
    # 20 mm take 0.2 s at the axis's 100 mm/s, not 0.02 s at the 1000 mm/s of the problem's feed.
    assert row.lost == pytest.approx(0.3)
    assert row.wanted == pytest.approx(100.0)


def test_the_worst_lines_come_first_up_to_the_given_number(square: Any) -> None:
    # The third side at half of the feed: 0.05 s up, 0.75 s at 25 mm/s, 0.05 s down instead of 0.4 s in all.
    slow = {
        name: getattr(square.profile, name).copy() for name in ("u0", "u1", "p0", "p1", "value", "duration")
    }
    slow["u1"][6:8], slow["u0"][7:9] = [0.625, 19.375], [0.625, 19.375]
    slow["p1"][6:8], slow["p0"][7:9] = 625.0, 625.0
    slow["value"][7] = 625.0
    slow["duration"][6:9] = [0.05, 0.75, 0.05]
    profile = replace(square.profile, **slow)
    rows = slowest_lines(square.problem, profile, count=2)
    assert [row.line for row in rows] == [5, 3]
    assert rows[0].lost == pytest.approx(0.45)
    assert (rows[0].limit, rows[0].speed) == (NONE, pytest.approx(20.0 / 0.85))


def test_a_line_always_at_its_feed_loses_no_time(square: Any) -> None:
    steady = SpeedProfile(
        piece=np.arange(4, dtype=np.uint32),
        kind=np.full(4, PhaseLaw.FEED, np.uint8),
        axis=np.full(4, 255, np.uint8),
        value=np.full(4, 2500.0),
        u0=np.zeros(4),
        u1=np.full(4, 20.0),
        p0=np.full(4, 2500.0),
        p1=np.full(4, 2500.0),
        duration=np.full(4, 0.4),
        runs=np.array([0, 4]),
    )
    one_run = replace(square.path, runs=steady.runs, dwell=np.zeros(1))
    assert slowest_lines(replace(square.problem, path=one_run), steady) == []

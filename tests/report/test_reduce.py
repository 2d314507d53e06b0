"""Reduction keeps every peak of a curve and every corner of a path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feedplan.report.reduce import Envelope, Polyline
from tests.campaign import examples


def envelope(values: np.ndarray, points: int, cuts: tuple[int, ...] = ()) -> Envelope:
    result = Envelope(len(values), points)
    x, tag = np.arange(len(values), dtype=float), np.arange(len(values)) * 10
    for first, last in zip((0, *cuts), (*cuts, len(values)), strict=True):
        result.add(x[first:last], tag[first:last], values[first:last])
    return result


def test_few_samples_are_all_kept() -> None:
    x, y, tag = envelope(np.array([[3.0], [1.0], [2.0]]), 10).curve(0)
    assert x.tolist() == [0, 1, 2]
    assert y.tolist() == [3, 1, 2]
    assert tag.tolist() == [0, 10, 20]


def test_a_bucket_keeps_its_extremes_where_they_stand() -> None:
    values = np.array([0.0, 5, 1, -3, 2, 2, 9, 2])[:, None]
    x, y, tag = envelope(values, 4).curve(0)
    assert x.tolist() == [1, 3, 4, 6]
    assert y.tolist() == [5, -3, 2, 9]
    assert tag.tolist() == [10, 30, 40, 60]


def test_one_sample_in_a_million_is_not_lost() -> None:
    values = np.zeros((1_000_000, 2))
    values[654_321, 1] = 7.0
    curves = envelope(values, 4000, (100_000, 654_321, 654_322))
    x, y, _ = curves.curve(1)
    assert len(x) <= 4002
    assert (x[y.argmax()], y.max()) == (654_321, 7.0)


def test_the_mean_of_a_sawtooth_is_its_middle() -> None:
    values = np.stack([np.arange(10_000) % 2, np.arange(10_000.0)], axis=1)
    curves = envelope(values, 1000, (3, 5000))
    x, mean = curves.mean(0, 100)
    assert len(x) <= 100
    # The first sample has weight 0, so the first mean may be slightly off.
    assert mean[1:] == pytest.approx(0.5)
    assert mean[0] == pytest.approx(0.5, abs=0.01)


def test_the_mean_is_over_x_not_over_samples() -> None:
    # Nine tenths of the samples lie in the first tenth of x, where the value is 1; elsewhere it is 0.
    x = np.concatenate([np.linspace(0.0, 0.1, 900), np.linspace(0.1, 1.0, 101)[1:]])
    curves = Envelope(1000, 2)
    curves.add(x, np.zeros(1000, np.int32), (x <= 0.1).astype(float)[:, None])
    assert curves.mean(0, 10)[1] == pytest.approx([0.1])


def test_gaps_hide_no_peak() -> None:
    values = np.full((100, 1), np.nan)
    values[42] = 1.0
    x, y, _ = envelope(values, 4).curve(0)
    assert (x[np.nanargmax(y)], np.nanmax(y)) == (42, 1.0)


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=200), st.integers(2, 60), st.data())
@settings(max_examples=examples(200))
def test_extremes_ends_and_order_survive_any_cuts(
    values: list[float], points: int, data: st.DataObject
) -> None:
    column = np.array(values)[:, None]
    cuts = tuple(sorted(data.draw(st.lists(st.integers(0, len(values)), max_size=4))))
    x, y, _ = envelope(column, points, cuts).curve(0)
    assert (y.min(), y.max()) == (column.min(), column.max())
    assert (np.diff(x) > 0).all()
    assert (column[x.astype(int), 0] == y).all()
    whole = envelope(column, points).curve(0)
    assert np.array_equal(whole[0], x)


def distance(point: np.ndarray, line: np.ndarray) -> float:
    """Distance of a point from the nearest segment of a polyline."""
    best = np.inf
    for a, b in pairwise(line):
        along = b - a
        t = np.clip((point - a) @ along / (along @ along or 1.0), 0.0, 1.0)
        best = min(best, float(np.linalg.norm(point - a - t * along)))
    return best


def polyline(
    points: np.ndarray, limit: int, tolerance: float, size: int = 1000
) -> tuple[np.ndarray, np.ndarray, float]:
    result = Polyline(limit, tolerance)
    columns = np.pad(points, ((0, 0), (0, 4 - points.shape[1])))
    for first in range(0, len(points), size):
        result.add(columns[first : first + size], np.arange(first, min(first + size, len(points))))
    kept, (tag,), tolerance = result.result()
    return kept[:, : points.shape[1]], tag, tolerance


def test_a_square_of_many_points_is_reduced_to_its_corners() -> None:
    side = np.linspace(0.0, 1.0, 500, endpoint=False)[:, None]
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    points = np.concatenate([a + side * (b - a) for a, b in pairwise(corners)])
    points = np.concatenate([points, corners[-1:]])
    kept, tag, tolerance = polyline(points, 100, 1e-9)
    assert kept == pytest.approx(corners)
    assert tag.tolist() == [0, 500, 1000, 1500, 2000]
    assert tolerance == 1e-9


def test_a_path_there_and_back_keeps_its_far_end() -> None:
    along = np.concatenate([np.linspace(0, 1, 100), np.linspace(1, 0, 100)])
    kept, _, _ = polyline(np.stack([along, np.zeros(200)], axis=1), 50, 1e-6)
    assert kept[:, 0].max() == 1.0


def test_every_sample_stays_within_the_returned_tolerance() -> None:
    random = np.random.default_rng(7)
    points = np.cumsum(random.normal(size=(5000, 3)), axis=0)
    kept, tag, tolerance = polyline(points, 200, 1e-3, size=137)
    assert len(kept) <= 200
    assert (kept == points[tag]).all()
    assert (np.diff(tag) > 0).all()
    assert tag[0] == 0
    assert tag[-1] == 4999
    worst = max(distance(point, kept) for point in points[::25])
    assert 0.01 * tolerance < worst <= tolerance


def test_zero_points_and_one_point_can_be_reduced() -> None:
    assert Polyline(10, 1.0).result()[0].size == 0
    assert len(polyline(np.zeros((1, 3)), 10, 1.0)[0]) == 1
    assert len(polyline(np.zeros((5000, 3)), 10, 1.0)[0]) == 2

"""Speed limits where pieces meet, on pieces of any degree."""

from __future__ import annotations

import math

import numpy as np

from feedplan.constraints.junction import junction_limit
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.joints import end_edges, tangent_jumps
from tests.along import path_along
from tests.turns import arc


def bezier(*points: list[float]) -> CompositeCurve:
    return CompositeCurve.from_bezier(list(points))


def test_end_edges_are_the_first_and_the_last_that_have_a_length() -> None:
    curve = CompositeCurve.joined(
        [
            bezier([0, 0], [1, 0]),
            bezier([1, 0], [1, 0], [1, 0], [3, 4]),
            bezier([3, 4], [4, 4], [5, 5], [5 + 1e-14, 5], [5, 5]),
            bezier([5, 5], [5, 5], [5, 5]),
        ]
    )
    start, end = end_edges(curve)
    np.testing.assert_allclose(start, [[1, 0], [2, 4], [1, 0], [0, 0]])
    np.testing.assert_allclose(end, [[1, 0], [2, 4], [1, 1], [0, 0]])
    empty = CompositeCurve(np.empty((0, 2)), None, np.zeros(1), np.empty(0))
    assert len(tangent_jumps(empty)) == 0


def test_a_jump_of_velocity_limits_the_speed_at_corners_of_any_degree() -> None:
    # Along X; a cubic that turns from X to Y; a corner of 90 degrees into −X where both sides have C' = 0.
    curve = CompositeCurve.joined(
        [
            bezier([0, 0], [2, 0]),
            bezier([2, 0], [3, 0], [4, 1], [4, 2], [4, 2]),
            bezier([4, 2], [4, 2], [0, 2]),
            arc([0, 2], (0, 0), math.pi / 2),
        ]
    )
    limit = junction_limit(path_along(curve), np.array([6.0, 10.0]))
    np.testing.assert_array_equal(limit, [0.0, np.inf, 6.0, np.inf, 0.0])

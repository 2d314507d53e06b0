"""Arcs, circles and helices against their closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feedplan.curves.arc import arc, circle, helix
from feedplan.curves.composite import CompositeCurve, JointKind
from feedplan.curves.length import CurveLength
from feedplan.errors import InputError

SWEEPS = st.floats(1e-3, 30.0) | st.floats(-30.0, -1e-3)


def fine(curve: CompositeCurve, count: int = 33) -> np.ndarray:
    piece = np.repeat(np.arange(len(curve)), count)
    u = np.outer(curve.width, np.linspace(0, 1, count)).ravel()
    return curve.evaluate(piece, u)[0]


def test_a_full_circle_is_four_quarters_and_closed() -> None:
    curve = circle([1.0, 2.0, 5.0], 10.0)
    assert len(curve) == 4
    assert curve.closed
    corners = [[11, 2], [1, 12], [-9, 2], [1, -8], [11, 2]]
    assert curve.control_points[[0, 2, 5, 8, 11], :2].tolist() == corners
    assert CurveLength(curve).total == pytest.approx(20 * math.pi, rel=1e-13, abs=0)
    assert curve.joints().kind.tolist() == [JointKind.C1] * 4
    assert len(curve.cusps()) == 0


@given(SWEEPS, st.floats(0.01, 1e4))
def test_an_arc_keeps_its_radius_and_its_length(sweep: float, radius: float) -> None:
    curve = arc([3.0, 7.0 + radius, 4.0], (4.0, 7.0), sweep, plane=(2, 1))
    points = fine(curve)
    assert np.abs(np.hypot(points[:, 2] - 4.0, points[:, 1] - 7.0) - radius).max() <= 8e-16 * (radius + 11)
    assert (points[:, 0] == 3.0).all()
    assert CurveLength(curve).total == pytest.approx(radius * abs(sweep), rel=1e-13)
    end = (4.0 - radius * math.sin(sweep), 7.0 + radius * math.cos(sweep))
    assert points[-1, [2, 1]] == pytest.approx(end, abs=2e-14 * (radius + 11))
    if len(curve) > 1:
        assert curve.joints().kind.min() >= JointKind.C1


@given(SWEEPS, st.integers(3, 9), st.floats(-50, 50))
def test_a_helix_is_within_its_bound_of_the_true_one(sweep: float, degree: int, rise: float) -> None:
    tolerance = {3: 1e-3, 4: 1e-3}.get(degree, 1e-9)
    curve, bound = helix([5.0, 0, 1], (0, 0), sweep, [0, 0, rise], degree=degree, tolerance=tolerance)
    assert bound <= tolerance
    points = fine(curve, 9)
    assert np.abs(np.hypot(points[:, 0], points[:, 1]) - 5).max() <= 5e-15
    angle = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    assert np.abs(points[:, 2] - 1 - rise * angle / sweep).max() <= bound + 1e-12
    if len(curve) > 1:
        assert curve.joints(derivative=1e-10).kind.min() >= JointKind.C1


def test_higher_degrees_take_fewer_pieces() -> None:
    count = {
        degree: len(helix([5.0, 0, 0], (0, 0), 2 * math.pi, [0, 0, 10.0], degree=degree)[0])
        for degree in (5, 7, 9)
    }
    assert count[5] > count[7] > count[9]
    assert count[7] <= 12


def test_two_axes_may_travel_with_a_helix() -> None:
    curve, bound = helix([5.0, 0, 0, 0], (0, 0), 3.0, [0, 0, 3.0, -90.0])
    points = fine(curve)
    assert np.abs(points[:, 3] + 30 * points[:, 2]).max() <= 1e-13 * 90
    assert points[-1, 2:].tolist() == [3, -90]
    assert bound <= 1e-9


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: arc([0.0, 0], (0, 0), 1.0), "the arc starts at its centre"),
        (lambda: arc([1.0, 0], (0, 0), 0.0), "the sweep is 0.0 rad"),
        (lambda: arc([1.0, 0], (0, 0), math.nan), "the sweep is nan rad"),
        (lambda: arc([1.0, 0], (0, 0), 1.0, plane=(0, 2)), r"the plane \(0, 2\) of 2 axes"),
        (lambda: arc([1.0, math.nan], (0, 0), 1.0), "control point 0, axis 1, is NaN"),
        (lambda: circle([0.0, 0], -1.0), r"the radius is -1\.0 mm"),
        (lambda: helix([1.0, 0, 0], (0, 0), 1.0, [1.0, 0, 1]), "0 for those of the plane"),
        (
            lambda: helix([1.0, 0, 0], (0, 0), 1.0, [0, 0, 1.0], degree=2),
            "the degree of the helix is 2: give 3 to 9",
        ),
        (lambda: helix([1.0, 0, 0], (0, 0), 1e3, [0, 0, 1e3], degree=3, tolerance=1e-30), "would take"),
    ],
)
def test_what_is_no_arc_is_refused(make: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()  # type: ignore[operator]

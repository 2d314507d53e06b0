"""Lengths along curves of any degree: closed forms, changes that keep the length, numerical integration."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.errors import InputError

BUTTERFLY = Path(__file__).parents[2] / "benchmarks/curves/butterfly.json"


def test_the_unit_parabola_has_its_known_length() -> None:
    curve = CompositeCurve.from_bezier([[0, 0], [0.5, 0], [1, 0.5]])
    for same in (curve, curve.elevated(9), curve.reversed(), curve.split(0, [0.1, 0.7])):
        length = CurveLength(same)
        assert length.total == pytest.approx((math.sqrt(2) + math.asinh(1)) / 2, abs=1e-15)
        assert length.error <= 1e-12


def test_a_parabola_by_weights_has_the_same_length() -> None:
    # Weights 1, r, r² change only the parametrisation.
    curve = CompositeCurve.from_bezier([[0, 0], [0.5, 0], [1, 0.5]], [1, 7, 49])
    assert CurveLength(curve).total == pytest.approx((math.sqrt(2) + math.asinh(1)) / 2, abs=1e-15)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-8, 1e-12, 1e-15])
def test_a_cusp_costs_no_accuracy(accuracy: float) -> None:
    # (s², s³) on [−1, 1]: its length is 2 (13^1.5 − 8)/27.
    curve = CompositeCurve.from_bezier([[1.0, -1], [-1 / 3, 1], [-1 / 3, -1], [1, 1]], width=2.0)
    exact = 2 * (13**1.5 - 8) / 27
    length = CurveLength(curve, accuracy)
    assert abs(length.total - exact) <= length.error <= (accuracy + 3e-15) * exact
    _, u = length.locate(np.linspace(0, length.total, 101), 1e-13)
    s = u - 1
    x = 2.25 * s * s
    from_cusp = np.copysign(8 / 27 * np.expm1(1.5 * np.log1p(x)), s)
    assert np.abs(from_cusp + exact / 2 - np.linspace(0, exact, 101)).max() <= length.error + 1e-13


def test_the_published_butterfly_agrees_with_integration() -> None:
    data = json.loads(BUTTERFLY.read_text())
    curve = CompositeCurve.from_nurbs(data["control_points"], data["knots"], 3, data["weights"])
    length = CurveLength(curve)

    def speed(u: float, piece: int) -> float:
        return float(np.linalg.norm(curve.evaluate(piece, u, order=1)[1]))

    whole = sum(
        quad(speed, 0, float(width), args=(i,), epsabs=1e-11, epsrel=1e-12, limit=200)[0]
        for i, width in enumerate(curve.width)
    )
    assert length.total == pytest.approx(whole, rel=1e-11)
    starts = length.length(np.arange(len(curve)), np.zeros(len(curve)))
    assert starts[0] == 0
    assert (np.diff(starts) > 0).all()
    assert np.abs(length.length(*length.locate(starts[1:], 1e-12)) - starts[1:]).max() <= 1e-12


def test_the_middle_of_the_unit_parabola_is_found() -> None:
    length = CurveLength(CompositeCurve.from_bezier([[0, 0], [0.5, 0], [1, 0.5]]))
    _, (start, u, end) = length.locate([0.0, length.total / 2, length.total], 1e-14)
    assert (start, end) == (0.0, 1.0)
    assert (u * math.sqrt(1 + u * u) + math.asinh(u)) / 2 == pytest.approx(length.total / 2, abs=3e-14)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_every_length_is_met_by_integration_too(seed: int, degree: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(4 * degree + 1, 3))
    bends = [points[i * degree : (i + 1) * degree + 1] for i in range(4)]
    curve = CompositeCurve.joined([CompositeCurve.from_bezier(bend, width=1.7) for bend in bends])
    length = CurveLength(curve)
    wanted = np.sort(rng.uniform(0, length.total, 5))
    pieces, places = length.locate(wanted, 1e-9)
    starts = length.length(np.arange(4), np.zeros(4))

    def speed(u: float, piece: int) -> float:
        return float(np.linalg.norm(curve.evaluate(piece, u, order=1)[1]))

    for s, piece, u in zip(wanted, pieces, places, strict=True):
        rest = quad(speed, 0, float(u), args=(int(piece),), epsabs=1e-10, limit=200)[0]
        assert starts[piece] + rest == pytest.approx(s, abs=3e-9)


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.booleans())
def test_every_place_is_found_again_by_its_length(seed: int, degree: int, rational: bool) -> None:
    rng = np.random.default_rng(seed)
    points = degree + 4
    knots = np.concatenate([np.zeros(degree + 1), [1.0, 2, 3], np.full(degree + 1, 4.0)])
    weights = 10 ** rng.uniform(-1, 1, points) if rational else None
    curve = CompositeCurve.from_nurbs(rng.uniform(-10, 10, (points, 3)), knots, degree, weights)
    length = CurveLength(curve)
    wanted = np.sort(rng.uniform(0, length.total, 10))
    found = length.length(*length.locate(wanted, 1e-12 * length.total))
    assert np.abs(found - wanted).max() <= 2e-12 * length.total
    finer = CurveLength(curve.split(np.arange(4), rng.uniform(0, curve.width)))
    assert finer.total == pytest.approx(length.total, rel=1e-12)
    assert CurveLength(curve.with_width(7.0)).total == pytest.approx(length.total, rel=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1e3, 1e6])
def test_lengths_scale_with_the_curve(size: float) -> None:
    control = np.array([[0.0, 0], [3, 5], [-2, 5], [1, 0.1]])
    unit = CurveLength(CompositeCurve.from_bezier(control)).total
    assert CurveLength(CompositeCurve.from_bezier(size * control)).total == pytest.approx(
        size * unit, rel=1e-14
    )


def test_lengths_beyond_the_ends_give_the_ends() -> None:
    length = CurveLength(CompositeCurve.from_bezier([[0.0], [2]], width=5.0))
    _, u = length.locate([-1.0, 0, 1, length.total, 9], 1e-12)
    assert u == pytest.approx([0, 0, 2.5, 5, 5], rel=1e-15)
    assert u[[1, 3]].tolist() == [0, 5]


def test_what_cannot_be_used_is_refused_with_a_sentence() -> None:
    with pytest.raises(InputError, match="the curve is empty"):
        CurveLength(CompositeCurve.from_pieces(np.empty((0, 3, 2)), []))
    with pytest.raises(InputError, match="the accuracy of lengths is 0"):
        CurveLength(CompositeCurve.from_bezier([[0.0], [2]]), 0.0)

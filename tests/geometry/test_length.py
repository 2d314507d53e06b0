"""Lengths along a path against closed forms and numerical integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.length import PathLength
from feedplan.geometry.path import Path


def path_of(control_points: NDArray[np.float64], width: NDArray[np.float64]) -> Path:
    count, axes = len(width), control_points.shape[2]
    return Path(
        axes=tuple("XYZABC"[:axes]),
        curve=CompositeCurve.from_pieces(control_points, width),
        feed=np.full(count, 100.0),
        move=np.zeros((count, 2), np.int64),
        line=np.arange(1, count + 1, dtype=np.int32),
        runs=np.array([0, count]),
        dwell=np.zeros(1),
        tolerance=np.zeros(count),
    )


def chain(points: NDArray[np.float64]) -> Path:
    """A continuous chain: even rows are joints, odd rows the middle control points."""
    control = np.stack([points[0:-2:2], points[1:-1:2], points[2::2]], axis=1)
    return path_of(control, np.linalg.norm(control[:, 2] - control[:, 0], axis=1) + 0.1)


def speed(path: Path, piece: int, u: float) -> float:
    a, b, c = path.curve.by_piece[piece]
    t = u / path.width[piece]
    return float(np.linalg.norm(2 / path.width[piece] * ((1 - t) * (b - a) + t * (c - b))))


def test_the_unit_parabola_has_its_known_length() -> None:
    path = path_of(np.array([[[0.0, 0.0], [0.5, 0.0], [1.0, 0.5]]]), np.ones(1))
    length = PathLength(path)
    assert length.total == pytest.approx((math.sqrt(2) + math.asinh(1)) / 2, abs=1e-15)
    assert length.error <= 1e-13
    places = length.locate([0.0, length.total / 2, length.total], 1e-14)
    assert places.u[[0, 2]].tolist() == [0.0, 1.0]
    u = places.u[1]
    assert (u * math.sqrt(1 + u * u) + math.asinh(u)) / 2 == pytest.approx(length.total / 2, abs=3e-14)


@given(st.integers(0, 2**32 - 1), st.sampled_from(["sarfraz", "newton"]))
def test_every_length_is_met_by_integration_too(seed: int, interpolator: str) -> None:
    rng = np.random.default_rng(seed)
    path = chain(rng.normal(size=(9, 3)))
    length = PathLength(path)
    wanted = np.sort(rng.uniform(0, length.total, 5))
    places = length.locate(wanted, 1e-9, interpolator)
    starts = length.length(np.arange(4), np.zeros(4))
    for s, piece, u in zip(wanted, places.piece, places.u, strict=True):
        foot = [float(u) / 2]
        rest = quad(lambda x, i=piece: speed(path, i, x), 0, u, points=foot, epsabs=1e-10, limit=200)[0]
        assert starts[piece] + rest == pytest.approx(s, abs=3e-9)
    assert places.miss.max() <= 1e-9


def test_lengths_beyond_the_ends_give_the_ends() -> None:
    path = chain(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, -1.0], [4.0, 0.0]]))
    for interpolator in ("sarfraz", "newton"):
        places = PathLength(path).locate([-1.0, 0.0, 99.0], 1e-9, interpolator)
        assert places.piece.tolist() == [0, 0, 1]
        assert places.u.tolist() == [0.0, 0.0, path.width[1]]
        assert places.iterations.tolist() == [0, 0, 0]


def test_what_cannot_be_used_is_refused_with_a_sentence() -> None:
    with pytest.raises(InputError, match="the path is empty"):
        PathLength(path_of(np.empty((0, 3, 2)), np.empty(0)))
    length = PathLength(chain(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])))
    with pytest.raises(InputError, match="use one of sarfraz, newton"):
        length.locate([0.0], 1e-9, "euler")

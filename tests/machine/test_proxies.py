"""Polynomial stand-ins for joint motion keep their proven distance from it."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.machine.along import derivatives
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.kinematics.cylindrical import Cylindrical
from feedplan.machine.proxies import Proxies, build_proxies
from tests.machine.kinematics.bundled import all_kinematics
from tests.machine.test_along import line_past_the_axis, random_curves

Array = NDArray[np.float64]
CYLINDER = Cylindrical(("C", "X", "Z"))


def value(coefficients: Array, t: float) -> Array:
    """Bernstein form (m, degree + 1, joints) at t."""
    degree = coefficients.shape[1] - 1
    basis = [math.comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)]
    result: Array = np.einsum("i,mik->mk", np.array(basis), coefficients)
    return result


def errors(kinematics: Kinematics, points: Array, width: Array, proxies: Proxies) -> tuple[Array, Array]:
    """Greatest |q' − proxy'| and |q'' − proxy''| (m, joints) found at 23 points of each part."""
    degree = proxies.slope.shape[1] - 1
    change = np.diff(proxies.slope, axis=1) * degree / proxies.width[:, None, None]
    worst = np.zeros((2, *proxies.slope_error.shape))
    for t in np.linspace(0, 1, 23):
        fraction = proxies.part[:, 0] + t * (proxies.part[:, 1] - proxies.part[:, 0])
        q = derivatives(kinematics, points[proxies.piece], width[proxies.piece], fraction, 2)
        worst[0] = np.maximum(worst[0], np.abs(q[1] - value(proxies.slope, t)))
        worst[1] = np.maximum(worst[1], np.abs(q[2] - value(change, t)))
    return worst[0], worst[1]


@pytest.mark.parametrize(("d", "most"), [(10.0, 100), (1.0, 150), (0.05, 200)])
def test_the_cylindrical_machine_needs_few_parts_for_nine_digits(d: float, most: int) -> None:
    line = line_past_the_axis(d, 1)
    tolerance = np.array([np.degrees(1e-9 / d**2), 1e-9 / d, 1e-9])
    proxies = build_proxies(CYLINDER, *line, tolerance)
    assert len(proxies) <= most
    assert (proxies.curvature_error <= tolerance).all()
    slope, curvature = errors(CYLINDER, *line, proxies)
    noise = np.array([np.degrees(1 / d**2), 1 / d, 1.0]) * 1e-12
    assert (curvature <= proxies.curvature_error + noise).all()
    assert (slope <= proxies.slope_error + noise * d).all()


@pytest.mark.parametrize("name", all_kinematics())
def test_stand_ins_keep_their_distance_on_every_machine(name: str) -> None:
    kinematics = all_kinematics()[name]
    points, width = random_curves(kinematics, 10, seed=11, step=0.5)
    proxies = build_proxies(kinematics, points, width, np.full(len(kinematics.joint_names), 1e-6), nodes=6)
    slope, curvature = errors(kinematics, points, width, proxies)
    assert (curvature <= proxies.curvature_error + 1e-11).all()
    assert (slope <= proxies.slope_error + 1e-11).all()
    assert (proxies.curvature_error <= 1e-6).all()


def test_parts_cover_their_pieces_without_gaps() -> None:
    points, width = random_curves(CYLINDER, 5, seed=12)
    proxies = build_proxies(CYLINDER, points, width, [1e-8] * 3)
    for i in range(5):
        own = proxies.part[proxies.piece == i]
        assert own[0, 0] == 0
        assert own[-1, 1] == 1
        assert (own[1:, 0] == own[:-1, 1]).all()
    assert proxies.width.sum() == pytest.approx(width.sum())


def test_a_cartesian_machine_is_its_own_stand_in() -> None:
    mill = all_kinematics()["mill"]
    points, width = random_curves(mill, 5, seed=13)
    proxies = build_proxies(mill, points, width, [1e-9] * 3)
    assert len(proxies) == 5
    assert np.abs(errors(mill, points, width, proxies)).max() < 1e-12 * 30


def test_through_the_axis_the_middle_parts_say_that_nothing_is_proven() -> None:
    proxies = build_proxies(CYLINDER, *line_past_the_axis(0.0, 1), [1e-6] * 3, nodes=5)
    open_ = np.isinf(proxies.curvature_error).any(axis=1)
    assert open_.any()
    assert proxies.part[open_] == pytest.approx(100 / 230, abs=1e-6)


def test_standing_on_the_axis_gives_up_soon() -> None:
    still = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]])
    proxies = build_proxies(CYLINDER, still, np.array([5.0]), [1e-6] * 3)
    assert len(proxies) == 1024
    assert np.isinf(proxies.curvature_error).all()

"""Polynomial interpolants of joint motion stay within their proven distance from it."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.machine.joint_interpolants import Interpolants, joint_interpolants
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.kinematics.cylindrical import Cylindrical
from feedplan.machine.path_derivatives import derivatives
from tests.machine.kinematics.bundled import all_kinematics
from tests.machine.test_path_derivatives import line_past_the_axis, random_curves

Array = NDArray[np.float64]
CYLINDER = Cylindrical(("C", "X", "Z"))


def value(coefficients: Array, t: float) -> Array:
    """Polynomials in Bernstein form (m, degree + 1, joints) at t."""
    degree = coefficients.shape[1] - 1
    basis = [math.comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)]
    result: Array = np.einsum("i,mik->mk", np.array(basis), coefficients)
    return result


def errors(kinematics: Kinematics, points: Array, width: Array, found: Interpolants) -> tuple[Array, Array]:
    """Greatest |q' − interpolant'| and |q'' − interpolant''| (m, joints) at 23 points of each part."""
    degree = found.slope.shape[1] - 1
    change = np.diff(found.slope, axis=1) * degree / found.width[:, None, None]
    worst = np.zeros((2, *found.slope_error.shape))
    for t in np.linspace(0, 1, 23):
        fraction = found.part[:, 0] + t * (found.part[:, 1] - found.part[:, 0])
        q = derivatives(kinematics, points[found.piece], width[found.piece], fraction, 2)
        worst[0] = np.maximum(worst[0], np.abs(q[1] - value(found.slope, t)))
        worst[1] = np.maximum(worst[1], np.abs(q[2] - value(change, t)))
    return worst[0], worst[1]


@pytest.mark.parametrize(("d", "most"), [(10.0, 100), (1.0, 150), (0.05, 200)])
def test_the_cylindrical_machine_needs_few_parts_for_nine_digits(d: float, most: int) -> None:
    line = line_past_the_axis(d, 1)
    tolerance = np.array([np.degrees(1e-9 / d**2), 1e-9 / d, 1e-9])
    found = joint_interpolants(CYLINDER, *line, tolerance)
    assert len(found) <= most
    assert (found.curvature_error <= tolerance).all()
    slope, curvature = errors(CYLINDER, *line, found)
    noise = np.array([np.degrees(1 / d**2), 1 / d, 1.0]) * 1e-12
    assert (curvature <= found.curvature_error + noise).all()
    assert (slope <= found.slope_error + noise * d).all()


@pytest.mark.parametrize("name", all_kinematics())
def test_stand_ins_keep_their_distance_on_every_machine(name: str) -> None:
    kinematics = all_kinematics()[name]
    points, width = random_curves(kinematics, 10, seed=11, step=0.5)
    found = joint_interpolants(kinematics, points, width, np.full(len(kinematics.joint_names), 1e-6), nodes=6)
    slope, curvature = errors(kinematics, points, width, found)
    assert (curvature <= found.curvature_error + 1e-11).all()
    assert (slope <= found.slope_error + 1e-11).all()
    assert (found.curvature_error <= 1e-6).all()


def test_parts_cover_their_pieces_without_gaps() -> None:
    points, width = random_curves(CYLINDER, 5, seed=12)
    found = joint_interpolants(CYLINDER, points, width, [1e-8] * 3)
    for i in range(5):
        own = found.part[found.piece == i]
        assert own[0, 0] == 0
        assert own[-1, 1] == 1
        assert (own[1:, 0] == own[:-1, 1]).all()
    assert found.width.sum() == pytest.approx(width.sum())


def test_a_cartesian_machine_is_its_own_stand_in() -> None:
    mill = all_kinematics()["mill"]
    points, width = random_curves(mill, 5, seed=13)
    found = joint_interpolants(mill, points, width, [1e-9] * 3)
    assert len(found) == 5
    assert np.abs(errors(mill, points, width, found)).max() < 1e-12 * 30


def test_through_the_axis_the_middle_parts_say_that_nothing_is_proven() -> None:
    found = joint_interpolants(CYLINDER, *line_past_the_axis(0.0, 1), [1e-6] * 3, nodes=5)
    open_ = np.isinf(found.curvature_error).any(axis=1)
    assert open_.any()
    assert found.part[open_] == pytest.approx(100 / 230, abs=1e-6)


def test_standing_on_the_axis_gives_up_soon() -> None:
    still = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]])
    found = joint_interpolants(CYLINDER, still, np.array([5.0]), [1e-6] * 3)
    assert len(found) == 1024
    assert np.isinf(found.curvature_error).all()

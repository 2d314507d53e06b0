"""Joint derivatives along tip curves: closed forms, differences in extended precision, proven bounds."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.machine.kinematics import Kinematics
from feedplan.machine.kinematics.corexy import CoreXY
from feedplan.machine.kinematics.cylindrical import Cylindrical
from feedplan.machine.numbers import Number
from feedplan.machine.path_derivatives import derivatives, positions
from tests.machine import taylor
from tests.machine.enclosures import enclosures
from tests.machine.kinematics.bundled import all_kinematics, random_tips

CYLINDER = Cylindrical(("C", "X", "Z"))
Array = NDArray[np.float64]


def line_past_the_axis(distance: float, count: int) -> tuple[Array, Array]:
    """Straight tip paths x = −100 … 130, y = distance, z = 0.3 x with u = x + 100, `count` times."""
    ends = np.array([[-100.0, distance, -30.0], [130.0, distance, 39.0]])
    return np.tile(ends, (count, 1, 1)), np.full(count, 230.0)


def closed_forms(x: Array, d: float) -> tuple[Array, Array, Array]:
    """q', q'', q''' of the angle [deg] and of the radius on that line."""
    r = np.hypot(x, d)
    first = np.stack([np.degrees(-d / r**2), x / r], axis=-1)
    second = np.stack([np.degrees(2 * d * x / r**4), d**2 / r**3], axis=-1)
    third = np.stack([np.degrees(2 * d * (d**2 - 3 * x**2) / r**6), -3 * d**2 * x / r**5], axis=-1)
    return first, second, third


def random_curves(kinematics: Kinematics, count: int, seed: int, step: float = 2.0) -> tuple[Array, Array]:
    """Cubic pieces whose control points are a random walk in steps of about `step` [mm, deg]; directions I,
    J, K take steps of 1/100 of it."""
    generator = np.random.default_rng(seed)
    scale = np.array([0.01 if name in "IJK" else 1.0 for name in kinematics.tip_names]) * step
    walk = np.cumsum(generator.normal(size=(count, 4, len(scale))), axis=1) * scale
    return random_tips(kinematics, count, seed)[:, None, :] + walk, generator.uniform(1.0, 5.0, size=count)


@pytest.mark.parametrize("d", [10.0, 1.0, 0.05])
def test_the_cylindrical_machine_on_a_line_past_its_axis(d: float) -> None:
    x = np.concatenate([np.linspace(-100, 130, 401), np.linspace(-3 * d, 3 * d, 201)])
    q = derivatives(CYLINDER, *line_past_the_axis(d, len(x)), (x + 100) / 230)
    for order, exact in enumerate(closed_forms(x, d), start=1):
        scale = np.abs(exact).max(axis=0)
        # A fraction of 230 mm has a rounding error of 3e-14 mm; q^(k+1) turns this into an error of q^(k).
        assert q[order, :, :2] == pytest.approx(exact, abs=1e-13 * max(1.0, 10 / d) * scale.max())
    assert q[1, :, 2] == pytest.approx(np.full(len(x), 0.3))
    assert np.abs(q[2:, :, 2]).max() == 0


def test_the_cylindrical_machine_turns_fastest_abreast_of_its_axis() -> None:
    # θ' = −1/d and r'' = 1/d at the place of the line nearest to the axis, d = 10 mm.
    q = derivatives(CYLINDER, *line_past_the_axis(10.0, 1), np.array([100 / 230]))
    assert np.radians(q[1, 0, 0]) == pytest.approx(-0.1)
    assert q[:, 0, 1] == pytest.approx([10, 0, 0.1, 0], abs=1e-14)


@pytest.mark.parametrize("name", all_kinematics())
def test_each_derivative_is_the_difference_of_the_one_below(name: str) -> None:
    kinematics = all_kinematics()[name]
    points, width = random_curves(kinematics, 20, seed=5)
    step = np.longdouble(2.0) ** -9
    stencil = {1: 4 / np.longdouble(5), 2: -1 / np.longdouble(5), 3: 4 / np.longdouble(105)}
    stencil[4] = -1 / np.longdouble(280)
    at = np.full(20, 0.5, dtype=np.longdouble)

    def q(fraction: taylor.Long, order: int) -> taylor.Long:
        return taylor.derivatives(kinematics, points, width, fraction, order)

    exact = derivatives(kinematics, points, width, np.full(20, 0.5), 4)
    for k in range(4):
        slope = sum(c * (q(at + i * step, k)[k] - q(at - i * step, k)[k]) for i, c in stencil.items())
        slope = slope / (step * width[:, None])
        assert exact[k + 1] == pytest.approx(
            slope.astype(float), rel=1e-9, abs=1e-9 * (1 + float(np.abs(slope).max()))
        )


@pytest.mark.parametrize("name", all_kinematics())
def test_derivatives_are_those_of_the_formula_in_extended_precision(name: str) -> None:
    kinematics = all_kinematics()[name]
    points, width = random_curves(kinematics, 50, seed=3, step=0.5)
    fraction = np.random.default_rng(3).uniform(size=50)
    found = derivatives(kinematics, points, width, fraction, 9)
    exact = taylor.derivatives(kinematics, points, width, fraction, 9).astype(float)
    scale = np.abs(exact).max(axis=1, keepdims=True)
    assert (np.abs(found - exact) <= 1e-11 * scale + 1e-15).all()


@pytest.mark.parametrize("name", all_kinematics())
def test_order_zero_is_the_position(name: str) -> None:
    kinematics = all_kinematics()[name]
    points, width = random_curves(kinematics, 50, seed=6)
    q = derivatives(kinematics, points, width, np.zeros(50))
    assert q[0] == pytest.approx(positions(kinematics, points[:, 0]), rel=1e-13)


@pytest.mark.parametrize("name", [name for name in all_kinematics() if "direction" not in name])
def test_the_tip_comes_back_with_all_its_derivatives(name: str) -> None:
    # The feed counts along the tip even where joints are programmed: tip(joints) needs derivatives too.
    kinematics = all_kinematics()[name]
    generator = np.random.default_rng(4)
    tip = [taylor.Series(generator.normal(size=(6, 10))) for _ in kinematics.tip_names]
    for axis in tip:
        axis.c[0] += 80.0
    for axis, back in zip(tip, kinematics.tip(kinematics.joints(tip)), strict=True):
        assert back.c.astype(float) == pytest.approx(axis.c.astype(float), abs=1e-9)


@pytest.mark.parametrize("name", all_kinematics())
def test_enclosures_hold_dense_samples_of_every_order(name: str) -> None:
    kinematics = all_kinematics()[name]
    order = 9
    points, width = random_curves(kinematics, 30, seed=7, step=0.5)
    bounds = enclosures(kinematics, points, width, order)
    assert bounds.bounded.all()
    factorials = np.array([math.factorial(k) for k in range(order + 1)])[:, None, None]
    low, high = np.full(bounds.lo.shape, np.inf), np.full(bounds.lo.shape, -np.inf)
    for t in np.linspace(0, 1, 41):
        at = np.full(30, t, dtype=np.longdouble)
        sample = taylor.derivatives(kinematics, points, width, at, order) / factorials
        turns = np.round((bounds.middle[0] - sample[0].astype(float)) / 360) * np.array(kinematics.turning)
        sample[0] += turns * 360
        assert (bounds.lo <= sample).all()
        assert (sample <= bounds.hi).all()
        low, high = np.minimum(low, sample.astype(float)), np.maximum(high, sample.astype(float))
    # The bounds are tight: q'' within 5 % of its true range, the highest order within a factor of 30.
    spread = high - low
    assert np.median(((bounds.hi - bounds.lo)[2] + 1e-12) / (spread[2] + 1e-12)) < 1.05
    greatest = np.maximum(np.abs(low[order]), np.abs(high[order]))
    moving = greatest > 0
    assert not moving.any() or np.median(bounds.magnitude[order][moving] / greatest[moving]) < 30


def test_an_enclosure_closes_in_on_the_range_as_the_part_shrinks() -> None:
    excess = []
    for parts in (64, 128):
        ends = np.linspace(0, 1, parts + 1)
        bounds = enclosures(CYLINDER, *line_past_the_axis(10.0, parts), 9, np.stack([ends[:-1], ends[1:]], 1))
        x = np.linspace(230 * ends[:-1] - 100, 230 * ends[1:] - 100, 400)
        second = closed_forms(x, 10.0)[1][..., 0] / 2
        assert (bounds.lo[2, :, 0] <= second.min(axis=0)).all()
        assert (second.max(axis=0) <= bounds.hi[2, :, 0]).all()
        excess.append(((bounds.hi - bounds.lo)[2, :, 0] - np.ptp(second, axis=0)).max())
    assert excess[1] < 0.3 * excess[0]


def test_enclosures_near_the_axis_and_across_the_cut_hold_the_angle_on_one_turn() -> None:
    # A piece by hand: the middle of its bounding box is above the cut at 180 degrees, its own one below.
    points = np.array([[[-10.0, 3.0, 0.0], [-10.0, -2.0, 0.0], [-10.0, -0.9, 0.0]]])
    points = np.concatenate([points, np.random.default_rng(9).uniform(-1, 1, size=(20_000, 3, 3))])
    width = np.ones(len(points))
    bounds = enclosures(CYLINDER, points, width, 3)
    known = bounds.bounded[0, :, 0]
    assert known[0]
    assert known.mean() > 0.3
    lo, hi = bounds.lo[0, known, 0] - 1e-9, bounds.hi[0, known, 0] + 1e-9
    before = None
    for t in np.linspace(0, 1, 17):
        angle = derivatives(CYLINDER, points[known], width[known], np.full(known.sum(), t), 0)[0, :, 0]
        angle = angle + 360 * np.ceil((lo - angle) / 360)
        assert (angle <= hi).all()
        # The angle stays on one turn: between samples it changes by less than half a turn.
        assert before is None or np.abs(angle - before).max() < 180
        before = angle


def test_parts_are_the_pieces_they_are_cut_from() -> None:
    points, width = random_curves(CYLINDER, 10, seed=8)
    parts = np.tile([0.25, 0.5], (10, 1))
    bounds = enclosures(CYLINDER, points, width, 4, parts)
    for t in (0.25, 0.3, 0.5):
        q = derivatives(CYLINDER, points, width, np.full(10, t), 4)
        factor = np.array([1, 1, 2, 6, 24])[:, None, None]
        slack = 1e-12 * (1 + np.abs(q / factor))
        assert (bounds.lo - slack <= q / factor).all()
        assert (q / factor <= bounds.hi + slack).all()


def test_a_rational_arc_round_the_axis_turns_at_a_constant_radius() -> None:
    points = np.array([[[50.0, 0.0, 1.0], [50.0, 50.0, 1.0], [0.0, 50.0, 1.0]]])
    weights = np.array([[1.0, math.sqrt(0.5), 1.0]])
    arc = (CYLINDER, points, np.array([3.0]))
    for t in (0.0, 0.3, 1.0):
        q = derivatives(*arc, np.array([t]), 3, weights)
        assert q[:, 0, 1] == pytest.approx([50, 0, 0, 0], abs=1e-11)
    assert q[0, 0, 0] == pytest.approx(90)
    # θ = 2 atan(…): the arc is symmetric about its middle, so θ'' vanishes there.
    assert derivatives(*arc, np.array([0.5]), 2, weights)[2, 0, 0] == pytest.approx(0, abs=1e-12)
    parts = np.array([[0.4, 0.6]])
    bounds = enclosures(*arc, 6, parts, weights)
    assert bounds.lo[0, 0, 1] <= 50 <= bounds.hi[0, 0, 1]
    assert bounds.hi[0, 0, 1] - bounds.lo[0, 0, 1] < 0.01


@pytest.mark.parametrize("t", [3e-9, 1 - 3e-9])
def test_beside_a_rational_cusp_derivatives_keep_their_digits_far_from_the_origin(t: float) -> None:
    # The points are 100 mm from the origin and 1e-9 mm apart, so only differences keep the digits; the exact
    # values come from rational numbers.
    points = np.array([[101.7, 55.3, 3.1], [101.7 + 1e-9, 55.3 - 2e-9, 3.1 + 1e-9], [102.9, 56.1, 2.2]])
    if t > 0.5:
        points = points[::-1]
    weights, width = np.array([0.3, 4.7, 1.9]), 0.7
    x, y = (exact_derivatives(points[:, axis], weights, width, t) for axis in (0, 1))
    belts = CoreXY(tuple("XYZ"), tuple("ABZ"), (False,) * 3)
    found = derivatives(belts, points[None], np.array([width]), np.array([t]), 2, weights[None])[:, 0]
    for order in (1, 2):
        assert found[order, 0] == pytest.approx(float(x[order] + y[order]), rel=1e-12, abs=0)
        assert found[order, 1] == pytest.approx(float(x[order] - y[order]), rel=1e-12, abs=0)


def exact_derivatives(points: Array, weights: Array, width: float, t: float) -> list[Fraction]:
    """q, q' and q'' of one coordinate of a rational quadratic at u = t width, by the quotient rule."""
    w = [Fraction(x) for x in weights.tolist()]
    n = [Fraction(x) * y for x, y in zip(points.tolist(), w, strict=True)]
    at, long = Fraction(t), Fraction(width)

    def of(b: list[Fraction]) -> tuple[Fraction, Fraction, Fraction]:
        steps = [b[1] - b[0], b[2] - b[1]]
        value = (1 - at) ** 2 * b[0] + 2 * at * (1 - at) * b[1] + at**2 * b[2]
        return value, 2 * ((1 - at) * steps[0] + at * steps[1]) / long, 2 * (steps[1] - steps[0]) / long**2

    (n0, n1, n2), (w0, w1, w2) = of(n), of(w)
    first = (n1 - w1 * n0 / w0) / w0
    return [n0 / w0, first, (n2 - 2 * w1 * first - w2 * n0 / w0) / w0]


@pytest.mark.parametrize("nodes", [5, 9])
def test_interpolation_of_the_acceleration_keeps_its_proven_bound(nodes: int) -> None:
    count = 100
    ends = np.linspace(0, 1, count + 1)
    parts = np.stack([ends[:-1], ends[1:]], axis=1)
    line = line_past_the_axis(10.0, count)
    c = (nodes + 2) * enclosures(CYLINDER, *line, nodes + 2, parts).magnitude[-1, :, 0]
    h = 2.3
    bound = 2 * (nodes + 1) * c * (h / 4) ** nodes
    chebyshev = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
    measured = np.zeros(count)
    for i in range(count):
        middle = -100 + 230 * (ends[i] + ends[i + 1]) / 2
        values = closed_forms(middle + h / 2 * chebyshev, 10.0)[1][:, 0]
        fit = np.polynomial.chebyshev.chebfit(chebyshev, values, nodes - 1)
        t = np.linspace(-1, 1, 60)
        exact = closed_forms(middle + h / 2 * t, 10.0)[1][:, 0]
        measured[i] = np.abs(np.polynomial.chebyshev.chebval(t, fit) - exact).max()
    assert (measured <= bound + 1e-14).all()
    # The bound is useful: its greatest value is less than 60 times the greatest error.
    assert bound.max() < 60 * measured.max()


def test_through_the_axis_nothing_is_bounded_and_nothing_is_raised() -> None:
    line = line_past_the_axis(0.0, 1)
    assert not enclosures(CYLINDER, *line, 3).bounded[0, 0, 0]
    from_the_axis = np.array([[[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]]), np.array([1.0])
    assert not np.isfinite(derivatives(CYLINDER, *from_the_axis, np.array([0.0]))[1, 0, 0])


class Inverted(Kinematics):
    """A kinematics as a user would write it: two legs from fixed feet, and a height."""

    tip_names = ("X", "Y", "Z")
    joint_names = ("U", "V", "Z")

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        from feedplan.machine.numbers import sqrt

        x, y, z = tip
        return sqrt((x + 200.0) ** 2 + y * y), sqrt((x - 200.0) ** 2 + y * y), z


def test_a_user_s_machine_has_derivatives_and_bounds_without_more_code() -> None:
    kinematics = Inverted()
    points = np.array([[[0.0, 300.0, 0.0], [60.0, 300.0, 6.0]]])
    q = derivatives(kinematics, points, np.array([60.0]), np.array([0.0]), 2)
    # |P − foot| = √(200² + 300²) mm; its derivative along X is 200 mm over it.
    length = math.hypot(200, 300)
    assert q[0, 0] == pytest.approx([length, length, 0])
    assert q[1, 0] == pytest.approx([200 / length, -200 / length, 0.1])
    assert q[2, 0] == pytest.approx([300**2 / length**3, 300**2 / length**3, 0])
    bounds = enclosures(kinematics, points, np.array([60.0]), 5)
    assert bounds.lo[2, 0, 0] <= 300**2 / length**3 / 2 <= bounds.hi[2, 0, 0]

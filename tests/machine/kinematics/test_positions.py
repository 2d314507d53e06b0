"""Joint positions: by hand for each machine type, and back to the tip."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feedplan.machine.axis import Axis
from feedplan.machine.kinematics import Kinematics, create
from feedplan.machine.path_derivatives import positions
from feedplan.machine.rotary import RotaryChain, ToolVector, shortest_turn
from tests.machine.kinematics.bundled import all_kinematics, random_tips


def axes(letters: str, linear: str = "") -> tuple[Axis, ...]:
    return tuple(Axis(c, 1.0, 1.0, kind="linear" if c in linear else "") for c in letters)


def made(kind: str, letters: str, linear: str = "", **values: object) -> Kinematics:
    return create(kind, axes(letters, linear), values, "test")


def chain(kind: str, letters: str, **values: object) -> RotaryChain:
    kinematics = made(kind, letters, **values)
    assert isinstance(kinematics, RotaryChain)
    return kinematics


def test_a_cartesian_machine_maps_and_scales() -> None:
    plain = made("cartesian", "XYZ")
    assert plain.joints((1.0, 2.0, 3.0)) == (1, 2, 3)
    gantry = made("cartesian", "XYU", map={"U": "X"}, scale={"X": 2.0, "U": -2.0})
    assert gantry.tip_names == ("X", "Y")
    assert gantry.joints((1.0, 5.0)) == (2, 5, -2)
    assert gantry.tip((2.0, 5.0, -2.0)) == (1, 5)


def test_corexy_motors_turn_together_for_x_and_against_each_other_for_y() -> None:
    kinematics = made("corexy", "ABZ", linear="AB")
    assert kinematics.joints((10.0, 3.0, 7.0)) == (13, 7, 7)
    assert kinematics.rotary == (False, False, False)


def test_the_cylindrical_machine_at_three_four_five() -> None:
    kinematics = made("cylindrical", "CXZ", centre_x=1.0, centre_y=2.0)
    angle, radius, z = kinematics.joints((4.0, 6.0, 9.0))
    assert (angle, radius, z) == (pytest.approx(math.degrees(math.atan2(4, 3))), 5, 9)


def test_a_polar_table_brings_the_point_under_the_slide() -> None:
    assert made("polar", "XZC").joints((0.0, 5.0, 1.0)) == pytest.approx((5, 1, 90))
    assert made("polar", "XZC", turns="reversed").joints((0.0, 5.0, 1.0)) == pytest.approx((5, 1, -90))
    assert made("polar", "XZC", side="minus").joints((0.0, 5.0, 1.0)) == pytest.approx((-5, 1, -90))


def test_a_rotary_table_turns_the_part_against_its_count() -> None:
    table = made("rotary-table", "XYZC", tool_length=50.0)
    assert table.joints((10.0, 0.0, 1.0, 90.0)) == pytest.approx((0, -10, 51, 90))
    upright = made("rotary-table", "XYZA", table="A", pivot_a=[0.0, 0.0, 100.0])
    # 30 above the axis; A90 lays it down at y = +30: the tool has gone round to the part's −y side.
    assert upright.joints((5.0, 0.0, 130.0, 90.0)) == pytest.approx((5, 30, 100, 90))


def test_a_reversed_axis_counts_the_other_way() -> None:
    values = {"pivot_a": [0.0, 0.0, 50.0], "pivot_c": [3.0, 4.0, 0.0]}
    plain, backwards = (
        chain("trunnion-ac", "XYZAC", **values),
        chain("trunnion-ac", "XYZAC", reversed=["C"], **values),
    )
    tip = (10.0, 20.0, 30.0)
    assert backwards.joints((*tip, 30.0, -70.0))[:3] == pytest.approx(plain.joints((*tip, 30.0, 70.0))[:3])
    pointed = ToolVector(backwards)
    assert pointed.tip(pointed.joints((*tip, 0.0, 0.6, 0.8))) == pytest.approx((*tip, 0.0, 0.6, 0.8))


def test_the_ac_trunnion_tilts_the_part_about_its_pivot() -> None:
    trunnion = made("trunnion-ac", "XYZAC", pivot_a=[0.0, 0.0, 50.0], tool_length=100.0)
    assert trunnion.joints((3.0, 4.0, 5.0, 0.0, 0.0)) == pytest.approx((3, 4, 105, 0, 0))
    # C90 turns (10, 0) to (0, −10); A90 then turns (y, z − 50) = (−10, −50) to (−50, 10).
    assert trunnion.joints((10.0, 0.0, 0.0, 90.0, 90.0)) == pytest.approx((0, -50, 160, 90, 90))


def test_the_bc_trunnion_has_its_table_off_the_trunnion_s_axis() -> None:
    trunnion = made("trunnion-bc", "XYZBC", pivot_b=[0.0, 0.0, 80.0], pivot_c=[25.0, 0.0, 0.0])
    # C180 turns x = 30 to 20; B90 then turns (x, z − 80) = (20, −80) to (80, 20).
    assert trunnion.joints((30.0, 0.0, 0.0, 90.0, 180.0)) == pytest.approx((80, 0, 100, 90, 180))


def test_a_swivel_head_moves_the_slides_by_pivot_distance_and_tool() -> None:
    swivel = made("head-table", "XYZBC", pivot_b=[0.0, 0.0, 200.0], tool_length=100.0)
    assert swivel.joints((1.0, 2.0, 3.0, 0.0, 0.0)) == pytest.approx((1, 2, 103, 0, 0))
    # B90 points the spindle at +X: the tip is 300 to −X of the pivot, which is 200 above the nose.
    assert swivel.joints((0.0, 0.0, 0.0, 90.0, 0.0)) == pytest.approx((300, 0, -200, 90, 0))


def test_a_fork_head_swings_the_tip_round_its_pivot() -> None:
    fork = made("head-head", "XYZAC", pivot_a=[0.0, 0.0, 250.0], tool_length=150.0)
    assert fork.joints((1.0, 2.0, 3.0, 0.0, 77.0)) == pytest.approx((1, 2, 153, 0, 77))
    # A90 points the spindle at −Y, and C90 turns that to +X.
    assert fork.joints((0.0, 0.0, 0.0, 90.0, 90.0)) == pytest.approx((400, 0, -250, 90, 90))


@pytest.mark.parametrize(
    ("kind", "letters", "extra", "direction", "angles"),
    [
        ("trunnion-ac", "XYZAC", {}, (1, 0, 1), (45, 90)),
        ("trunnion-ac", "XYZAC", {}, (0, -2, 0), (90, 0)),
        ("trunnion-bc", "XYZBC", {}, (0, 1, 1), (45, 90)),
        ("head-table", "XYZBC", {}, (3, 0, 0), (90, 0)),
        ("head-table", "XYZBC", {"reversed": ["C"]}, (0, 1, 0), (90, -90)),
        ("head-head", "XYZAC", {}, (0, 1, 1), (45, 180)),
        ("head-head", "XYZAB", {"fork": "A", "swivel": "B"}, (0, 1, 1), (-45, 0)),
        ("head-head", "XYZBA", {"fork": "B", "swivel": "A"}, (1, 0, 1), (45, 0)),
    ],
)
def test_the_angles_for_a_direction_are_those_one_would_set_by_hand(
    kind: str, letters: str, extra: dict[str, object], direction: tuple[float, ...], angles: tuple[float, ...]
) -> None:
    five = ToolVector(chain(kind, letters, **extra))
    assert five.joints((0.0, 0.0, 0.0, *map(float, direction)))[3:] == pytest.approx(angles)


@pytest.mark.parametrize("name", all_kinematics())
def test_the_tip_comes_back_from_the_joints(name: str) -> None:
    kinematics = all_kinematics()[name]
    tips = random_tips(kinematics, 500, seed=3)
    back = np.stack(kinematics.tip(tuple(positions(kinematics, tips).T)), axis=-1)
    if isinstance(kinematics, ToolVector):
        tips[:, 3:] /= np.linalg.norm(tips[:, 3:], axis=1)[:, None]
    assert back == pytest.approx(tips, abs=1e-10)


@given(
    st.lists(st.floats(-500, 500), min_size=3, max_size=3),
    st.lists(st.floats(-180, 180), min_size=2, max_size=2),
    st.lists(st.floats(-300, 300), min_size=6, max_size=6),
    st.sampled_from(["trunnion-ac", "trunnion-bc", "head-table", "head-head"]),
    st.booleans(),
)
def test_any_pivots_and_any_counting_come_back(
    point: list[float], angles: list[float], pivots: list[float], kind: str, backwards: bool
) -> None:
    first = "B" if kind in ("trunnion-bc", "head-table") else "A"
    values = {f"pivot_{first.lower()}": pivots[:3], "pivot_c": pivots[3:], "tool_length": 80.0}
    kinematics = made(kind, f"XYZ{first}C", reversed=["C"] if backwards else [], **values)
    tip = (*point, *angles)
    assert kinematics.tip(kinematics.joints(tip)) == pytest.approx(tip, abs=1e-9)


def test_both_poses_point_the_tool_the_same_way() -> None:
    five = chain("trunnion-bc", "XYZBC")
    direction = (0.3, -0.4, 0.5)
    plus, minus = (ToolVector(five, side).joints((1.0, 2.0, 3.0, *direction)) for side in (1.0, -1.0))
    assert plus[3] == pytest.approx(-minus[3])
    assert abs(plus[4] - minus[4]) == pytest.approx(180)


def test_a_longer_tool_only_lifts_an_upright_spindle() -> None:
    short = chain("trunnion-ac", "XYZAC", tool_length=100.0)
    tip = (10.0, 20.0, 30.0, 40.0, 50.0)
    change = np.subtract(short.with_tool(130.0).joints(tip), short.joints(tip))
    assert change == pytest.approx([0, 0, 30, 0, 0])


def test_the_shortest_turn_is_half_a_turn_at_most() -> None:
    assert shortest_turn(350.0, 10.0) == 370.0
    assert shortest_turn(-725.0, 0.0) == -720.0
    assert shortest_turn(10.0, 100.0) == 100.0

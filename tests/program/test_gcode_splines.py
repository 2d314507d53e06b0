"""Splines in G-code: G5 to G5.3 as LinuxCNC documents them, G6.2 as Fanuc's manuals do."""

import random
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from feedplan.curves.composite import CompositeCurve
from feedplan.errors import FeedplanError, ProgramError
from feedplan.machine.machine import Machine
from feedplan.program.gcode import read_gcode
from feedplan.program.program import MoveKind, Program
from tests.campaign import examples
from tests.continuity import at


def read(text: str, machine: Machine | None = None) -> Program:
    return read_gcode(f"G21 F600\n{text}\nM2\n", machine)


def curves(program: Program) -> list[CompositeCurve]:
    """The splines of a program one by one, each from its start to its target."""
    whole = program.splines
    assert whole is not None
    starts = program.starts()
    found = []
    for move, first, last in zip(
        program.spline_move, program.spline_pieces, program.spline_pieces[1:], strict=False
    ):
        a, b = whole.offsets[first], whole.offsets[last]
        weights = None if whole.weights is None else whole.weights[a:b]
        offsets = whole.offsets[first : last + 1] - a
        curve = CompositeCurve(whole.control_points[a:b], weights, offsets, whole.width[first:last])
        assert program.kind[move] == MoveKind.SPLINE
        assert (curve.control_points[0] == starts[move]).all()
        assert (curve.control_points[-1] == program.target[move]).all()
        found.append(curve)
    return found


def test_a_cubic_has_its_control_points_beside_its_ends() -> None:
    program = read("G0 X1 Y2 Z5\nG5 I0 J3 P1 Q-3 X4 Y7")
    (curve,) = curves(program)
    assert curve.control_points.tolist() == [[1, 2, 5], [1, 5, 5], [5, 4, 5], [4, 7, 5]]
    assert curve.weights is None
    assert program.feed[1] == 10
    assert program.line[1] == 3


def test_a_cubic_without_i_and_j_goes_on_smoothly() -> None:
    curve = curves(read("G5 I0 J3 P1 Q-3 X4 Y7\nP0 Q1 X9 Y9"))[1]
    assert curve.control_points.tolist() == [[4, 7, 0], [3, 10, 0], [9, 10, 0], [9, 9, 0]]


def test_the_mirrored_control_point_keeps_its_size_when_units_change() -> None:
    curve = curves(read("G5 I0 J3 P1 Q-3 X4 Y7\nG20\nG5 P0 Q1 X1 Y1 F60"))[1]
    assert curve.control_points[1].tolist() == [3, 10, 0]
    assert curve.control_points[2] == pytest.approx([25.4, 50.8, 0])


def test_a_quadratic_has_its_control_point_beside_its_start() -> None:
    (curve,) = curves(read("G0 X1 Y1\nG91 G5.1 X2 Y0 I1 J2"))
    assert curve.control_points.tolist() == [[1, 1, 0], [2, 3, 0], [3, 1, 0]]
    (curve,) = curves(read("G5.1 X2 Y1 I1"))
    assert curve.control_points[1].tolist() == [1, 0, 0]


def test_splines_follow_units_and_offsets() -> None:
    program = read("G20 F10 G10 L2 P1 X1 Y1 Z1\nG0 X0 Y0 Z0\nG5 I1 J0 P-1 Q0 X2 Y2")
    (curve,) = curves(program)
    inches = [[1, 1, 1], [2, 1, 1], [2, 3, 1], [3, 3, 1]]
    assert curve.control_points == pytest.approx(25.4 * np.array(inches, dtype=float))
    assert program.feed[-1] == pytest.approx(10 * 25.4 / 60)


def test_a_nurbs_block_has_clamped_uniform_knots() -> None:
    # The example of LinuxCNC's documentation.
    program = read("G5.2 P1 L3\nX0 Y1 P1\n(note)\nX2 Y2 P1\nX2 Y0 P1\nX0 Y0 P2\nG5.3\nG1 X7")
    (curve,) = curves(program)
    assert program.line.tolist() == [2, 9]
    points = np.array([[0, 0], [0, 1], [2, 2], [2, 0], [0, 0]], dtype=float)
    weights = np.array([1, 1, 1, 1, 2.0])
    knots = np.array([0, 0, 0, 1, 2, 3, 3, 3.0])
    t = np.linspace(0, 3, 31)
    above = BSpline(knots, points * weights[:, None], 2)(t)
    expected = above / BSpline(knots, weights, 2)(t)[:, None]
    assert at(curve, t)[0][:, :2] == pytest.approx(expected, abs=1e-12)
    assert curve.width.tolist() == [1, 1, 1]


@pytest.mark.parametrize("order", [3, 4, 5, 10])
def test_the_order_of_a_nurbs_block_is_l(order: int) -> None:
    places = [(float(i), float(i * i % 7)) for i in range(1, 12)]
    block = "\n".join(f"X{x} Y{y} P1" for x, y in places)
    (curve,) = curves(read(f"G5.2 L{order} P1\n{block}\nG5.3"))
    knots = np.concatenate([np.zeros(order), np.arange(1, 13 - order), np.full(order, 13 - order)])
    t = np.linspace(0, 13 - order, 50)
    expected = BSpline(knots.astype(float), np.array([(0.0, 0.0), *places]), order - 1)(t)
    assert at(curve, t)[0][:, :2] == pytest.approx(expected, abs=1e-9)
    assert curve.weights is None


def test_the_first_block_of_a_nurbs_may_hold_its_second_point() -> None:
    (curve,) = curves(read("G5.2 X1 Y1 P2\nX2 Y0 P1\nG5.3"))
    assert curve.control_points.tolist() == [[0, 0, 0], [1, 1, 0], [2, 0, 0]]
    assert curve.weights is not None
    assert curve.weights.tolist() == [1, 2, 1]


def test_points_of_a_nurbs_block_count_from_its_start_with_g91() -> None:
    (curve,) = curves(read("G0 X5\nG91 G5.2 X1 Y1 P1\nX2 Y0 P1\nG5.3"))
    assert curve.control_points[:, 0].tolist() == [5, 6, 7]


@pytest.mark.parametrize("order", [2, 3, 4])
def test_fanuc_nurbs_agree_with_scipy(order: int) -> None:
    rng = np.random.default_rng(order)
    points = np.concatenate([np.zeros((1, 3)), rng.integers(-50, 50, (7, 3))]).astype(float)
    weights = rng.integers(1, 5, 8).astype(float)
    inner = np.sort(rng.choice(np.arange(1, 40), 8 - order, replace=False)) / 8
    knots = np.concatenate([np.zeros(order), inner, np.full(order, 5.0)])
    rows = [f"K{k} X{x} Y{y} Z{z} R{w}" for k, (x, y, z), w in zip(knots, points, weights, strict=False)]
    rest = "\n".join(f"K{k}" for k in knots[8:])
    program = read(f"G6.2 P{order} " + "\n".join(rows) + f"\n{rest}\nG0 X0")
    (curve,) = curves(program)
    t = np.linspace(0, 5, 101)
    expected = BSpline(knots, points * weights[:, None], order - 1)(t) / BSpline(knots, weights, order - 1)(
        t
    ).reshape(-1, 1)
    assert at(curve, t)[0] == pytest.approx(expected, abs=1e-10)
    assert program.line.tolist() == [2, 2 + len(knots)]


def test_fanuc_nurbs_have_rank_four_and_may_begin_where_the_tool_is() -> None:
    text = "G0 X1 Y2\nG6.2 F1200\nK0 X2\nK0 Y4\nK0 X5\nK1\nK1\nK1\nK1"
    program = read(text)
    (curve,) = curves(program)
    assert curve.control_points.tolist() == [[1, 2, 0], [2, 2, 0], [2, 4, 0], [5, 4, 0]]
    assert program.feed[-1] == 20


def test_fanuc_nurbs_move_rotary_axes_and_count_g91_from_point_to_point() -> None:
    program = read("G91 G6.2 P2 K0 A0\nK0 A10\nK1 A20\nK2\nK2")
    (curve,) = curves(program)
    assert program.axes == ("X", "Y", "Z", "A")
    assert curve.control_points[:, 3].tolist() == [0, 10, 10, 30]
    assert program.feed.tolist() == [10]
    assert read("G20 F60 G6.2 P2 K0 A0\nK0 A10\nK1\nK1").feed.tolist() == [1]
    assert read("G20 F60 G6.2 P2 K0 A0\nK0 A10 X1\nK1\nK1").feed.tolist() == [25.4]


def test_axes_that_are_named_later_stay_where_they_are_on_splines() -> None:
    program = read("G5 I1 J1 P1 Q1 X4 Y4\nG1 C5")
    (curve,) = curves(program)
    assert program.axes == ("X", "Y", "Z", "C")
    assert curve.control_points[:, 3].tolist() == [0, 0, 0, 0]


def test_a_spline_without_extent_is_no_move() -> None:
    assert len(read("G5.1 X0 Y0 I0 J0\nG1 X1")) == 1


def test_fanuc_look_ahead_switches_have_no_effect() -> None:
    program = read("G5 P10000\nG5.1 Q1\nG1 X1\nX2\nG5 P0")
    assert program.target[:, 0].tolist() == [1, 2]
    assert sum("look-ahead" in warning for warning in program.warnings) == 1


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("G5 X1", "the first G5 of a series has no I and J"),
        ("G5 I1 J1 P1 Q1 X1\nG1 X2\nG5 P1 Q1 X3", "the first G5 of a series has no I and J"),
        ("G5 I1 X1 P1 Q1", "word I1 of G5 stands without J: give both"),
        ("G5 J1 X1 P1 Q1", "word J1 of G5 stands without I: give both"),
        ("G5 I1 J1 P1 X1", "word P1 of G5 stands without Q: give both"),
        ("G5 I1 J1 X1", "G5 has no P and Q: give both"),
        ("G5 I1 J1 P1 Q1 X1 Z1", "word Z1 stands in G5, which moves X and Y only"),
        ("G5 I1 J1 P1 Q1 X1 K1", "word K1 has no meaning here"),
        ("G18 G5 I1 J1 P1 Q1 X1", "G5 works in the plane G17 only: give G17"),
        ("G93 G5 I1 J1 P1 Q1 X1 F5", "G5 does not work with inverse time (G93)"),
        ("F0\nG5 I1 J1 P1 Q1 X1", "a feed move has the feed F0"),
        ("G5 I1 J1 P1 Q1 X2000000", "X would go to 2000000 mm"),
        ("G5 I2000000 J1 P1 Q1 X2", "X would go to 2000000 mm"),
        ("G5.1 X1", "G5.1 has no control point: give I and J"),
        ("G5.1 X1 I1 J1 Q1", "word Q1 has no meaning here: G5.1 takes X, Y, I and J"),
        ("G19 G5.1 X1 I1 J1", "G5.1 works in the plane G17 only"),
        ("G53 G5 I1 J1 P1 Q1 X1", "G53 goes with straight moves only"),
        ("G5.3", "word G5.3 ends a NURBS that no G5.2 began"),
        ("G5.2 P1\nX1 P1", "a control point of G5.2 has no Y"),
        ("G5.2 P1\nX1 Y1", "a control point of G5.2 has no P"),
        ("G5.2 P1 L2", "word L2 is no order of G5.2: give an integer from 3"),
        ("G5.2 P1 L11", "word L11 is an order beyond 10"),
        ("G5.2 P1 L4\nX1 Y1 P1\nX2 Y1 P1\nG5.3", "line 3 has 3 control points and its order is 4"),
        ("G5.2 P1\nX1 Y1 P-1\nX2 Y1 P1\nG5.3", "the spline G5.2 of line 3: weight 1 is -1"),
        ("G5.2 P1\nX1 Y1 P1 Z2", "word Z2 stands inside the spline G5.2"),
        ("G5.2 P1\nX1 Y1 P1\nG1 X2", "word G1 stands inside the spline G5.2 of line 3"),
        ("G5.2 P1\nX1 Y1 P1\nF5", "word F5 stands inside the spline G5.2 of line 3"),
        ("G5.2 P1\nX1 Y1 P1\nM3", "this block stands inside the spline G5.2"),
        ("G5.2 P1\nX1 Y1 P1\nG6.2 P1", "word G6.2 stands inside the spline G5.2"),
        ("G18 G5.2 P1", "G5.2 works in the plane G17 only"),
        ("G93 G5.2 P1", "G5.2 does not work with inverse time"),
        ("G6.2 P1 K0", "word P1 is no order: give an integer from 2"),
        ("G6.2 P11 K0", "word P11 is an order beyond 10"),
        ("G6.2 P3 K0 X1", "the first control point of G6.2 has X 1 off from where the tool is"),
        ("G6.2 P3 K0 X0\nX1", "a block of the spline G6.2 of line 3 has no knot: give K"),
        ("G6.2 P3 K0 X0\nK0 X1\nK1", "line 3 has 2 control points and its order is 3"),
        ("G6.2 P2 K0 X0\nK0 X1\nK1\nK1\nX1", "word X1 has no motion code in force"),
        ("G6.2 P3 K0\nK0 X1\nK0 X2\nK1\nK1 X3", "a control point stands after the last knots"),
        ("G6.2 P2 K0 X0\nK1 X1\nK1 R2", "word R2 weighs no control point"),
        ("G6.2 P2 K0 X0\nK0 X1\nK1\nK1\nK1", "word K1 has no meaning here"),
        ("G6.2 P3 K0\nK0 X1\nK1 X2\nK1\nK1\nK1", "does not begin and end with 3 equal knots"),
        ("G6.2 P2 K3\nK3 X1\nK2 X2\nK4\nK4", "the spline G6.2 of line 3: knot 2 is 2 after 3"),
        ("G6.2 P2 K0\nK0 X1 R0\nK1\nK1", "the spline G6.2 of line 3: weight 1 is 0"),
        ("G6.2 P2 K0\nK0 X2000000", "X would go to 2000000 mm"),
    ],
)
def test_what_is_wrong_is_one_sentence(block: str, words: str) -> None:
    with pytest.raises(ProgramError) as caught:
        read_gcode(f"G21 F600\nG0 Y0\n{block}\nM2\n", name="part.ngc")
    assert words in str(caught.value)
    assert re.match(r"part\.ngc line \d+: [^\n]+$", str(caught.value))


@pytest.mark.parametrize("block", ["G5.2 P1\nX1 Y1 P1", "G6.2 P2 K0\nK0 X1"])
def test_a_program_that_ends_inside_a_spline_may_be_truncated(block: str) -> None:
    with pytest.raises(
        ProgramError, match=r"line 3: the program ends inside the spline G.* of line 2: it may"
    ):
        read_gcode(f"G21 F600\n{block}\n")


def test_the_number_of_pieces_is_bounded() -> None:
    points = "\n".join(f"X{i} Y{i % 2} P1" for i in range(1, 30))
    with pytest.raises(ProgramError, match="the splines of the program have more than 9 pieces"):
        read_gcode(f"G21 F600\nG5.2 P1\n{points}\nG5.3\n", max_moves=9)


SEED = """G21 F600 G17
G0 X1 Y1
G5 I0 J3 P0 Q-3 X2 Y2
P1 Q1 X3 Y4
G5.1 X5 Y3 I1 J1
G5.2 P1 L3
X0 Y1 P1
X2 Y2 P2
X2 Y0 P1
G5.3
G6.2 P3 K0 X2 Y0 Z0
K0 X1 Y1 Z1 R2
K0 X2 Y2 Z0
K1
K1
K1
G43.1 Z50
G43.4
G1 X1 A5
G43.5 H1
X2 I1 J1 K5
G49
G1 X5
M2
"""
WORDS = ["G5", "G5.2", "G5.3", "G6.2", "G43.4", "G43.5", "G49", "K1", "P2", "L4", "X3", "I1", "G91", "G20"]


@settings(max_examples=examples(300))
@given(st.randoms(use_true_random=False))
def test_mutated_programs_are_read_or_refused(rng: random.Random) -> None:
    lines = SEED.splitlines()
    for _ in range(rng.randrange(1, 8)):
        i = rng.randrange(len(lines))
        match rng.randrange(5):
            case 0:
                del lines[i]
            case 1:
                lines.insert(i, lines[rng.randrange(len(lines))])
            case 2:
                lines[i] += " " + rng.choice(WORDS)
            case 3:
                words = lines[i].split()
                if words:
                    del words[rng.randrange(len(words))]
                lines[i] = " ".join(words)
            case 4:
                number = rng.choice(["0", "-1", "1e9", "999999", "0.0000001", "[1/3]"])
                lines[i] = re.sub(r"(?<=[A-Z])-?[\d.]+", number, lines[i], count=1)
        if not lines:
            return
    try:
        program = read_gcode("\n".join(lines) + "\n", Machine.load("trunnion-ac"))
    except FeedplanError:
        return
    assert np.isfinite(program.target).all()
    assert np.isfinite(program.starts()).all()
    assert program.coordinate_mode is not None
    assert len(program.coordinate_mode) == len(program)
    if program.splines is not None:
        assert len(program.splines) <= 40
        curves(program)

"""Path files: curves in JSON become spline moves; errors in them give one sentence."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from feedplan.errors import FeedplanError, ProgramError
from feedplan.machine.machine import Machine
from feedplan.program.moves import NO_FEED
from feedplan.program.path_file import read_path_file
from feedplan.program.program import MoveKind, Program
from feedplan.program.read import read_program
from tests.continuity import at

LINE = {"degree": 1, "control_points": [[0, 0, 0], [10, 0, 0]]}
AFTER = {"degree": 1, "control_points": [[10, 0, 0], [10, 5, 0]], "feed": 2}


def read(table: Any, machine: Machine | None = None, **limits: Any) -> Program:
    return read_path_file(json.dumps(table).encode(), machine, "path.json", **limits)


def test_curves_become_spline_moves_of_their_own_line_and_feed() -> None:
    program = read({"unit": "mm", "feed": 80.0, "curves": [LINE, AFTER]})
    assert program.axes == ("X", "Y", "Z")
    assert program.kind.tolist() == [MoveKind.SPLINE] * 2
    assert program.start.tolist() == [0, 0, 0]
    assert program.target.tolist() == [[10, 0, 0], [10, 5, 0]]
    assert program.feed.tolist() == [80, 2]
    assert program.line.tolist() == [1, 2]
    assert program.stop.tolist() == [False, True]
    assert program.spline_move.tolist() == [0, 1]
    assert program.spline_pieces.tolist() == [0, 1, 2]
    assert program.warnings == ()


def test_knots_are_clamped_and_uniform_unless_given() -> None:
    points = [[0.0, 0.0], [1.0, 3.0], [2.0, -1.0], [5.0, 2.0], [7.0, 0.0]]
    weights = [1.0, 2.0, 1.0, 0.5, 1.0]
    knots = [0.0, 0, 0, 1, 2, 3, 3, 3]
    t = np.linspace(0, 3, 40)
    homogeneous = np.array(points) * np.array(weights)[:, None]
    expected = BSpline(knots, homogeneous, 2)(t) / BSpline(knots, np.array(weights), 2)(t)[:, None]
    for given_knots in (None, knots):
        curve = {"degree": 2, "control_points": points, "knots": given_knots, "weights": weights}
        program = read({"curves": [curve]})
        assert program.splines is not None
        assert at(program.splines, t)[0][:, :2] == pytest.approx(expected, abs=1e-12)
        assert program.target.tolist() == [[7, 0, 0]]


def test_degree_plus_one_points_are_a_bezier_curve() -> None:
    program = read(
        {"curves": [{"degree": 3, "control_points": [[0, 0, 0], [1, 2, 3], [4, 5, 6], [7, 8, 9]]}]}
    )
    assert program.splines is not None
    assert program.splines.control_points.tolist() == [[0, 0, 0], [1, 2, 3], [4, 5, 6], [7, 8, 9]]


def test_inches_are_of_linear_axes_and_feeds() -> None:
    curve = {"degree": 1, "control_points": [[0, 90], [1, 45]]}
    program = read({"unit": "inch", "feed": 2, "axes": ["C", "X"], "curves": [curve]})
    assert program.axes == ("X", "Y", "Z", "C")
    assert program.start.tolist() == [90 * 25.4, 0, 0, 0]
    assert program.target.tolist() == [[45 * 25.4, 0, 0, 1]]
    assert program.feed.tolist() == [50.8]


def test_columns_are_x_to_c_by_default() -> None:
    curve = {"degree": 1, "control_points": [[0] * 6, [1, 2, 3, 4, 5, 6]]}
    assert read({"curves": [curve]}).axes == ("X", "Y", "Z", "A", "B", "C")


def test_curves_that_do_not_join_are_refused_or_joined_by_rapids() -> None:
    apart = {"degree": 1, "control_points": [[11, 0, 0], [12, 0, 0]]}
    with pytest.raises(ProgramError, match=r"curves\[1\] starts 1 mm from the end of the curve before: join"):
        read({"curves": [LINE, apart]})
    program = read({"curves": [LINE, apart], "rapid": True, "feed": 1})
    assert program.kind.tolist() == [MoveKind.SPLINE, MoveKind.RAPID, MoveKind.SPLINE]
    assert program.target[:, 0].tolist() == [10, 11, 12]
    assert program.feed.tolist() == [1, np.inf, 1]
    assert program.line.tolist() == [1, 2, 2]


def test_rounded_ends_are_one_point() -> None:
    near = {"degree": 1, "control_points": [[10.0001, 0, 0], [12, 0, 0]]}
    program = read({"curves": [LINE, near]})
    assert program.kind.tolist() == [MoveKind.SPLINE] * 2
    assert program.splines is not None
    assert program.splines.control_points[2].tolist() == [10, 0, 0]


def test_curves_without_a_feed_are_warned_about() -> None:
    program = read({"curves": [LINE, AFTER]})
    assert program.feed.tolist() == [NO_FEED, 2]
    assert program.warnings == ("1 of 2 curves have no feed: only the machine limits them; give feed",)


def test_a_given_feed_is_that_of_curves_without_one() -> None:
    content = json.dumps({"curves": [LINE, AFTER]}).encode()
    program = read_program(content, name="path.json", feed=7.0)
    assert (program.feed.tolist(), program.warnings) == ([7, 2], ())


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ([], 'it holds no table: give {"unit": "mm", "curves": […]}'),
        ({}, "curves is missing: give a list of curves"),
        ({"curves": []}, "curves is []: give a list of curves"),
        ({"curves": 5}, "curves is 5: give a list of curves"),
        ({"curves": [5]}, "curves[0].control_points[0] is null: give 2 to 6 numbers"),
        ({"curves": [LINE, 5]}, "curves[1] is 5: give a table"),
        ({"curves": [LINE], "unit": "km"}, 'unit is "km": give "mm" or "inch"'),
        ({"curves": [LINE], "unit": ["mm"]}, 'unit is ["mm"]: give "mm" or "inch"'),
        ({"curves": [LINE], "rapid": 1}, "rapid is 1: give true or false"),
        ({"curves": [LINE], "feed": 0}, "feed is 0: give a positive feed per second"),
        ({"curves": [LINE], "feed": "8"}, 'feed is "8": give a positive feed'),
        ({"curves": [LINE], "feed": True}, "feed is true: give a positive feed"),
        ({"curves": [LINE], "speed": 8}, '"speed" is not understood: use axes, curves, feed, rapid, unit'),
        ({"curves": [LINE | {"knot": []}]}, 'curves[0]."knot" is not understood: use control_points'),
        ({"curves": [LINE | {"feed": -1}]}, "curves[0].feed is -1"),
        (
            {"curves": [LINE], "axes": ["X", "X", "Y"]},
            'axes is ["X", "X", "Y"]: give up to 9',
        ),
        (
            {"curves": [LINE], "axes": ["X", "1", "Y"]},
            "up to 9 different names of axes, such as X or j1",
        ),
        ({"curves": [LINE], "axes": [[], "Q", "Y"]}, "give up to 9 different names"),
        (
            {"curves": [LINE], "axes": ["j1", "j2", "j3"], "unit": "mm"},
            'unit is "mm": give none: these axes',
        ),
        ({"curves": [LINE], "axes": ["X", "Y"]}, "curves[0].control_points[0] is [0, 0, 0]: give 2 finite"),
        ({"curves": [{"control_points": [[0, 0], [1, 0]]}]}, "curves[0].degree is missing: give an integer"),
        ({"curves": [LINE | {"degree": 10}]}, "curves[0].degree is 10: give an integer from 1 to 9"),
        ({"curves": [LINE | {"degree": 1.5}]}, "curves[0].degree is 1.5"),
        ({"curves": [LINE | {"degree": True}]}, "curves[0].degree is true"),
        ({"curves": [LINE | {"degree": 2}]}, "curves[0].control_points is 2 points: give more than 2"),
        ({"curves": [{"degree": 1, "control_points": [[0, 0], [1]]}]}, "control_points[1] is [1]: give 2"),
        ({"curves": [{"degree": 1, "control_points": [[0, 0], [1, "2"]]}]}, 'control_points[1] is [1, "2"]'),
        ({"curves": [{"degree": 1, "control_points": [[0, 0], [1, 2e6]]}]}, "control_points[1] is farther"),
        ({"curves": [LINE | {"knots": [0, 1]}]}, "curves[0].knots is 2 numbers: give 4"),
        ({"curves": [LINE | {"knots": [0, 0, None, 1]}]}, "curves[0].knots[2] is null: give a finite number"),
        ({"curves": [LINE | {"knots": [0, 2, 1, 3]}]}, "curves[0]: knot 2 is 1 after 2"),
        ({"curves": [LINE | {"weights": [1]}]}, "curves[0].weights is 1 numbers: give 2"),
        ({"curves": [LINE | {"weights": [1, -1]}]}, "curves[0]: weight 1 is -1"),
        ({"curves": [{"degree": 1, "control_points": [[1, 1], [1, 1]]}]}, "curves move nothing"),
    ],
)
def test_what_is_wrong_names_its_place(table: Any, words: str) -> None:
    with pytest.raises(ProgramError) as caught:
        read(table)
    assert words in str(caught.value)
    assert str(caught.value).startswith("path.json: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "it is not valid JSON"),
        (b"\xff\xfe\x00", "it is no text"),
        (b"[" * 100_000, "nested too deep"),
        (b'{"curves": [], "unit": "mm", "curves": []}', "'curves' is given twice in one table: give it once"),
        (
            b'{"curves": [{"degree": 1, "control_points": [[0, 0], [NaN, 1]]}]}',
            "the number NaN is not finite",
        ),
        (b'{"curves": [{"degree": 1, "control_points": [[0, 0], [1e999, 1]]}]}', "give 2 finite numbers"),
        (
            b'{"curves": [{"degree": 1, "control_points": [[0, 0], [%s, 1]]}]}' % (b"9" * 400),
            "2 finite numbers",
        ),
    ],
)
def test_what_is_no_json_is_one_sentence(content: bytes, words: str) -> None:
    with pytest.raises(ProgramError) as caught:
        read_path_file(content)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_machine_has_the_axes() -> None:
    curve = {"degree": 1, "control_points": [[0, 0, 0, 0], [1, 1, 1, 1]]}
    with pytest.raises(
        ProgramError, match="axes has A and the machine does not: use X, Y, Z, or another machine"
    ):
        read({"curves": [curve]}, Machine.load("mill"))
    assert read({"curves": [curve]}, Machine.load("rotary-table")).axes[-1] == "A"


def test_the_number_of_points_is_bounded() -> None:
    with pytest.raises(ProgramError, match="there are more than 3 control points: split the file"):
        read({"curves": [LINE, AFTER]}, max_points=3)


def test_the_suffix_chooses_the_reader(tmp_path: Path) -> None:
    file = tmp_path / "part.JSON"
    file.write_text(json.dumps({"curves": [LINE]}), encoding="utf-8")
    assert read_program(file).kind.tolist() == [MoveKind.SPLINE]
    file.write_text("G21 G0 X1\n", encoding="utf-8")
    with pytest.raises(ProgramError, match=r"^part\.JSON: it is not valid JSON"):
        read_program(file)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 5) | st.floats() | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["curves", "degree", "control_points", "knots"]), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(JSON, JSON, JSON)
def test_any_json_is_read_or_refused(points: Any, knots: Any, curves: Any) -> None:
    curve = {"degree": 1, "control_points": points, "knots": knots}
    for table in ({"curves": curves}, {"curves": [curve]}, {"curves": [LINE, curve]}, curves):
        try:
            program = read(table)
        except FeedplanError:
            continue
        assert np.isfinite(program.target).all()

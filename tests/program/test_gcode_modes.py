"""Path control, stops, dwells, block delete and the end of a program."""

import math

import pytest

from feedplan.program.gcode import read_gcode
from feedplan.program.program import PathControl, Program


def read(text: str, **options: bool) -> Program:
    return read_gcode(f"G21\n{text}\n".encode(), **options)


def test_path_control_is_kept_with_each_move() -> None:
    program = read("G0 X1\nG61\nX2\nG61.1 X3\nG64 P0.1 Q0.05 X4\nG20 G64 P0.01 X0\nG64 X1\nM2")
    control = [
        PathControl.TOLERANCE,
        PathControl.EXACT_PATH,
        PathControl.EXACT_STOP,
        *3 * [PathControl.TOLERANCE],
    ]
    assert program.control.tolist() == control
    assert program.blend_tolerance.tolist() == pytest.approx(
        [math.nan, math.nan, math.nan, 0.1, 0.254, math.nan], nan_ok=True
    )
    assert program.fit_tolerance.tolist() == pytest.approx(
        [math.nan, math.nan, math.nan, 0.05, math.nan, math.nan], nan_ok=True
    )


@pytest.mark.parametrize(
    "word", ["M0", "M1", "M60", "M3", "M4", "M5", "M6", "M7", "M8", "M9", "M19", "M100", "M199", "G4 P0"]
)
def test_these_words_stop_the_tool(word: str) -> None:
    assert read(f"G0 X1\n{word}\nX2\nM2").stop.tolist() == [True, True]


@pytest.mark.parametrize(
    "word", ["S100", "T3", "D1", "F100", "M48", "M49", "G40", "G54", "G97", "N10", "G8 G69", "(M0)"]
)
def test_these_words_do_not_stop_the_tool(word: str) -> None:
    assert read(f"G0 X1\n{word}\nX2\nM2").stop.tolist() == [False, True]


def test_switches_come_before_the_motion_of_their_block_and_stops_after() -> None:
    program = read("G0 X1\nX2 M3\nX3 M0\nX4\nX5\nM2")
    assert program.stop.tolist() == [True, False, True, False, True]


def test_dwells_are_seconds_after_the_move_before() -> None:
    program = read("G0 X1\nG4 P0.5\nG4 X0.25\nX2\nX3 G4 P2\nM2")
    assert program.dwell.tolist() == [0.75, 2, 0]
    assert program.stop.tolist() == [True, True, True]


def test_a_long_dwell_is_remarked() -> None:
    program = read("G0 X1\nG4 P500\nM2")
    assert program.dwell.tolist() == [500]
    assert program.warnings == (
        "line 3: a dwell takes 500 s: dwells are read in seconds, not in milliseconds",
    )


def test_user_codes_are_remarked_once_each() -> None:
    program = read("G0 X1\nM101\nM102 P1 Q2\nM101\nM19 R90\nX2\nM2")
    assert [text.split(" is ")[0] for text in program.warnings] == [
        "line 3: what M101 does",
        "line 4: what M102 does",
        "line 6: what M19 does",
    ]


def test_deleted_blocks_are_left_out_and_counted() -> None:
    text = "G0 X1\n/ X2\nN5 /X3 *** not read\nX4\nM2"
    program = read(text)
    assert program.target[:, 0].tolist() == [1, 4]
    assert program.warnings == ("2 blocks that start with / are left out (block delete)",)
    assert read("G0 X1\n/ X2\nM2").warnings == ("1 block that starts with / is left out (block delete)",)


def test_deleted_blocks_are_run_on_request() -> None:
    program = read("G0 X1\n/ X2\n/2 X3\nN5 / X4\nM2", block_delete=False)
    assert program.target[:, 0].tolist() == [1, 2, 3, 4]
    assert program.warnings == ()


@pytest.mark.parametrize("end", ["M2", "M30", "m02", "%", "X2 M30"])
def test_nothing_is_read_after_the_end(end: str) -> None:
    program = read(f"G0 X1\n{end}\nG999 what ever")
    assert program.target[:, 0].tolist() == ([1, 2] if "X2" in end else [1])
    word = "%" if end == "%" else "M2 or M30"
    assert program.warnings == (f"line 3: {word} ends the program: what follows is not read",)


@pytest.mark.parametrize("rest", ["", "\n", "\n%\n", "\r\n \t\r\n%", "\n(the end)\n; yes\n\x1a"])
def test_blanks_comments_and_percents_may_follow_the_end(rest: str) -> None:
    assert read_gcode(f"G21\nG0 X1\nM30{rest}".encode()).warnings == ()


def test_a_program_without_an_end_is_remarked() -> None:
    cut = "the program does not end with M2, M30 or %"
    assert read_gcode(b"G21 G0 X1\n").warnings == (f"{cut}: it may be truncated",)
    assert read_gcode(b"G21 G0 X1\nX2").warnings == (
        f"{cut}, and its last line has no line end: it may be truncated",
    )


def test_units_that_are_not_given_are_remarked() -> None:
    program = read_gcode(b"G0 X1\nM2")
    assert program.warnings == ("the program gives no units (G20 or G21): millimetres are assumed",)
    assert program.target[0, 0] == 1

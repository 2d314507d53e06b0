"""How words, numbers, comments, line ends and arithmetic may be written."""

import math

import pytest

from feedplan.program.gcode import read_gcode
from feedplan.program.program import Program


def read(text: str | bytes) -> Program:
    return read_gcode(text.encode() if isinstance(text, str) else text)


def x_of(text: str | bytes) -> list[float]:
    return [float(x) for x in read(text).target[:, 0]]


@pytest.mark.parametrize(
    "text",
    [
        "G21 G1 X1 Y2 F60\nM2\n",
        "g21g1x1y2f60\nm2\n",
        "G21G01X1.Y+2.0F60.\nM02\n",
        "N10 G21 G1 X1 Y2 F60\nN20 M2\n",
        "n10.5g21g1x1y2f60\nM2",
        "%\nO0001 (PART)\nG21 G1 X1 Y2 F60\nM30\n%\n",
        "% \r\n:0097\r\n( a comment ) \r\nG21 G1 X1 Y2 F60\r\nM30\r\n%",
        "O0001(TEST)\nN1 G21 G1 X1 Y2 F60\nM2\n",
        "\tG 21\tG 1  X  1.000  Y -  -2 F 60\nM2\n".replace("-  -2", "+ 2"),
        "G21 (mm) G1 (go; not; yet) X1 Y2 F60 ; to ( here\nM2\n",
        "(MSG, hello)\n;\n\n(a)(b) G21 G1 X1 Y2 F60\nM2\n",
        "G21\rG1 X1\tY2 F60\rM2\r",
        "G21\r\rG1 X1 Y2 F60\r\nM2\n",
        "X1 F60 Y2 G1 G21\nM2\n",
        "\ufeffG21 G1 X1 Y2 F60\nM2\n",
        "G[2*10+1] G#1=5 1 X[2-1] Y[SQRT[4]] F[30 * 2]\nM2\n".replace("#1=5 ", ""),
        "G21\n#<feed>=60 #1=1\n#2=[#1+1]\nG#1 X#1 Y##1 F#<feed>\nM2\n".replace("##1", "#2"),
    ],
)
def test_each_way_to_write_the_same_move(text: str) -> None:
    program = read(text)
    assert program.target.tolist() == [[1, 2, 0]]
    assert program.feed.tolist() == [1]
    assert program.warnings == ()


def test_line_numbers_count_every_kind_of_line_end() -> None:
    assert read("G21\n\nG0 X1\r\n(x)\r\nX2\rX3\r\rX4").line.tolist() == [3, 5, 6, 8]


@pytest.mark.parametrize("comment", ["Maß ± °", "Ø 12 µm", "\u2300"])
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_comments_may_hold_any_letters(comment: str, encoding: str) -> None:
    data = f"G21 ({comment})\nG0 X1 ; {comment}\nM2\n".encode(encoding, "replace")
    assert x_of(data) == [1]


@pytest.mark.parametrize(
    ("number", "value"),
    [
        (".5", 0.5),
        ("5.", 5),
        ("+1", 1),
        ("-0.25", -0.25),
        ("007.50", 7.5),
        ("0.1", 0.1),
        ("123456.789012345678901234567890", 123456.789012345678901234567890),
        ("-[3]", -3),
        ("ATAN[1]/[1]", math.degrees(math.atan2(1, 1))),
        ("abs[-2.5]", 2.5),
        ("[1 + ACOS[0] - [2 ** [4.0/2]]]", 1 + math.degrees(math.acos(0)) - 4),
    ],
)
def test_numbers_are_the_nearest_doubles(number: str, value: float) -> None:
    assert x_of(f"G21 G0 X{number}\nM2") == [value]


def test_assignments_count_from_the_next_block_on() -> None:
    assert x_of("G21\n#3=15\n#3=6 G0 X#3\nX#3\nM2") == [15, 6]


def test_a_name_is_the_same_in_any_case_and_with_blanks() -> None:
    assert x_of("G21\n#<Tool Radius> = 3\nG0 X#<toolradius>\nM2") == [3]


def test_a_str_with_a_line_break_is_the_program() -> None:
    assert read_gcode("G21 G0 X1\nM2").target[0, 0] == 1

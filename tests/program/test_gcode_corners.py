"""Chamfers and roundings between straight moves, `,C` and `,R`."""

import math

import pytest

from feedplan.errors import ProgramError
from feedplan.program.gcode import read_gcode
from feedplan.program.program import MoveKind


def test_a_chamfer_cuts_both_moves() -> None:
    program = read_gcode("G21 F600\nG1 X10 ,C2\nY10\nX20 Y20\nM2\n")
    assert program.target[:, :2].tolist() == [[8, 0], [10, 2], [10, 10], [20, 20]]
    assert program.line.tolist() == [2, 2, 3, 4]
    assert set(program.feed.tolist()) == {10.0}


@pytest.mark.parametrize("angle", [30.0, 90.0, 150.0, -60.0])
@pytest.mark.parametrize("plane", ["G17", "G18", "G19"])
def test_a_rounding_touches_both_moves(angle: float, plane: str) -> None:
    u, v = {"G17": "XY", "G18": "ZX", "G19": "YZ"}[plane]
    x, y = 10 + 10 * math.cos(math.radians(angle)), 10 * math.sin(math.radians(angle))
    program = read_gcode(f"{plane} G21 F600\nG1 {u}10 ,R1.5\n{u}{x:.9f} {v}{y:.9f}\nM2\n")
    assert program.kind.tolist() == [MoveKind.LINE, MoveKind.ARC, MoveKind.LINE]
    columns = ["XYZ".index(u), "XYZ".index(v)]
    cut = 1.5 * math.tan(math.radians(abs(angle)) / 2)
    first, second = program.target[0, columns], program.target[1, columns]
    assert first == pytest.approx([10 - cut, 0], abs=1e-9)
    centre = program.arc_centre[0, columns]
    assert centre == pytest.approx([10 - cut, math.copysign(1.5, angle)], abs=1e-9)
    assert math.dist(second, centre) == pytest.approx(1.5, abs=1e-8)
    assert math.degrees(program.arc_angle[0]) == pytest.approx(angle, abs=1e-6)


def test_one_corner_may_follow_another() -> None:
    program = read_gcode("G21 F600\nG1 X10 ,R2\nY10 ,C1\nX0 ,R[1+1]\nY0\nM2\n")
    assert program.target[:, :2].round(9).tolist() == [
        [8, 0],
        [10, 2],
        [10, 9],
        [9, 10],
        [2, 10],
        [0, 8],
        [0, 0],
    ]


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("G1 X10 ,C6\nY5", "the corner ,C takes 6.0000 mm of moves that are 10.0000 and 5.0000 mm long"),
        ("G1 X10 ,R2\nX20", "line 2: the moves at this corner lie on one line"),
        ("G1 X10 ,R2\nG0 Y5", "line 2: the corner ,R of this line is followed by no straight move G1"),
        ("G1 X10 ,R2\nG2 X12 Y2 R2", "followed by no straight move"),
        ("G1 X10 ,R2\nZ5", "followed by no straight move"),
        ("G1 X10 ,R2", "followed by no straight move"),
        ("G1 X10 ,R-2\nY5", "word ,R-2 is no size of a corner"),
        ("G1 X0 ,R2\nY5", "word ,R2 stands behind no move"),
        ("G0 X10 ,R2\nG1 Y5", "stands behind no straight move"),
        ("G1 X10 ,R2 ,C1\nY5", "',C1' is not understood: numbers have a decimal point, and a block has one"),
        ("G41.1 D1\nG1 X10 ,R2\nY5", ",R stands where G41.1 is on"),
    ],
)
def test_a_corner_that_cannot_be_cut_says_why(block: str, words: str) -> None:
    with pytest.raises(ProgramError) as caught:
        read_gcode(f"G21 F600\n{block}\nM2\n")
    assert words in str(caught.value)

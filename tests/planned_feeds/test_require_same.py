"""The written program is read back: another move, stop, event or feed is an error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import feedplan
from feedplan.errors import ProgramError
from feedplan.planned_feeds.read_back import require_same

PROGRAM = """G21 G64 P0.01
M3 S1000
G1 X10 F600
Y10
G2 X20 I5 J0
(MSG, half)
G4 P0.5
G5 X30 Y10 I2 J2 P-2 Q2
G0 Z5
M2
"""


def test_the_program_itself_is_the_same() -> None:
    program = feedplan.read_program(PROGRAM.encode(), "mill")
    require_same(PROGRAM.encode(), program, {}, program.feed)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("X10", "X10.0000001", "its places differ"),
        ("Y10\n", "Y5\nY10\n", "it has 6 moves in place of 5"),
        ("G0 Z5", "G1 Z5", "its kinds of moves differ"),
        ("I5 J0", "I5.0001 J0", "its centres differ"),
        ("G2 X20", "G3 X20", "its turns of arcs differ"),
        ("I2 J2", "I2 J2.5", "its control points differ"),
        ("G64 P0.01", "G61", "its ways of following the path differ"),
        ("P0.5", "P0.6", "its dwells differ"),
        ("S1000", "S1001", "its events differ"),
        ("half", "full", "its messages differ"),
        ("F600", "F601", "line 3 has the feed 10.0167 in place of 10 mm/s"),
        ("F600", "F599", "line 3 has the feed 9.98333 in place of 10 mm/s"),
        ("F600", "F0", "it is refused"),
        ("G0 Z5", "G0 Z5 A0\nA5\nA0", "in place of 5|other axes|it is refused"),
    ],
)
def test_what_differs_is_told(before: str, after: str, words: str) -> None:
    program = feedplan.read_program(PROGRAM.encode(), "mill")
    text = PROGRAM.replace(before, after)
    assert text != PROGRAM
    with pytest.raises(ProgramError, match=f"would not be the same: .*({words})"):
        require_same(text.encode(), program, {}, program.feed)


def test_a_program_is_read_back_as_it_was_read(tmp_path: Path) -> None:
    table = tmp_path / "tools.tbl"
    table.write_text("T1 P1 Z50 D6\n")
    (tmp_path / "drill.ngc").write_text("o<drill> sub\nG1 Z-5 F300\nZ5\no<drill> endsub\nM2\n")
    part = tmp_path / "part.ngc"
    part.write_text("G21 G61.1\nT1 M6\nG43 H1\nG1 X5000 F60000\no<drill> call\nG1 X0\nM2\n")
    options = {"tool_table": table, "whole_step": 0.001}
    program = feedplan.read_program(part, "mill", **options)  # type: ignore[arg-type]
    assert program.reading is not None
    again = feedplan.read_program(part.read_bytes(), **program.reading)
    assert np.array_equal(again.target, program.target)
    result = feedplan.planned_program(feedplan.plan(program, "mill"))
    assert b"X5000 F7348.4\nF60000\no<drill> call\nG1 X0\n" in result.content

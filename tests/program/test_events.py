"""Events between moves keep their place, their line and their order."""

import numpy as np

from feedplan.program.gcode import read_gcode


def test_events_keep_their_place_and_order() -> None:
    text = (
        "G21 F600 T3\nM6\nS8000 M3\nM8 G0 X1 (MSG, begin)\nG1 X2 M62 P1\nM67 E0 Q[1/2]\nG4 P0.5\nX3\n"
        "( debug , mid #1)\nM428\n(no message)\nM0\nX4 S9000\nM117 done\nM5 M9\nM30\n"
    )
    program = read_gcode(text)
    events = program.events
    placed = list(zip(events.move.tolist(), events.line.tolist(), events.words(), strict=True))
    assert placed == [
        (0, 1, "T3"),
        (0, 2, "M6 P3"),
        (0, 3, "S8000"),
        (0, 3, "M3"),
        (0, 4, "(begin)"),
        (0, 4, "M8"),
        (1, 5, "M62 P1"),
        (2, 6, "M67 E0 Q0.5"),
        (2, 7, "G4 P0.5"),
        (3, 9, "(mid #1)"),
        (3, 10, "M428"),
        (3, 11, "(no message)"),
        (3, 12, "M0"),
        (3, 13, "S9000"),
        (4, 14, "(done)"),
        (4, 14, "M117"),
        (4, 15, "M5"),
        (4, 15, "M9"),
        (4, 16, "M30"),
    ]


def test_events_of_loops_come_each_time() -> None:
    program = read_gcode("G21 G91\no1 repeat [3]\nG0 X1\nM64 P2\no1 endrepeat\nM2\n")
    assert program.events.move.tolist() == [1, 2, 3, 3]
    assert program.events.words() == ("M64 P2",) * 3 + ("M2",)


def test_a_program_without_events_has_none() -> None:
    program = read_gcode("G21 G0 X1\n")
    assert len(program.events) == 0
    assert program.events.number.dtype == np.float64


def test_comments_of_loops_come_each_time_and_their_texts_do_not_grow() -> None:
    program = read_gcode("G21 G91 ; start\no1 repeat [1000]\n(again)\nG0 X1 ; at #1 \no1 endrepeat\nM2 ()\n")
    assert program.events.words() == ("(start)", *["(again)", "(at #1)"] * 1000, "M2")
    assert program.events.move.tolist()[:5] == [0, 0, 0, 1, 1]
    assert len(program.events.texts) <= 5

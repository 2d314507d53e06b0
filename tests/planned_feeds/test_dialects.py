"""What a control lacks is reported with its line; new blocks use the words of the control."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import feedplan
from feedplan.errors import InputError
from feedplan.planned_feeds.dialects import lacks
from tests.planned_feeds.programs import SQUARE, planned

NURBS = "G21 G17\nG1 X1 F600\nG5.2 X3 Y4 P1 L3\nX8 Y5 P2\nX12 Y1 P1\nX15 Y3 P0.7\nG5.3\nG1 X20\nM2\n"


def test_each_control_lacks_something() -> None:
    program = b"G21\n(G5 in a comment)\no1 sub\nG5 X1 Y1 I1 J1 P1 Q1\nG6.2 P4 K0 X1\nG64 P0.1\nG2 X1 I1 P3\n"
    assert lacks("linuxcnc", program) == (
        "line 5: LinuxCNC lacks NURBS by G6.2, before its version 2.9 (G6.2, 1 in all)",
    )
    grbl = lacks("grbl", program)
    assert "line 4: grbl lacks splines by G5, G5.1 and G5.2 (G5, 1 in all)" in grbl
    assert "line 3: grbl lacks O words of subroutines, loops and branches (o1 s, 1 in all)" in grbl
    assert any("turns of an arc by P" in sentence for sentence in lacks("fanuc", program))
    assert any("without a decimal point" in sentence for sentence in lacks("fanuc", program))


def test_long_lines_are_told() -> None:
    line = b"G1 " + b" ".join(b"X%d.123456789012" % k for k in range(5))
    assert lacks("grbl", line) == ("line 1: grbl takes 70 characters a line (1 are longer)",)
    assert lacks("grbl", b"G1 X1" + b" " * 90 + b"(a long note)") == ()


def test_a_program_of_lines_lacks_nothing() -> None:
    for dialect in ("linuxcnc", "grbl"):
        assert feedplan.planned_program(planned(SQUARE), dialect=dialect).notes == ()  # type: ignore[arg-type]


def test_fanuc_gets_decimal_points() -> None:
    plan = planned("G21 G61.1\nG1 X5. F60000.\nX300.\nM2\n")
    assert b"F7348.4" in feedplan.planned_program(plan, dialect="fanuc").content
    plan = planned("G21 G61.1\nG1 X30. F60000.\nX300.\nM2\n")
    assert b"G1 X30. F18000.\n" in feedplan.planned_program(plan, dialect="fanuc").content


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_splines_are_written_as_nurbs(dialect: str) -> None:
    plan = planned(NURBS)
    result = feedplan.planned_program(plan, expand=True, dialect=dialect)  # type: ignore[arg-type]
    code = b"G5.2" if dialect == "linuxcnc" else b"G6.2"
    assert result.content.count(code) == 3
    program, own = feedplan.read_program(result.content, "mill"), plan.program
    assert own is not None
    assert own.splines is not None
    assert program.splines is not None
    assert program.splines.control_points == pytest.approx(own.splines.control_points, abs=1e-11)
    assert program.splines.weights is not None
    assert own.splines.weights is not None
    # Only the ratios of the weights of a piece matter.
    for first, last in zip(own.splines.offsets[:-1], own.splines.offsets[1:], strict=True):
        ratio = program.splines.weights[first:last] / own.splines.weights[first:last]
        assert np.ptp(ratio) < 1e-9


@pytest.mark.parametrize(("dialect", "word"), [("linuxcnc", "P"), ("grbl", "P"), ("fanuc", "X")])
def test_a_dwell_written_anew_is_in_seconds(dialect: str, word: str) -> None:
    plan = planned("G21\nG1 X5 F600\nG4 P0.123456789\nG1 X9\nM2\n")
    result = feedplan.planned_program(plan, expand=True, dialect=dialect)  # type: ignore[arg-type]
    assert f"G4 {word}0.123456789\n" in result.content.decode()
    assert feedplan.read_program(result.content, "mill").dwell.max() == 0.123456789


def test_fanuc_takes_a_dwell_by_p_in_milliseconds() -> None:
    told = lacks("fanuc", b"G4 X0.5\nG04 P0.5\nG82 X1. Z1. R1. P2.\nG40 P1\n")
    sentence = "seconds of a dwell by P, which it takes as milliseconds (G04 P0, 2 in all)"
    assert told == (f"line 2: Fanuc lacks {sentence}",)


def test_what_the_coordinates_of_a_program_written_anew_have_is_told() -> None:
    plan = planned("G21 (G43)\nG54 G1 X5 F600\nG43 H1 Z5\nG55 X9\nM2\n")
    lengths, offsets = feedplan.planned_program(plan, expand=True).notes
    assert lengths == (
        "line 3: G43 is left out: the coordinates have the tool lengths that are known, 0 for others (a tool "
        "table gives them)"
    )
    assert offsets.startswith("line 4: G55 is left out: the coordinates have the work offsets that are known")
    assert feedplan.planned_program(plan).notes == ()


def test_a_program_written_anew_for_grbl_has_no_words_of_path_control() -> None:
    plan = planned("G21 G64 P0.01\nG0 Z5\nG1 X5 F600\nG81 X9 Z-5 R2\nG80\nM2\n")
    made = feedplan.planned_program(plan, expand=True, dialect="grbl")
    assert b"G61" not in made.content
    assert b"G64" not in made.content
    assert made.notes == ("line 1: G64 is left out: grbl takes all corners by its junction deviation, $11",)
    others = feedplan.planned_program(plan, expand=True)
    assert b"G64 P0.01\n" in others.content
    assert b"G61\n" in others.content


def test_taps_written_anew_turn_the_spindle_back_and_tell_that_they_do_not_follow_it() -> None:
    tap = "G21\nG0 Z5\nS500 M3\nG98 G84 X1 Z-5 R2 F625\nG80\nM5\nM2\n"
    made = feedplan.planned_program(planned(tap), expand=True)
    assert b"G1 Z-5. F625.\nG4 P0.\nM4\nZ5.\nM3\nM5\nM2\n" in made.content
    assert made.notes == (
        "line 4: G84 is written as plain moves at its feed, which do not follow the spindle: a tap needs a "
        "holder that gives way, and no thread can be cut so",
    )
    thread = feedplan.planned_program(planned("G21\nS500 M3\nG33 Z-5 K1\nM2\n"), expand=True)
    assert thread.notes[0].startswith("line 3: G33 is written as plain moves at its feed")


def test_a_path_file_is_written_as_gcode(tmp_path: Path) -> None:
    file, out = tmp_path / "curve.json", tmp_path / "curve.ngc"
    curves = '[{"degree": 2, "control_points": [[0, 0], [10, 0], [10, 10]], "weights": [1, 0.7, 1]}]'
    file.write_text(f'{{"feed": 80, "curves": {curves}}}')
    made = feedplan.plan(file, "mill")
    feedplan.write_program(made, out, expand=True)
    assert feedplan.plan(out, "mill").time == pytest.approx(made.time, rel=1e-6)
    file.write_text(file.read_text().replace("[0, 0]", "[0, 5]"))
    with pytest.raises(
        InputError, match=r"curve\.json begins at X0 Y5 Z0, and G-code where the tool is: let"
    ):
        feedplan.planned_program(feedplan.plan(file, "mill"), expand=True)


def test_grbl_has_no_splines() -> None:
    with pytest.raises(InputError, match="line 3: grbl has no splines: take another dialect"):
        feedplan.planned_program(planned(NURBS), expand=True, dialect="grbl")


def test_loops_calls_and_cycles_become_plain_blocks() -> None:
    text = (
        "G21 (plate)\nT1\nM3 S1000\no1 sub\nG1 X5 F3000\nX0 F60000\no1 endsub\nG0 Z5\no1 call\n"
        "G4 P0.5\no1 call\n(MSG, now)\nG99 G81 X9 Y9 Z-5 R1 F300\nG80 M5\nM2\n"
    )
    plan = planned(text)
    result = feedplan.planned_program(plan, expand=True)
    lines = result.content.decode().splitlines()
    assert not any("o1" in line or "G81" in line for line in lines)
    assert [line for line in lines if line.startswith(("M3", "S", "T", "M5", "G4", "(MSG"))] == [
        "T1",
        "S1000",
        "M3",
        "G4 P0.5",
        "(MSG,now)",
        "M5",
    ]
    program = feedplan.read_program(result.content, "mill")
    assert plan.program is not None
    assert np.array_equal(program.target, plan.program.target)
    assert program.events.words() == ("(program, expanded)", *plan.program.events.words())
    assert result.left == ()
    assert feedplan.plan(program, "mill").time == pytest.approx(plan.time, rel=1e-4)


def test_brackets_in_a_comment_become_square_ones() -> None:
    plan = planned("; gear, 3 mm (ply) for $32=1\nG21\nG1 X5 F3000\n;)(\nM2\n")
    result = feedplan.planned_program(plan, expand=True)
    said = feedplan.read_program(result.content, "mill").events.words()
    assert said == ("(program, expanded)", "(gear, 3 mm [ply] for $32=1)", "(][)", "M2")


def test_a_drawn_path_becomes_a_program() -> None:
    drawn = (
        b'{"unit": "mm", "feed": 80.0, "curves": ['
        b'{"degree": 2, "control_points": [[0, 0], [10, 0], [10, 10]], "weights": [1, 0.7, 1]}, '
        b'{"degree": 1, "control_points": [[10, 10], [10, 30]]}]}'
    )
    plan = feedplan.plan(drawn, "mill")
    result = feedplan.planned_program(plan, expand=True)
    program = feedplan.read_program(result.content, "mill")
    assert feedplan.plan(program, "mill").time == pytest.approx(plan.time, rel=1e-4)


def test_the_tip_is_not_expanded() -> None:
    plan = planned("G21 G43.1 Z80\nG0 X0 Y0 Z100\nG43.4\nG1 X20 A-20 F600\nG49\nM2\n", "trunnion-ac")
    with pytest.raises(InputError, match=r"words of the tool's tip \(G43.4, G43.5\) are not expanded"):
        feedplan.planned_program(plan, expand=True)

"""Words of Fanuc and Haas controls make the moves that LinuxCNC makes of programs with the same meaning."""

from __future__ import annotations

from pathlib import Path

import pytest

from feedplan.errors import ProgramError
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.program.gcode import read_gcode
from tests.program.linuxcnc import difference, moves_of, needs_linuxcnc, reference

# A rotation by 40 degrees about X3 Y2, written as rotated and shifted work coordinates.
ABOUT = "X[3-3*COS[40]+2*SIN[40]] Y[2-3*SIN[40]-2*COS[40]] R40"
MOVES = "G0 X5 Y1\nG1 X9 Z-1\nG3 X9 Y5 J2\nG2 X12 Y3 R4\nG91 G1 X2\nG90 G81 X1 Y2 Z-3 R1\nG80"

BOLTS = """O9010
#10=1
WHILE[#10LE#11]DO1
#12=#1+[#10-1]*360/#11
G81 X[#24+#18*COS[#12]] Y[#25+#18*SIN[#12]] Z#26 R1 F#9
#10=#10+1
END1
G80
M99"""

PROGRAMS = {
    "turned about zero": (
        f"G68 X0 Y0 R30\n{MOVES}\nG69 G0 X1 Y1",
        f"G10 L2 P1 R30\n{MOVES}\nG10 L2 P1 R0\nG0 X1 Y1",
    ),
    "turned about a place": (
        f"G68 X3 Y2 R40\n{MOVES}\nG69\nG0 X1 Y1",
        f"G10 L2 P1 {ABOUT}\n{MOVES}\nG10 L2 P1 X0 Y0 R0\nG0 X1 Y1",
    ),
    "turned about where the tool is": (
        f"G0 X3 Y2\nG68 R40\n{MOVES}",
        f"G0 X3 Y2\nG10 L2 P1 {ABOUT}\n{MOVES}",
    ),
    "turned anew": (
        "G68 X1 Y1 R10\nG0 X5 Y5\nG68 X0 Y0 R30\nX6 Y2",
        "G10 L2 P1 X[1-COS[10]+SIN[10]] Y[1-SIN[10]-COS[10]] R10\nG0 X5 Y5\nG10 L2 P1 X0 Y0 R30\nX6 Y2",
    ),
    "turned in work coordinates that are turned and shifted": (
        f"G10 L2 P2 X10 Y20 R15\nG55 G52 X1 Y2 Z3\nG68 X0 Y0 R25\n{MOVES}",
        f"G10 L2 P2 X[10+COS[15]-2*SIN[15]] Y[20+SIN[15]+2*COS[15]] Z3 R40\nG55\n{MOVES}",
    ),
    "further work offsets": (
        "#7021=10 #7022=5\nG54.1 P2 G0 X1 Y1\nG154 P3 X4\nG54 X1",
        "G10 L2 P2 X10 Y5\nG55 G0 X1 Y1\nG56 X4\nG54 X1",
    ),
    "a macro with a loop": (
        f"G65 P9010 X10 Y5 R20 A15 H6 Z-2 F90\nG0 Z9\nM30\n{BOLTS}",
        "F90\n#1=0\no1 repeat [6]\nG81 X[10+20*COS[15+60*#1]] Y[5+20*SIN[15+60*#1]] Z-2 R1\n#1=[#1+1]\n"
        "o1 endrepeat\nG80\nG0 Z9",
    ),
    "arguments that are not given": (
        "G65 P1 X5\nM30\nO1\nIF[#25EQ#0]THEN #25=7\nIF[#24NE#0]THEN #24=#24+1\nG0 X#24 Y#25 Z#26\n#24=#0\n"
        "G1 X#24 Y9\nM99",
        "G0 X6 Y7\nG1 Y9",
    ),
    "a macro that is run again": (
        "G65 P1 X5 L3\nM30\nO1\nG91 G0 X#24\n#24=#24+1\nM99",
        "G91 G0 X5\nX5\nX5",
    ),
    "a macro calls a subprogram": (
        "#1=3\nG65 P1 X5 Y4\nG0 X#1\nM30\nO1\nM98 P2\nG0 Y#25\nM99\nO2\nG0 X#24\n#25=8\nM99",
        "G0 X5\nY8\nX3",
    ),
    "a loop by GOTO": (
        "#1=0\nN10 #1=#1+1\nIF [#1 GT 5] GOTO 20\nG0 X#1\nGOTO 10\nX99\nN20 G0 Y3",
        "G0 X1\nX2\nX3\nX4\nX5\nY3",
    ),
    "numbers of lines belong to their program": (
        "M98 P1\nGOTO 10\nG0 X1\nN10 G0 X2\nM30\nO1\nGOTO#[1+30]\nG0 X3\nN0 #31=10\nGOTO [#31]\nG0 X5\n"
        "N10 G0 X4\nM99",
        "G0 X4\nX2",
    ),
    "the next line of a number": (
        "N5 G0 X1\n#1=#1+1\nIF[#1 EQ 2] GOTO 9\nGOTO 5\nN9 X2\nN5 X3",
        "G0 X1\nX3",
    ),
    "back to another line": (
        "M98 P1 L4\nG0 X9\nN50 G0 Y4\nM30\nO1\nG0 X1\nM99 P50",
        "G0 X1\nY4",
    ),
    "loops in loops": (
        "#2=1\nWHILE [#2 LE 2]DO 1\n#3=1\nWHILE[#3LE[1+1]]DO2\nG0 X[#2*10+#3]\n#3=#3+1\nEND 2\n#2=#2+1\nEND1",
        "G0 X11\nX12\nX21\nX22",
    ),
}


@needs_linuxcnc
def test_words_of_fanuc_make_linuxcncs_moves(tmp_path: Path) -> None:
    tools = tmp_path / "tools.tbl"
    tools.write_text("T1 P1 D1\n")
    files = [tmp_path / f"{i}.ngc" for i in range(len(PROGRAMS))]
    for file, (_, same) in zip(files, PROGRAMS.values(), strict=True):
        file.write_text(f"G21 G90 F100\n{same}\nM2\n")
    wrong = []
    for (name, (text, _)), (moves, error) in zip(PROGRAMS.items(), reference(files, tools), strict=True):
        assert error is None, f"{name}: {error}"
        found = difference(moves_of(read_gcode(f"G21 G90 F100\n{text}\nM2\n")), moves)
        if found is not None:
            wrong.append(f"{name}: {found}")
    assert not wrong, "\n".join(wrong)


def test_a_call_stands_beside_another_tool() -> None:
    program = read_gcode("G21 M98 P1 M61 Q7\nM30\nO1\nG0 X#5400\nM99\n")
    assert program.target.tolist() == [[7, 0, 0]]


def test_further_work_offsets_are_the_machines() -> None:
    axes = tuple(Axis(name, 100.0, 1000.0) for name in "XYZ")
    shop = Machine(name="shop", axes=axes, offsets=(("G54.1 P7", (10.0, 20.0, 30.0)),))
    program = read_gcode("G21 G0 X1\nG54.1 P7 X1 Y2\nG154 P7 Z5\nG10 L2 P0 X100\nX1\nM2\n", shop)
    assert program.target.tolist() == [[1, 0, 0], [11, 22, 0], [11, 22, 35], [101, 22, 35]]


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("G68 X0 Y0", "G68 has no angle: give it as R"),
        ("G18 G68 R30", "G68 is read in the plane G17"),
        ("G91 G68 R30", "G68 stands in G91"),
        ("G68 X0 Z1 R30", "G68 turns about Z"),
        ("G68 X0 G0 Y0 R30", "words G68 and G0 both take axis words"),
        ("G68 R30\nG92 X0", "G92 stands where G68 turns the coordinates: give G69 before"),
        ("G68 R30\nG55", "G55 stands where G68 turns the coordinates"),
        ("G68 R30\nG92.1", "G92.1 stands where G68 turns the coordinates"),
        ("G68 R30\nG10 L2 P1 X5", "G10 stands where G68 turns the coordinates"),
        ("G68.2 X0 Y0 Z0 I10 J20 K30", "word G68.2 is not read: tilted planes"),
        ("G54.1 X1", "G54.1 does not name its work offset: give P1 to P99"),
        ("G154 P100", "G154 does not name its work offset: give P1 to P99"),
        ("G54.1 P2 G81 Z-1 R1", "G54.1 takes the P of its block"),
        ("G54.1 P2 G4", "G54.1 takes the P of its block"),
        ("G65", "G65 calls no subprogram: give its number as P"),
        ("G65 P9010", "the subprogram 9010 is neither in the program nor in a file"),
        ("G0 G65 P9010 X1", "G65 stands beside other codes"),
        ("G66 P9010", "word G66 is not read: macros that each move calls"),
        ("GOTO 7", "GOTO 7 goes to line N7, which the program does not have"),
        ("GOTO", "GOTO has no whole number"),
        ("IF [1] X2", "IF says neither GOTO nor THEN"),
        ("IF [1 GOTO 2", "an operator or a bracket ] is missing"),
        ("WHILE [1] DO1\nX1", "o<1> while is not ended"),
        ("END1", "o<1> endwhile ends no block that is open"),
        ("G65 P1\nM30\nO1\nG0 X#4003\nM99", "#4003 is a value of one control"),
        ("G65 P1\nM30\nO1\n#3000=5 (NO Z)\nM99", "the macro raises the alarm 5"),
        ("#0=1", "#0 is no parameter"),
        ("M99 P10", "M99 goes to line N10, which the program does not have"),
        ("M99 P-1", "word P-1 is no number of a line"),
        ("G71 P10 Q20 U1", "word G71 is not read: each control cuts this cycle in passes of its own"),
        ("G87 X1 Z-1 R1", "word G87 is not read: it needs the angle"),
        ("G88 X1 Z-1 R1", "word G88 is not read: the operator ends it by hand"),
    ],
)
def test_what_cannot_be_read_names_the_word(block: str, words: str) -> None:
    with pytest.raises(ProgramError) as found:
        read_gcode(f"G21 F60 G0 Y0 Z0\n{block}\nM2\n")
    assert words in str(found.value)
    assert found.value.line is not None
    assert found.value.line >= 2


def test_loops_by_goto_are_bounded() -> None:
    with pytest.raises(ProgramError, match="run more lines than 1000 moves take"):
        read_gcode("G21 G0 X1\nN1 GOTO 1\nM2\n", max_moves=1000)

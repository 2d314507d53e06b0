"""Words that are unknown or impossible give one sentence with file, line and word."""

import re

import pytest

from feedplan.errors import ProgramError
from feedplan.program.gcode import read_gcode


def error(text: str | bytes) -> ProgramError:
    data = text.encode() if isinstance(text, str) else text
    with pytest.raises(ProgramError) as caught:
        read_gcode(data, name="part.ngc")
    message = str(caught.value)
    assert "\n" not in message
    line = re.match(r"part\.ngc(?: line (\d+))?: \S", message)
    assert line, message
    assert caught.value.line == (int(line[1]) if line[1] else None)
    return caught.value


def test_the_sentence_names_file_line_and_word() -> None:
    found = error("G21\nG1 X1 F60\nG1 X2 Q1.1\nM2\n")
    assert str(found).startswith("part.ngc line 3: word Q1.1 has no meaning here: ")
    assert found.line == 3


@pytest.mark.parametrize(
    ("block", "words"),
    [
        # Numbers.
        ("X", "word X has no number"),
        ("X Y1", "word X has no number"),
        ("X-", "word X has no number"),
        ("X.", "word X has no number"),
        ("X--1", "word X has no number"),
        ("X1.2.3", "'.3' is not understood"),
        ("X1 2", "'2' is not understood: a letter is missing"),
        ("X1,5", "',5' is not understood: numbers have a decimal point"),
        ("X1e3", "word e3 is not understood"),
        ("X1 \x1a", "the control character 0x1A is not understood: remove it"),
        ("\x0c(FACE)", "the control character 0x0C is not understood: remove it"),
        ("X1E3", "numbers have no exponents"),
        ("XNAN", "word XNAN is not understood"),
        ("Xinf", "word Xinf is not understood"),
        ("X1000001", "X would go to 1000001 mm, more than 1000000 mm from the machine's zero"),
        ("X1" + "0" * 400, "X would go to inf mm"),
        ("G91 X600000\nX600000", "X would go to 1200000 mm"),
        ("G20 X40000", "X would go to 1016000 mm"),
        ("A200000000", "A would go to 200000000 degrees"),
        ("X[1/0]", "1 / 0 has no finite value"),
        ("X[10**400]", "10 ** 400 has no finite value"),
        ("X#<depth>", "parameter #<depth>"),
        ("X[1", "bracket ] is missing"),
        ("#5", "#5 stands alone"),
        ("#5420=1", "#5420 is reported by the machine"),
        ("#6000=1", "#6000 is no parameter: parameters are #1 to #5602"),
        ("X#<_ini[a]b>", "configuration, which is not known here"),
        # Words.
        ("X1 X2", "word X2 is the second X"),
        ("G0 G1 X1", "words G0 and G1 belong to one modal group"),
        ("G90 G91", "words G90 and G91"),
        ("M3 M5", "words M3 and M5"),
        ("G123", "word G123 is not understood"),
        ("G1234567", "word G1234567 is not understood"),
        ("G-1", "word G-1 is not understood"),
        ("G1.05", "word G1.05 is not understood"),
        ("M3.5", "word M3.5 is not understood"),
        ("M-3", "word M-3 is not understood"),
        ("M70000", "word M70000 is not understood"),
        ("HELLO", "word HELLO is not understood"),
        ("G1 X1 N10", "word N10 is not the first of its block"),
        ("N-1 X1", "word N-1 is no block number"),
        ("X1 / Y2", "'/ Y2' is not understood"),
        ("X1 = 2", "'= 2' is not understood"),
        ("X1 % 2", "'% 2' is not understood: % begins its line"),
        ("G91 @1 @2", "'@2' is not understood: polar words stand once"),
        ("@1 X2", "polar words @ and ^ stand beside X or Y"),
        ("@5", "the place before is the origin"),
        ("G53 G0 @1 ^90", "G53 takes machine coordinates and no polar words"),
        ("G16 G91 X1 Y2", "G16 and G91 stand together"),
        ("X1 \u00e4", "'ä' is not understood"),
        ("S-100", "word S-100 is negative"),
        ("T-1", "word T-1 is negative"),
        # Words without a use.
        ("R5", "word R5 has no meaning here"),
        ("G1 X1 F60 I1", "word I1 has no meaning here"),
        ("G1 X1 F60 P1", "word P1 has no meaning here"),
        ("H1", "word H1 has no meaning here: put it beside G43"),
        ("L20", "word L20 has no meaning here"),
        ("M3 P1", "word P1 has no meaning here"),
        # Comments.
        ("(open", "comment '(open' is not closed"),
        ("(a (b) c)", "has another ( inside"),
        ("X1 )", "')' is not understood"),
        # Feeds.
        ("G1 X1", "a feed move has no feed: give F"),
        ("G2 X2 I1", "a feed move has no feed"),
        ("G81 X1 Z-1 R1", "a feed move has no feed"),
        ("G1 X1 F0", "a feed move has the feed F0"),
        ("G1 X1 F-60", "word F-60 is a negative feed"),
        ("G1 X1 F0.0000001", "word F0.0000001 is a feed that no machine has"),
        ("G1 X1 F[10 ** 10]", "word F10000000000 is a feed that no machine has"),
        ("G93 G1 X1", "inverse time (G93) has no F of its own"),
        ("G93 G1 X1 F60\nX2", "inverse time (G93) has no F of its own"),
        ("G93 G1 X1 F0", "word F0 is no inverse time"),
        ("F60 G93\nG94 G1 X1", "a feed move has no feed"),
        ("G95 F1 G1 X1", "the spindle speed is not known"),
        ("G95 F1 S100\nG1 X1", "the spindle speed is not known"),
        ("G95 F1 G96 S100 M3\nG1 X1", "(G96) the spindle speed is not known: use G97"),
        # Arcs.
        ("G3 X2 F60", "an arc in the plane G17 has no centre: give I and J, or R"),
        ("G3 F60", "an arc in the plane G17 has no centre"),
        ("G18 G3 X2 F60", "an arc in the plane G18 has no centre: give K and I, or R"),
        ("G3 X2 K1 F60", "word K1 is no centre in the plane G17"),
        ("G3 X2 I1 R1 F60", "an arc has both R and a centre"),
        ("G3 Z2 R1 F60", "an arc with R has no end in the plane G17"),
        ("G90.1 G3 X2 I1 F60", "no centre: give both I and J"),
        ("G3 X2 I0 F60", "the arc has no radius"),
        ("G3 X2 I2 F60", "the arc has no radius"),
        ("G3 X2 I0.9 F60", "the radius of the arc is 0.9000 mm at its start and 1.1000 mm at its end"),
        ("G3 X2 R0.9 F60", "the radius 0.9000 mm of the arc is too small to reach its end 2.0000 mm away"),
        ("G3 X2 R0 F60", "the radius 0.0000 mm of the arc"),
        ("G3 X2 F60 R" + "9" * 400, "word Rinf is more than 1e9"),
        ("G3 X0 R1 F60", "an arc with R ends where it starts"),
        ("G3 X2 I1 P0 F60", "word P0 is no number of turns"),
        ("G3 X2 I1 P1.5 F60", "word P1.5 is no number of turns"),
        ("G3 X2 I1 P20000 F60", "word P20000 is more than 10000 turns"),
        ("G3 I2000000000 F60", "the centre of an arc is more than 1e9 mm away"),
        # Codes.
        ("G41 D1", "G41 takes a diameter from the tool table: give one (--tool-table)"),
        ("G42.1", "G42.1 has no diameter: give it as D"),
        ("G41.1 D2\nG42.1 D2", "the compensation is on already: give G40 before"),
        ("G41.1 D2\nX0.9", "the first move after G41.1 is 0.9000 mm long and the tool's radius is 1.0000 mm"),
        ("G41.1 D2 L9\nG28 X0", "G28 stands where G41.1 is on"),
        ("G41.1 D2 L3", "takes a tool of the side 3: lathe tools have 1 to 9 and work in G18"),
        ("G19 G41.1 D2", "G41.1 is read in the planes G17 and G18"),
        ("F60 G41.1 D2\nG1 X5\nY3\nX4.5\nY0", "does not fit into the corner"),
        (
            "F60 G41.1 D2\nG1 X5\nG3 X5.5 Y0.5 I0 J0.5",
            "the radius 0.5000 mm of the arc is not larger than the tool's",
        ),
        ("F60 G41.1 D2\nG1 X5\nG40\nG3 X6 Y1 J1", "the first move after G40 is an arc"),
        ("G6 X1", "word G6 is not read: these splines are not read: post lines and arcs, or G5 to G5.3"),
        ("G17.1", "word G17.1 is not read"),
        ("G33 Z-1", "G33 has no pitch: give a positive K"),
        ("G33 Z-1 K1", "G33 follows the spindle and its speed is not known"),
        ("S100 M3 G76 Z-1 P1 I-1 J1 K0.5", "a K above J"),
        ("S100 M3 G76 Z-1 P1 I-1 J1", "G76 takes I, J and K"),
        ("G38.2 Z-1", "word G38.2 is not read: probing"),
        ("M98", "M98 calls no subprogram: give its number as P"),
        ("M98 P1000", "the subprogram 1000 is neither in the program nor in a file 1000.ngc"),
        ("M97 P1000", "M97 calls line N1000, which the program does not have"),
        ("M61", "M61 names no tool"),
        ("O100 sub", "word o<100> sub is not ended"),
        ("o<x> call", "the subprogram x is neither in the program nor in a file x.ngc"),
        ("o1 if [1]\nX1", "word o<1> if is not ended: the file may be truncated"),
        ("o1 endif", "word o<1> endif ends no block that is open"),
        ("o1 while\no1 endwhile", "an O word has no [condition]"),
        ("X1 o1 if [1]", "is not the first of its block"),
        ("o1 return", "return stands outside of subroutines"),
        ("o1 if [1] X2\no1 endif", "'X2' is not understood behind an O word"),
        ("X1\nO0002", "word O0002 opens a second program"),
        ("G4", "G4 has no time"),
        ("G4 U2", "G4 has no time"),
        ("G4 X1 Y2", "G4 has no time"),
        ("G4 P-1", "word P-1 is no dwell time"),
        ("G4 P9999999", "word P9999999 is no dwell time"),
        ("G2 X1 I1 G4 P1 F60", "G4 and an arc both use P"),
        ("G64 P-1", "word P-1 is no tolerance"),
        ("G10 L3 P1 Z1", "G10 L3 is not read"),
        ("G10 P1 Z1", "G10 does not say what it sets"),
        ("G10 L1 Z1", "G10 sets no tool: give its number as P"),
        ("G10 L2 P10 Z1", "G10 needs P0 to P9"),
        ("G10 L2 P1.5 Z1", "word P1.5 is no work offset"),
        ("F60 G10 L2 P1 R45\nG18 G2 X1 K1", "work coordinates that are turned about Z"),
        ("G92", "G52 and G92 need the axes they set"),
        ("G0 G92 X0", "words G92 and G0 both take axis words"),
        ("G43.1", "G43.1 sets nothing"),
        ("G43.1 G0 Z1", "words G43.1 and G0 both take axis words"),
        ("G43.2", "G43.2 adds nothing"),
        ("G43.2 H1 Z1", "both H and axis words"),
    ],
)
def test_what_cannot_be_read_names_the_word(block: str, words: str) -> None:
    found = error(f"G21 G0 Y0 Z0\n{block}\nM2\n")
    assert words in str(found)
    assert found.line is not None
    assert found.line >= 2


def test_axis_words_need_a_motion_code() -> None:
    assert "word X1 has no motion code in force: give G0 or G1 before it" in str(error("X1\n"))
    assert "word @5.3 has no motion code in force" in str(error("@5.30\n"))
    assert "word ^45 has no motion code in force" in str(error("^45\n"))


@pytest.mark.parametrize(
    ("text", "line", "language"),
    [
        ("0 BEGIN PGM 12 MM\n1 L X+30 FMAX\n", 1, "Heidenhain conversational"),
        ("%_N_PART_MPF\n;$PATH=/_N_MPF_DIR\nG0 X1\n", 1, "Siemens Sinumerik"),
        ("G0 X1\nDEF REAL WIDTH=12\n", 2, "Siemens Sinumerik"),
        ("M82\nM109 S200\nG29\n", 3, "3-D printer"),
        ("<?xml version='1.0'?>\n", 1, "no machine"),
    ],
)
def test_other_languages_are_recognised(text: str, line: int, language: str) -> None:
    found = error(text)
    assert str(found).endswith(f"; the file looks like {language} code, and only RS-274 (G-code) is read")
    assert found.line == line


@pytest.mark.parametrize(
    "text", ["", "\n", "(nothing)\n; to see\n", "%\n%\n", "G21 G90\nM3 S100\nM30\n", "G0\nM2"]
)
def test_a_program_without_motion_is_an_error(text: str) -> None:
    found = error(text)
    assert "the program moves nothing" in str(found)
    assert found.line is None


def test_a_binary_file_is_an_error() -> None:
    assert "binary or UTF-16" in str(error(b"G21 G0 X1\n\x00\x01"))
    assert "binary or UTF-16" in str(error("G21 G0 X1\n".encode("utf-16")))


def test_a_program_cut_within_a_word_is_an_error() -> None:
    found = error("G21\nG1 X1 F60\nG1 X2 Y")
    assert "word Y has no number: the file ends here and may be truncated" in str(found)
    assert found.line == 3


def test_deep_nesting_is_an_error() -> None:
    assert "nested" in str(error("G0 X" + "[" * 100_000))


def test_loops_and_calls_are_bounded() -> None:
    endless = "G21 G0 X1\no1 while [1]\nG4 P0\no1 endwhile\nM2\n"
    with pytest.raises(ProgramError, match="run more lines than 1000 moves take: check their conditions"):
        read_gcode(endless, max_moves=1000)
    moving = "G21 G91\no1 while [1]\nG0 X1\no1 endwhile\nM2\n"
    with pytest.raises(ProgramError, match="more than 1000 moves"):
        read_gcode(moving, max_moves=1000)
    deep = "o1 sub\no1 call\no1 endsub\no1 call\nG0 X1\nM2\n"
    assert "subroutines call each other more than 100 deep" in str(error(deep))

"""Tool tables of LinuxCNC, and the values that programs take from them."""

from pathlib import Path

import pytest

from feedplan.errors import InputError, ProgramError
from feedplan.program.read import read_program
from feedplan.program.tools import Tool, read_tools

TABLE = "; tools of the shop\nT1 P2 X+1.5 Z-50.25 A90 D6 Q9 ;6 mm T9\n\nt12 p-1 d.5 i45 j-10\n"


def test_a_line_is_a_tool(tmp_path: Path) -> None:
    file = tmp_path / "tool.tbl"
    file.write_text("\ufeff" + TABLE, "utf-8")  # editors of Windows write a byte order mark first
    offset = (1.5, 0.0, -50.25, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert read_tools(file) == (Tool(1, 2, offset, 6.0, 9), Tool(12, 0, (0.0,) * 9, 0.5, 0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("T1 Z", "tool.tbl line 1: 'Z' is no word of a tool table"),
        ("Z5", "line 1: the tool has no number"),
        ("T1.5", "line 1: T is 1.5: give a whole number from 0"),
        ("T" + 400 * "9", "line 1: T is inf: give a whole number from 0 to 4294967295"),
        ("T1\nT2 P99999999999", "line 2: P is 1e\\+11: give a whole number"),
        ("T1 Q-1", "line 1: Q is -1: give a whole number"),
        ("T1\nT2 K5", "line 2: 'K5' is no word"),
        ("T1 D6\n\nT2\nT1 D8", "tool.tbl line 4: T1 is the tool of line 1 already: keep one of them"),
        ("T1 D6 d8", "tool.tbl line 1: d8 is the second D of its tool: keep one of them"),
    ],
)
def test_what_is_no_tool_is_refused(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "tool.tbl"
    file.write_text(text)
    with pytest.raises(InputError, match=words):
        read_tools(file)
    with pytest.raises(InputError, match="cannot be read"):
        read_tools(tmp_path / "none.tbl")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no /dev/zero")
def test_a_table_without_an_end_is_refused() -> None:
    with pytest.raises(InputError, match="/dev/zero has more than 1048576 bytes: give a tool table"):
        read_tools(Path("/dev/zero"))


def test_programs_take_lengths_and_radii(tmp_path: Path) -> None:
    (tmp_path / "tool.tbl").write_text("T1 Z50 D2\n")
    text = "G21 F600\nT1 M6 G43\nG0 Z1\nG41\nG1 X5\nY8\nG40\nM2\n"
    program = read_program(text, tool_table=tmp_path / "tool.tbl")
    assert program.target.tolist() == [[0, 0, 51], [4, 1, 51], [4, 8, 51]]
    with pytest.raises(ProgramError, match="the tool table has no tool 7: add it there"):
        read_program("G21 G43 H7\nG0 X1\nM2\n", tool_table=tmp_path / "tool.tbl")

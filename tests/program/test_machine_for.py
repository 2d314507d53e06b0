"""Which bundled machine a program fits, and the message about axes that a machine lacks."""

from pathlib import Path
from typing import Any

import pytest

from feedplan.cli import main
from feedplan.errors import ProgramError
from feedplan.program.machine_for import smallest_machine
from feedplan.program.read import read_program


def smallest(text: str) -> str:
    return smallest_machine(lambda machine: read_program(text, machine))[0].name


@pytest.mark.parametrize(
    ("words", "name"),
    [("X1 Z2", "mill"), ("A5", "rotary-table"), ("B5", "head-table"), ("A5 C1", "head-head")],
)
def test_the_smallest_machine_has_all_axes(words: str, name: str) -> None:
    assert smallest(f"G21 G0 {words}\nM2\n") == name


def test_the_smallest_machine_holds_all_places() -> None:
    assert smallest("G21 G0 A5 Z-50\nM2\n") == "head-head"
    assert smallest("G21 G0 A5 Z-5000\nM2\n") == "rotary-table"


def test_the_tip_of_the_tool_takes_a_machine_that_follows_it() -> None:
    assert smallest("G21 G43.4 H1\nG0 X1 A5 C5\nM2\n") == "head-head"
    assert smallest("G21 G43.4 H1\nG0 X1 A5\nM2\n") == "rotary-table"


def test_what_no_machine_can_do_says_why() -> None:
    with pytest.raises(ProgramError, match="word U moves an axis that the machine does not have"):
        smallest("G21 G0 U1\nM2\n")
    with pytest.raises(ProgramError, match="line 2: word Q1 has no meaning"):
        smallest("G21\nG0 X1 Q1\nM2\n")


def test_machines_that_have_an_axis_are_named() -> None:
    sentence = r"use a machine with A \(rotary-table, head-head, trunnion-ac\), or post without it"
    with pytest.raises(ProgramError, match=sentence):
        read_program("G21 G0 A1\nM2\n", "mill")


def test_the_command_line_reads_as_it_is_told(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "tool.tbl").write_text("T1 Z50 D2\n")
    library = tmp_path / "library"
    library.mkdir()
    (library / "side.ngc").write_text("o<side> sub\nG1 A#1\no<side> endsub\n")
    program = tmp_path / "part.ngc"
    program.write_text("G21 G64 P0.01\nT1 M6 G43\nG0 Z1\nG1 X5000\no<side> call [20]\nM2\n")
    reading = [
        "--tool-table",
        str(tmp_path / "tool.tbl"),
        "--subprograms",
        str(library),
        "--whole-step",
        "0.001",
    ]
    assert main(["plan", str(program), "--machine", "auto", "--feed", "20", *reading]) == 0
    out, err = capsys.readouterr()
    assert "rotary-table" in out
    assert "not known" not in err
    assert main(["fit", str(program), "--machine", "auto", *reading]) == 2
    assert "a feed move has no feed" in capsys.readouterr().err
    assert main(["plan", str(program), "--machine", "mill", "--feed", "20", *reading]) == 2
    assert "in side.ngc line 2: word A moves an axis" in capsys.readouterr().err
    assert main(["plan", str(program), "--feed", "20", "--tool-table", "nowhere.tbl"]) == 2
    assert "the tool table nowhere.tbl cannot be read" in capsys.readouterr().err

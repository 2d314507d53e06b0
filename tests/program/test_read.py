"""Programs from files: anything that is not a program gives one sentence."""

from pathlib import Path
from typing import Any

import pytest

from feedplan.errors import InputError, ProgramError
from feedplan.machine.machine import Machine
from feedplan.program.gcode import read_gcode
from feedplan.program.read import read_program


def test_a_file_is_read_under_its_name(tmp_path: Path) -> None:
    path = tmp_path / "part.ngc"
    path.write_bytes(b"G21 G0 X1\n/X2\nM2\n")
    for program in (read_program(path), read_program(str(path)), read_gcode(path), read_gcode(str(path))):
        assert program.name == "part.ngc"
        assert program.target.tolist() == [[1, 0, 0]]
    assert len(read_program(path, Machine.load("router"), block_delete=False)) == 2
    path.write_text("G21 G0 X1\nQ2\n")
    with pytest.raises(ProgramError, match=r"^part\.ngc line 2: word Q2"):
        read_program(path)


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(
        ProgramError, match=r"part\.ngc cannot be read \(No such file or directory\): give the path"
    ):
        read_program(tmp_path / "part.ngc")


def test_a_directory_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ProgramError, match=r"is a directory: give the program file in it$"):
        read_program(tmp_path)


def test_an_empty_file_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "part.ngc"
    path.touch()
    with pytest.raises(ProgramError, match=r"part\.ngc is empty: give a part program$"):
        read_program(path)


@pytest.mark.parametrize(
    ("option", "value"), [("tool_table", "tools.tbl"), ("whole_step", 0.001), ("block_delete", False)]
)
def test_what_only_gcode_takes_is_refused_for_a_path_file(option: str, value: Any) -> None:
    path = b'{"feed": 9, "curves": [{"degree": 1, "control_points": [[0, 0], [5, 0]]}]}'
    sentence = rf"^part\.json is no G-code, which alone takes {option}: leave it out$"
    with pytest.raises(InputError, match=sentence):
        read_program(path, name="part.json", **{option: value})


def test_a_binary_file_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "part.ngc"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(ProgramError, match=r"^part\.ngc: the file is binary"):
        read_program(path)


def test_a_file_that_is_too_large_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "part.ngc"
    with path.open("wb") as file:
        file.truncate((1 << 30) + 1)
    with pytest.raises(
        ProgramError, match="has 1073741825 bytes, more than the 1073741824 that are read: split it"
    ):
        read_program(path)
    with pytest.raises(ProgramError, match="program has 10 bytes, more than the 9"):
        read_gcode(b"G21 G0 X1\n", max_bytes=9)


def test_a_path_that_is_none_is_an_error() -> None:
    with pytest.raises(ProgramError, match="is not the path of a file"):
        read_program("part\0.ngc")

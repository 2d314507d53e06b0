"""Parameters, O words and subprograms; test_linuxcnc compares their meaning with LinuxCNC."""

from pathlib import Path

import pytest

from feedplan.errors import InputError, ProgramError
from feedplan.program.gcode import read_gcode
from feedplan.program.read import read_program


def targets(text: str, **options: object) -> list[list[float]]:
    program = read_gcode(f"G21 F600\n{text}\nM2\n", **options)  # type: ignore[arg-type]
    return [row[:2] for row in program.target.tolist()]


def test_lines_of_moves_are_those_that_make_them() -> None:
    text = "o1 sub\nG0 X#1\no1 endsub\no2 repeat [2]\no1 call [#5420+1]\nG0 Y[#5421+1]\no2 endrepeat\nM2\n"
    program = read_gcode(text)
    assert program.line.tolist() == [2, 6, 2, 6]
    assert program.target[:, :2].tolist() == [[1, 0], [1, 1], [2, 1], [2, 2]]


def test_a_parameter_that_is_not_set_is_0_with_a_warning() -> None:
    program = read_gcode("G21 G0 X1 Y#7\nX#8\nM2\n")
    assert program.target[:, 0].tolist() == [1, 0]
    assert program.warnings == (
        "parameter #7 is used before the program sets it: 0 is taken, as LinuxCNC does",
    )


def test_subprograms_are_found_beside_the_program_and_in_folders(tmp_path: Path) -> None:
    other = tmp_path / "library"
    other.mkdir()
    (tmp_path / "Square.NGC").write_text("o<square> sub\nG0 X#1\nY#1\no<square> endsub\nM2\n")
    (other / "O0100.nc").write_text("%\nO100 (slot)\nG91 G0 X1\nG90 M99\n%\n")
    main = tmp_path / "main.ngc"
    main.write_text("G21\no<square> call [3]\nM98 P100 L2\nM2\n")
    program = read_gcode(main, subprograms=[other])
    assert program.target[:, :2].tolist() == [[3, 0], [3, 3], [4, 3], [5, 3]]
    assert program.line.tolist() == [2, 2, 3, 3]


def test_a_fault_in_another_file_names_both_places(tmp_path: Path) -> None:
    (tmp_path / "deep.ngc").write_text("o<deep> sub\n\nG0 X[1/0]\no<deep> endsub\n")
    (tmp_path / "other.ngc").write_text("o<name> sub\no<name> endsub\n")
    main = tmp_path / "main.ngc"
    main.write_text("G21\nG0 X1\no<deep> call\nM2\n")
    with pytest.raises(
        ProgramError, match=r"^main\.ngc line 3: in deep\.ngc line 3: 1 / 0 has no finite value"
    ) as caught:
        read_gcode(main)
    assert caught.value.line == 3
    main.write_text("G21\no<other> call\nM2\n")
    with pytest.raises(ProgramError, match=r"the file other\.ngc has no subprogram other"):
        read_gcode(main)
    for name in ("../main", "a/../../b", "nowhere"):
        main.write_text(f"G21\no<{name}> call\nM2\n")
        with pytest.raises(ProgramError, match="is neither in the program nor in a file"):
            read_gcode(main)


def test_a_folder_of_subprograms_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for name, why in (
        ("none", "No such file or directory"),
        ("file", "Not a directory"),
        (300 * "x", "File name"),
    ):
        with pytest.raises(
            InputError, match=f"of subprograms cannot be read \\({why}.*give the path of a folder"
        ):
            read_program("G21\nG0 X1\nM2\n", subprograms=[tmp_path, tmp_path / name])


def test_numbered_subprograms_share_the_parameters_of_their_caller() -> None:
    text = "#1=2\nM98 P10 L3\nG0 Y#1\nM30\nO10\nG0 X#1\n#1=[#1+1]\nM99"
    assert targets(text) == [[2, 0], [3, 0], [4, 0], [4, 5]]


def test_a_subprogram_may_begin_at_a_block_number() -> None:
    assert targets("M97 P20 L2\nG90 G0 Y1\nM30\nN20 G91 G0 X1\nM99") == [[1, 0], [2, 0], [2, 1]]


def test_m99_ends_a_main_program_with_a_warning() -> None:
    program = read_gcode("G21 G0 X1\nM99\n")
    assert program.warnings == ("line 2: M99 ends the program, which a control would run again and again",)


def test_a_library_of_subroutines_says_that_it_is_one() -> None:
    with pytest.raises(ProgramError, match="the program defines subroutines and moves nothing"):
        read_gcode("o<a> sub\nG0 X1\no<a> endsub\nM2\n", name="library.ngc")


def test_headers_of_other_controls_are_read() -> None:
    text = "%  12345 (shop)\n:0097 (bracket)\nN1 G21\nN2 G0 X1\nM30\n%\n"
    assert read_gcode(text).target[:, 0].tolist() == [1]
    assert read_gcode("%\nO1200(BRACKET)\nG21 G0 X1\nM30\n%\n").target[:, 0].tolist() == [1]


def test_unknown_m_codes_stop_with_one_warning_each() -> None:
    program = read_gcode(
        "G21\nM428\nG0 X1 M31\nX2 M31\nM204 P500 X7 T99\nX3 M29 M77\nM117 Hello (x\nX4\nM2\n"
    )
    assert program.target[:, 0].tolist() == [1, 2, 3, 4]
    assert [warning.split(" is not known")[0] for warning in program.warnings] == [
        "line 2: what M428 does",
        "line 3: what M31 does",
        "line 5: what M204 does",
        "line 6: what M29 does",
        "line 6: what M77 does",
        "line 7: what M117 does",
    ]
    assert program.stop.tolist() == [True, True, True, True]


def test_words_of_extruders_are_left_out_with_a_warning() -> None:
    program = read_gcode("G21 G90\nG92 E0\nG1 X5 E0.5 F600\nG1 E-1 F1200\nX6 E1\nM2\n")
    assert program.target[:, 0].tolist() == [5, 6]
    assert sum("they move an extruder, which is not planned" in warning for warning in program.warnings) == 1


def test_words_of_offsets_that_no_code_uses_are_left_out_with_a_warning() -> None:
    program = read_gcode("G21 G90\nT1 D1\nG1 X5 D2 F600\nG83 X6 Z-3 R1 Q1 D0.2\nG80\nG96 S100 D900\nM2\n")
    (warning,) = program.warnings
    assert warning.startswith("line 2: the words D that stand alone are left out")
    assert program.target[0, 0] == 5


def test_a_feed_may_be_given_for_moves_before_the_first_f() -> None:
    with pytest.raises(ProgramError, match=r"no feed: give F before .* \(--feed\)"):
        read_gcode("G21 G1 X1\nM2\n")
    assert read_gcode("G21 G1 X1\nX2 F60\nM2\n", feed=30.0).feed.tolist() == [30, 1]


def test_lengths_without_a_point_may_count_steps() -> None:
    program = read_gcode("G21 G0 X1500 Y1.5\nG2 X2500 I500 F600\nG4 P1\nM2\n", whole_step=0.001)
    assert program.target[:, :2].tolist() == [[1.5, 1.5], [2.5, 1.5]]
    assert program.arc_centre[0].tolist() == [2, 1.5, 0]
    assert program.feed[1] == 10
    assert program.dwell[-1] == 1


def test_g60_and_polar_coordinates_of_fanuc() -> None:
    program = read_gcode("G21 G16 G0 X10 Y90\nY180\nG15 G60 X3\nG1 X4 F60\nG60\nX5\nM2\n")
    assert program.target[:, :2].round(12).tolist() == [[0, 10], [-10, 0], [3, 0], [4, 0], [5, 0]]
    assert program.control.tolist() == [2, 2, 0, 2, 0]

"""Work offsets, G92, tool lengths and the home position."""

import pytest

from feedplan.errors import MachineError, ProgramError
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.program.gcode import read_gcode


def machine(letters: str = "XYZ", **fields: object) -> Machine:
    return Machine("shop", tuple(Axis(letter, 100.0, 1000.0) for letter in letters), **fields)  # type: ignore[arg-type]


SHOP = machine(
    home=(1.0, 2.0, 300.0),
    offsets=(("G54", (100.0, 50.0, -20.0)), ("G59.3", (7.0, 8.0, 9.0))),
)


def targets(text: str, where: Machine | None = None) -> list[list[float]]:
    return read_gcode(f"G21\n{text}\nM2\n".encode(), where).target.tolist()


def test_work_offsets_come_from_the_machine() -> None:
    assert targets("G0 X1 Y1 Z1\nG55 X1\nG59.3 X1", SHOP) == [[101, 51, -19], [1, 51, -19], [8, 51, -19]]


def test_a_change_of_offset_moves_nothing() -> None:
    assert targets("G0 X1\nG55\nG54\nY2") == [[1, 0, 0], [1, 2, 0]]


@pytest.mark.parametrize(
    ("code", "number"),
    [
        ("G54", 1),
        ("G55", 2),
        ("G56", 3),
        ("G57", 4),
        ("G58", 5),
        ("G59", 6),
        ("G59.1", 7),
        ("G59.2", 8),
        ("G59.3", 9),
    ],
)
def test_g10_l2_sets_each_offset(code: str, number: int) -> None:
    assert targets(f"G91 G10 L2 P{number} X10 Y20\nG90 {code} G0 X1 Y1") == [[11, 21, 0]]


def test_g10_p0_sets_the_offset_in_force() -> None:
    assert targets("G56\nG20 G10 L2 P0 Z1\nG21 G0 Z0\nG54 Z1") == [[0, 0, 25.4], [0, 0, 1]]


def test_g10_l20_lets_the_place_have_the_numbers_given() -> None:
    assert targets("G0 X10 Y5\nG10 L20 P1 X0\nG1 X1 Y6 F60") == [[10, 5, 0], [11, 6, 0]]
    assert targets("G0 X10\nG92 X0\nG43.1 Z3\nG10 L20 P2 X4 Z1\nG55 X4 Z2", None) == [[10, 0, 0], [10, 0, 1]]


def test_g92_renames_the_place_and_is_reset_suspended_and_restored() -> None:
    assert targets("G0 X10\nG92 X0 Y0\nX1\nG92.1\nX1") == [[10, 0, 0], [11, 0, 0], [1, 0, 0]]
    assert targets("G0 X10\nG92 X0\nG92.2\nX1\nG92.3\nX1") == [[10, 0, 0], [1, 0, 0], [11, 0, 0]]
    assert targets("G0 X10\nG92 X0\nG92 X5\nX6\nG92.1\nG92.3\nX6") == [[10, 0, 0], [11, 0, 0], [6, 0, 0]]


def test_g52_sets_the_offset_that_g92_shares() -> None:
    assert targets("G52 X10\nG0 X1\nG52 X0\nX1", SHOP) == [[111, 0, 0], [101, 0, 0]]


def test_tool_lengths_shift_along_their_axes() -> None:
    assert targets("G43.1 Z50\nG0 Z1\nG43.2 Z5\nZ2\nG49\nZ3") == [[0, 0, 51], [0, 0, 57], [0, 0, 3]]


def test_unknown_tool_lengths_count_as_nothing_with_one_warning() -> None:
    program = read_gcode(b"G21\nG43 H1 G0 Z10\nG43 H2 Z20\nG43.2 H3\nZ30\nM2\n")
    assert program.target[:, 2].tolist() == [10, 20, 30]
    assert program.warnings == (
        "line 2: the tool lengths that G43 calls for are not known: 0 is taken for each (a tool table, or "
        "G43.1 Z, gives them)",
    )


def test_arc_centres_follow_the_offsets() -> None:
    text = b"G21\nG0 X10 Y0\nG90.1 G3 X0 Y10 I0 J0 F60\nM2\n"
    assert read_gcode(text, SHOP).arc_centre.tolist() == [[100, 50, 0]]


def test_g28_goes_by_the_place_named_to_the_home_of_the_axes_named() -> None:
    assert targets("G0 X10 Y10 Z10\nG28 Z20", SHOP) == [[110, 60, -10], [110, 60, 0], [110, 60, 300]]
    assert targets("G55 G0 X10 Y10 Z10\nG91 G28 Z0\nG28 X5 Y0", SHOP) == [
        [10, 10, 10],
        [10, 10, 300],
        [15, 10, 300],
        [1, 2, 300],
    ]


def test_g28_without_axes_sends_all_axes_home() -> None:
    assert targets("G55 G0 X10\nG30", SHOP) == [[10, 0, 0], [1, 2, 300]]
    with_table = machine("XYZA", home=(0.0, 0.0, 0.0, 45.0))
    program = read_gcode(b"G21\nG0 X10\nG28\nM2\n", with_table)
    assert program.axes == ("X", "Y", "Z", "A")
    assert program.target.tolist() == [[10, 0, 0, 0], [0, 0, 0, 45]]


def test_g0_beside_g28_stays_in_force() -> None:
    assert targets("G0 X10 Z5\nG0 G91 G28 Z0\nG90 X1") == [[10, 0, 5], [10, 0, 0], [1, 0, 0]]


def test_g53_needs_absolute_mode_and_a_straight_move() -> None:
    assert targets("G0 G53 Z5", SHOP) == [[0, 0, 5]]
    for text in ("G91 G53 G0 X1", "G0 X1\nG53", "G0 X1\nG3 G53 X2 I1 F60"):
        with pytest.raises(ProgramError, match="G53"):
            targets(text)


def test_an_axis_that_the_machine_lacks_is_an_error() -> None:
    with pytest.raises(
        ProgramError, match=r"^program line 3: word A moves an axis that the machine does not have"
    ):
        targets("G0 X1\nA90", SHOP)


def test_an_offset_with_an_unknown_name_is_an_error() -> None:
    with pytest.raises(MachineError, match=r"shop: offsets has 'G60': use G54 to G59, .* P99$"):
        targets("G0 X1", machine(offsets=(("G60", (0.0, 0.0, 0.0)),)))


def test_a_home_that_is_no_place_is_an_error() -> None:
    with pytest.raises(ProgramError, match="line 3: X would go to 2000000 mm"):
        targets("G0 Y1\nG28", machine(home=(2e6, 0.0, 0.0)))

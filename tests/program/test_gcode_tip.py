"""G43.4, G43.5 and G49: the meaning of axis words, and that no change of it moves a joint."""

import math
import re

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.errors import MachineError, ProgramError
from feedplan.machine.axis_words import axis_words
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.machine.path_derivatives import positions
from feedplan.machine.rotary import RotaryChain
from feedplan.program.gcode import read_gcode
from feedplan.program.program import Program
from feedplan.program.tools import Tool

FIVE_AXES = ["trunnion-ac", "trunnion-bc", "head-table", "head-head"]


def read(text: str, machine: Machine | str | None = "trunnion-ac") -> Program:
    known = Machine.load(machine) if isinstance(machine, str) else machine
    return read_gcode(f"G21 F600\n{text}\nM2\n", known, name="part.ngc")


def joints(program: Program, machine: Machine, row: int, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint positions for a position in the words of a row, by the machine's own kinematics."""
    assert program.coordinate_mode is not None
    assert program.tool_length is not None
    length = float(program.tool_length[row])
    words = axis_words(
        machine,
        program.axes,
        CoordinateMode(int(program.coordinate_mode[row])),
        tool_length=None if math.isnan(length) else length,
    )
    found: NDArray[np.float64] = positions(words.kinematics, words.tip(place[None]))[0]
    return found


@pytest.mark.parametrize("name", FIVE_AXES)
def test_a_change_of_meaning_moves_no_joint(name: str) -> None:
    machine = Machine.load(name)
    tilt = machine.axis_names[3]
    program = read(
        f"""G0 X10 Y20 Z300 {tilt}-20 C40
        G43.1 Z80
        G43.4
        G1 X0 Y5 Z3
        G1 {tilt}-30 C60
        G49
        G1 X1
        G43.4 H3
        G1 X2
        G43.5
        G1 X3 I0.1 J0.2 K0.9
        I0.3 J0.1 K0.9
        G49
        Z500""",
        name,
    )
    assert program.coordinate_mode is not None
    assert program.coordinate_mode.tolist() == [0, 1, 1, 0, 1, 2, 2, 0]
    assert program.tool_length == pytest.approx([math.nan, 80, 80] + [math.nan] * 5, nan_ok=True)
    assert program.change_move.tolist() == [1, 3, 4, 5, 7]
    starts = program.starts()
    for row in range(1, len(program)):
        before = joints(program, machine, row - 1, program.target[row - 1])
        after = joints(program, machine, row, starts[row])
        turns = (after - before)[3:] / 360
        # Two pairs of angles give the same direction, so only directions are compared.
        if CoordinateMode.VECTOR in (program.coordinate_mode[row - 1], program.coordinate_mode[row]):
            direction = [
                axis_words(machine, program.axes, CoordinateMode.VECTOR).kinematics.tip(q)
                for q in (before, after)
            ]
            assert direction[0] == pytest.approx(direction[1], abs=1e-9)
        else:
            assert turns == pytest.approx(np.round(turns), abs=1e-12)
            assert after[:3] == pytest.approx(before[:3], abs=1e-9)
    # The tool stops before every change.
    assert program.stop[program.change_move - 1].all()


def test_joints_after_directions_follow_them_from_where_they_were() -> None:
    # Twice around with the tool tilted by 30 degrees: C counts the turns, A keeps its angle.
    sine, cosine = math.sin(math.radians(30)), math.cos(math.radians(30))
    turn = [math.radians(angle) for angle in range(0, 721, 40)]
    blocks = "\n".join(f"I{sine * math.cos(a):.9f} J{sine * math.sin(a):.9f} K{cosine:.9f}" for a in turn)
    for start, tilt, end in ((-90, -30, 630), (90, 30, 810)):
        program = read(f"G0 A{tilt} C{start}\nG43.5 H1\nG1 X1\n{blocks}\nG49\nG1 X5")
        assert program.axes[3:5] == ("A", "C")
        assert program.starts()[-1][3:5] == pytest.approx([tilt, end], abs=1e-5)


def test_an_upright_tool_leaves_the_first_axis_where_it_is() -> None:
    program = read("G0 C77\nG43.5 H1\nG1 X1 K1\nG49\nG1 X5")
    assert program.starts()[-1][program.axes.index("C")] == 77


def test_the_tip_is_on_the_part_by_hand() -> None:
    # A-90 about (y, z) = (0, 50) with a tool of 77 mm: the point (0, 0) of the face is at joints (50, 127).
    program = read("G0 A-90 Y50 Z127\nG43.1 Z77\nG43.4\nG1 X1")
    assert program.change_start[0] == pytest.approx([0, 0, 0, -90, 0], abs=1e-12)
    assert program.target[-1] == pytest.approx([1, 0, 0, -90, 0], abs=1e-12)
    assert program.warnings == ()


def test_axes_that_are_not_named_stay_where_the_tip_is() -> None:
    program = read("G0 X1 Y2 Z300\nG43.4 H1\nG1 Z20\nG91 G1 X3")
    # The tool in the machine file is 120 mm long.
    assert program.change_start.tolist() == [[1, 2, 180, 0, 0]]
    assert program.target[1:].tolist() == [[1, 2, 20, 0, 0], [4, 2, 20, 0, 0]]


def test_tip_words_leave_the_tool_length_out_and_take_work_offsets() -> None:
    program = read("G10 L2 P1 X10 C5\nG43.1 Z50\nG0 X1 Z1 C1\nG43.4\nG0 X1 Z1 C1\nG49\nG0 X1 Z1")
    assert program.target[:, [0, 2, 4]].tolist() == [[11, 51, 6], [11, 1, 6], [11, 1, 6]]
    assert program.tool_length is not None
    assert program.tool_length[1] == 50


def test_a_length_that_is_not_known_is_the_machine_files_with_a_warning() -> None:
    program = read("G43.4 H5\nG0 X1\nG43.5 H5\nG0 X2\nG43.4 H6\nG0 X3")
    assert program.tool_length is not None
    assert np.isnan(program.tool_length).all()
    (warning,) = program.warnings
    assert warning.startswith("line 2: the tool length that G43.4 calls for is not known: the machine file's")


def test_the_length_of_a_tool_of_the_table_is_known() -> None:
    lengths = {1: (0.0, 0.0, 80.0), 2: (5.0, 0.0, 30.0)}
    tools = [Tool(number, number, (*offset, *[0.0] * 6), 0.0, 0) for number, offset in lengths.items()]
    machine = Machine.load("trunnion-ac")
    by_name = read_gcode("G21 F600\nG0 Z300\nG43.4 H1\nG1 X5\nM2\n", machine, tools=tools)
    in_force = read_gcode("G21 F600\nG0 Z300\nG43 H1\nG43.4\nG1 X5\nM2\n", machine, tools=tools)
    assert by_name.warnings == in_force.warnings == ()
    assert by_name.tool_length is not None
    assert by_name.tool_length[1] == 80
    assert by_name.change_start.tolist() == in_force.change_start.tolist() == [[0, 0, 220, 0, 0]]
    with pytest.raises(ProgramError, match=r"line 2: G43\.4 works with a tool length in Z and X has one too"):
        read_gcode("G21\nG43.4 H2\nG0 X5\nM2\n", machine, tools=tools)
    with pytest.raises(ProgramError, match="line 2: the tool table has no tool 3"):
        read_gcode("G21\nG43.4 H3\nG0 X5\nM2\n", machine, tools=tools)


def test_a_change_before_the_first_move_starts_at_the_joints_zero() -> None:
    program = read("G43.4 H1\nG0 X1 Z0")
    assert program.start.tolist() == [0, 0, -120, 0, 0]
    assert program.starts().tolist() == [[0, 0, -120, 0, 0]]
    assert program.start_dwell == 0


def test_a_change_without_a_move_leaves_no_trace() -> None:
    program = read("G0 X1\nG43.4 H1\nG49\nG0 X2\nG43.4 H1")
    assert program.coordinate_mode is not None
    assert program.coordinate_mode.tolist() == [0, 0]
    assert program.starts() == pytest.approx(np.array([[0, 0, 0, 0, 0], [1, 0, 0, 0, 0]]), abs=1e-12)


def test_directions_are_unit_vectors_with_missing_words_zero() -> None:
    program = read("G43.5 H1\nG1 X1 I3 K4\nX2\nJ-2 K2\nK7\nG0 Y1")
    assert program.axes == (*"XYZACIJK",)
    root = math.sqrt(0.5)
    expected = np.array([[0.6, 0, 0.8], [0.6, 0, 0.8], [0, -root, root], [0, 0, 1], [0, 0, 1]])
    assert program.target[:, 5:] == pytest.approx(expected)
    # A block that only turns the tool has its feed in deg/s.
    assert program.feed.tolist() == [10, 10, 10, 10, math.inf]
    assert read("G20 F60 G43.5 H1\nG1 I3 K4\nX1").feed.tolist() == [1, 25.4]
    assert read("G93 G43.5 H1\nG1 J3 K3 F2").feed.tolist() == pytest.approx([45 * 2 / 60])


def test_arcs_and_splines_can_be_followed_by_the_tip() -> None:
    program = read("G43.4 H1\nG0 X0 Y0 Z0\nG3 X2 I1 A5\nG6.2 P2 K0\nK0 X3 A6\nK1\nK1")
    assert program.arc_centre.tolist() == [[1, 0, 0]]
    assert program.splines is not None
    assert program.splines.control_points.tolist() == [[2, 0, 0, 5, 0], [3, 0, 0, 6, 0]]
    assert read("G43.5 H1\nG0 X0 Y0\nG2 X2 R1").arc_angle == pytest.approx([-math.pi])


def test_words_of_other_machines_have_one_meaning() -> None:
    for machine in (None, "mill", "cylindrical", "corexy"):
        program = read("G0 X1 Y2", machine)
        assert program.coordinate_mode is None
        assert program.tool_length is None
        assert program.change_move.size == 0


def test_letters_home_and_offsets_are_the_tips_where_words_always_are() -> None:
    cylindrical = Machine.load("cylindrical")
    assert cylindrical.program_letters == ("X", "Y", "Z")
    assert Machine.load("trunnion-ac").program_letters == ("X", "Y", "Z", "A", "C")
    with pytest.raises(ProgramError, match="word C moves an axis that the machine does not have"):
        read("G0 C1", cylindrical)
    with pytest.raises(ProgramError, match="word U moves an axis"):
        read("G0 U1", "corexy")
    placed = Machine(
        "placed",
        cylindrical.axes,
        kinematics="cylindrical",
        home=(1.0, 2.0, 3.0),
        offsets=(("G54", (10.0, 20.0, 30.0)),),
    )
    program = read("G0 X0 Y0 Z0\nG28", placed)
    assert program.target.tolist() == [[10, 20, 30], [1, 2, 3]]


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("G43.4 H1\nG28 Z0", "G28 goes to machine positions and G43.4 is in force: cancel it by G49 before"),
        ("G43.4 H1\nG30", "G30 goes to machine positions"),
        ("G43.5 H1\nG53 G0 Z0", "G53 goes to machine positions and G43.5 is in force"),
        ("G43.4 H1 G53 G0 Z0", "G53 goes to machine positions and G43.4 is in force"),
        ("G43.4 H1\nG81 X1 Z-1 R1", "G81 goes along Z and G43.4 is in force"),
        ("G43.5 H1\nG0 A5", "word A5 is an angle and G43.5 takes the tool's direction: give I, J, K"),
        ("G43.5 H1\nG2 X2 I1", "under G43.5 I, J, K are the tool's direction and no centre"),
        ("G43.5 H1\nG5 X1 Y1 I1 J1 P1 Q1", "G5 is not read under G43.5"),
        ("G43.5 H1\nG6.2 P2 K0 X0", "G6.2 is not read under G43.5"),
        ("G43.5 H1\nG1 I0 J0 K0", "I, J, K give the tool no direction"),
        ("G43.5 H1\nG1 K-1", "the tool turns over by 180 degrees"),
        ("G43.5 H1 Q5", "word Q5 has no meaning here"),
        ("G43.4 H1\nG1 X1 I1", "word I1 has no meaning here"),
        ("G43.1 X5\nG43.4", "G43.4 works with a tool length in Z and X has one too"),
        ("G43.4 H1\nG43.2 Z5", "G43.2 adds to a tool length and G43.4 is in force"),
        ("G43.4 G49 X1", "words G43.4 and G49 belong to one modal group"),
        ("G43.5 H1\nG93 G1 I1 K1", "inverse time (G93) has no F of its own"),
        ("F0\nG43.5 H1\nG1 I1 K1", "a feed move has the feed F0"),
    ],
)
def test_what_cannot_be_followed_is_one_sentence(block: str, words: str) -> None:
    with pytest.raises(ProgramError) as caught:
        read(f"G0 X0\n{block}")
    assert words in str(caught.value)
    assert re.match(r"part\.ngc line \d+: [^\n]+$", str(caught.value))


def test_machines_without_rotary_axes_refuse_tips_and_directions() -> None:
    for text in ("G43.4 H1\nG0 X1", "G43.5 H1\nG0 X1"):
        for machine, words in (
            (None, "takes a machine with rotary axes: name the machine, or post joint positions"),
            ("mill", "machine mill has no rotary axes to follow the tool's tip with: remove"),
            ("polar", "machine polar has no rotary axes to follow"),
        ):
            with pytest.raises(ProgramError) as caught:
                read(text, machine)
            assert words in str(caught.value)
    assert read("G43.4 H1\nG0 X1", "rotary-table").coordinate_mode is not None
    with pytest.raises(ProgramError, match="machine rotary-table has no two rotary axes that point the tool"):
        read("G43.5 H1\nG0 X1", "rotary-table")


def test_columns_of_other_meanings_are_left_out_of_the_words() -> None:
    machine = Machine.load("trunnion-ac")
    letters = (*"XYZACIJK",)
    assert axis_words(machine, letters, CoordinateMode.JOINTS).column == (0, 1, 2, 3, 4)
    assert axis_words(machine, letters, CoordinateMode.TIP).column == (0, 1, 2, 3, 4)
    assert axis_words(machine, letters, CoordinateMode.VECTOR).column == (0, 1, 2, 5, 6, 7)
    assert isinstance(machine.inverse, RotaryChain)
    with pytest.raises(MachineError, match="the program uses B"):
        axis_words(machine, (*letters, "B"), CoordinateMode.VECTOR)

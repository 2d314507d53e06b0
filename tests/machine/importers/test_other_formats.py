"""Dumps of grbl and grblHAL, Klipper's printer.cfg and ROS's joint limits become machines."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from feedplan import Machine, MachineError, import_machine
from feedplan.machine.importers import find_machine

GRBL = """Grbl 1.1h ['$' for help]
> $$
$11=0.010
$13=1 (report inches, bool)
$20=1
$22=1
$110=6000.000 (x max rate, mm/min)
$111=6000.000
$112=600.000
$120=250.000
$121=200
$122=50.0
$130=300.000
$131=180.000
$132=45.000
ok
"""

KLIPPER = """
[stepper_x]
position_min: -5   # behind the brush
position_max: 235
[stepper_y]
position_max = 210
[stepper_z]
position_max: 180
[printer]
kinematics: cartesian
max_velocity: 300
Max_Accel: 3000
max_z_velocity: 15
square_corner_velocity: 5.0 ; the usual
[gcode_macro PARK]
gcode:
    G1 X0 F{printer.toolhead.max_accel}
    max_velocity: 7
"""

ROS = """# limits of MoveIt
default_velocity_scaling_factor: 0.1
joint_limits:
  shoulder:
    has_velocity_limits: true
    max_velocity: 3.15     # [rad/s]
    has_acceleration_limits: True
    max_acceleration: 5.0
    has_jerk_limits: false
    max_jerk: 1
  'wrist_1':
    has_position_limits: true
    min_position: !degrees -360.0
    max_position: !degrees 180
    has_velocity_limits: true
    max_velocity: !degrees  90
    has_acceleration_limits: true
    max_acceleration: 8
    has_jerk_limits: true
    max_jerk: 200.0
other:
  shoulder:
    max_velocity: 1.0
"""


def file(text: str, folder: Path, name: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def rows(machine: Machine) -> list[tuple[object, ...]]:
    return [(axis.name, axis.max_velocity, axis.max_acceleration, axis.max_jerk) for axis in machine.axes]


def test_grbl_tells_rates_a_minute(tmp_path: Path) -> None:
    machine = import_machine(file(GRBL, tmp_path, "router.txt"))
    none = math.inf
    assert rows(machine) == [("X", 100, 250, none), ("Y", 100, 200, none), ("Z", 10, 50, none)]
    assert [axis.travel for axis in machine.axes] == [(-300, 0), (-180, 0), (-45, 0)]
    assert machine.name == "router"
    text = find_machine(tmp_path / "router.txt").to_toml()
    assert "# $110 = 6000.000 (x max rate, mm/min), router.txt line 7" in text
    assert "$11 = 0.010, router.txt line 3" in text


def test_controllers_bring_the_parameters_of_their_models(tmp_path: Path) -> None:
    grbl = import_machine(file(GRBL, tmp_path, "router.txt"))
    assert grbl.controller is not None
    assert (grbl.controller.name, grbl.controller.options["deviation"]) == ("grbl", 0.01)
    hal = import_machine(file(GRBL + "\n$12=0.004\n$398=60\n", tmp_path, "hal.txt"))
    parameters = {"junction_deviation": 0.01, "arc_tolerance": 0.004, "planner_blocks": 60}
    assert hal.controller is not None
    assert (hal.controller.name, hal.controller.parameters) == ("grblhal", parameters)
    # A junction deviation of 0 means exact stops, which are no value of this parameter of the model.
    stops = import_machine(file(GRBL + "\n$11=0\n", tmp_path, "stops.txt"))
    assert stops.controller is not None
    assert "junction_deviation" not in stops.controller.parameters
    klipper = import_machine(file(KLIPPER, tmp_path, "printer.cfg"))
    assert klipper.controller is not None
    parameters = {"max_velocity": 300, "max_accel": 3000, "square_corner_velocity": 5.0}
    assert (klipper.controller.name, klipper.controller.parameters) == ("klipper", parameters)


def test_grbl_has_no_travel_without_soft_limits(tmp_path: Path) -> None:
    path = file(GRBL.replace("$20=1", "$20=0"), tmp_path, "router.txt")
    assert import_machine(path).axis("X").travel == (-math.inf, math.inf)
    assert "# travel = [-300.0, 0.0]  # $130 = 300.000" in find_machine(path).to_toml()


def test_grblhal_has_jerk_more_axes_and_zero_at_home(tmp_path: Path) -> None:
    more = "$22=9\n$23=2\n$800=5000\n$801=4000\n$802=900\n$803=8000\n$376=1\n"
    more += "$113=3600\n$123=500\n$114=600\n$124=10\n"
    machine = import_machine(file(GRBL + more, tmp_path, "hal.txt"), {"B.jerk": 70})
    assert rows(machine)[0] == ("X", 100, 250, 5000)
    assert rows(machine)[3:] == [("A", 60, 500, 8000), ("B", 10, 10, 70)]
    assert [(axis.kind, axis.unit) for axis in machine.axes[3:]] == [("rotary", "deg"), ("linear", "mm")]
    assert machine.axis("X").travel == (-300, 0)
    assert machine.axis("Y").travel == (0, 180), "homed at its low end"


def test_the_last_dump_of_a_session_counts(tmp_path: Path) -> None:
    assert rows(import_machine(file(GRBL + "\n$120=400\n", tmp_path, "a.txt")))[0][2] == 400


def test_klipper_has_the_same_limits_for_x_and_y(tmp_path: Path) -> None:
    machine = import_machine(file(KLIPPER, tmp_path, "printer.cfg"))
    none = math.inf
    assert rows(machine) == [("X", 300, 3000, none), ("Y", 300, 3000, none), ("Z", 15, 3000, none)]
    assert [axis.travel for axis in machine.axes] == [(-5, 235), (0, 210), (0, 180)]
    text = find_machine(tmp_path / "printer.cfg").to_toml()
    assert "[printer] max_z_velocity = 15, printer.cfg line 13" in text
    assert "square_corner_velocity = 5.0, printer.cfg line 14" in text
    assert "diagonals may be faster" in text


def test_klippers_corexy_has_motors(tmp_path: Path) -> None:
    path = file(KLIPPER.replace("cartesian", "corexy"), tmp_path, "printer.cfg")
    machine = import_machine(path, {"U.jerk": 90_000, "V.jerk": 90_000, "Z.jerk": 9000})
    assert machine.kinematics == "corexy"
    assert rows(machine) == [("U", 300, 3000, 90_000), ("V", 300, 3000, 90_000), ("Z", 15, 3000, 9000)]
    assert machine.axis("U").travel == (-math.inf, math.inf)
    assert machine.axis("Z").travel == (0, 180)


def test_klipper_includes_files_and_the_last_value_counts(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    file("[printer]\nmax_accel: 1000\n", tmp_path, "parts/b.cfg")
    file("[printer]\nmax_accel: 2000\n", tmp_path, "parts/a.cfg")
    text = f"{KLIPPER}\n[include parts/*.cfg]\n[include gone/*.cfg]\n[include macros.cfg]\n"
    path = file(text, tmp_path, "printer.cfg")
    assert import_machine(path).axis("X").max_acceleration == 1000
    assert any("'macros.cfg' is not there" in note for note in find_machine(path).notes())


def test_ros_has_limits_where_its_flags_say_so(tmp_path: Path) -> None:
    machine = import_machine(file(ROS, tmp_path, "joint_limits.yaml"))
    shoulder, wrist = machine.axes
    assert (shoulder.name, shoulder.unit, shoulder.kind) == ("shoulder", "rad", "rotary")
    assert rows(machine)[0] == ("shoulder", 3.15, 5.0, math.inf)
    assert rows(machine)[1] == pytest.approx(("wrist_1", math.pi / 2, 8.0, 200.0))
    assert wrist.travel == pytest.approx((-2 * math.pi, math.pi))
    assert shoulder.travel == (-math.inf, math.inf)


@pytest.mark.parametrize(
    ("text", "name", "words"),
    [
        (ROS.replace("True", "false"), "a.yaml", "no acceleration of shoulder: give each by --limit"),
        (
            ROS.replace("max_velocity: 3.15", "max_velocity: [3]"),
            "a.yaml",
            "a.yaml line 6: shoulder max_velocity is",
        ),
        (ROS.replace("  'wrist_1':", "  - wrist"), "a.yaml", "a.yaml line 11: '- wrist' is not read"),
        ("joint_limits:\n", "a.yaml", "has no joints below joint_limits"),
        (
            KLIPPER.replace("cartesian", "delta"),
            "p.cfg",
            "p.cfg has 'delta': cartesian and corexy are imported",
        ),
        (KLIPPER.replace("kinematics", "kinetics"), "p.cfg", "names no [printer] kinematics"),
        (KLIPPER.replace("Max_Accel", "accel"), "p.cfg", "no acceleration of X, Y, Z"),
        (KLIPPER + "[include p.cfg]\n", "p.cfg", "p.cfg line 19: p.cfg includes itself: take this line out"),
        ("$11=0.01\n", "g.txt", "g.txt has no $110 to $138"),
        (GRBL.replace("$120=250.000", "$120=a"), "g.txt", "g.txt line 10: $120 is 'a': give a number"),
        (GRBL.replace("$22=1", "$22=-1"), "g.txt", "g.txt line 6: $22 is -1: give a whole number"),
        (GRBL.replace("$20=1", "$20=-1"), "g.txt", "g.txt line 5: $20 is -1: give a whole number"),
        (
            "G21\nG1 X1 F100\n",
            "g.txt",
            "g.txt is no file of a machine that is known: give LinuxCNC's INI file",
        ),
        ("", "g.txt", "is no file of a machine"),
        ("[printer]\0", "g.txt", "g.txt is binary"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(text: str, name: str, words: str, tmp_path: Path) -> None:
    path = file(text, tmp_path, name)
    with pytest.raises(MachineError) as caught:
        import_machine(path)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"Q.jerk": 1}, "there is no limit 'Q.jerk': give one such as X.jerk, of the axes X, Y, Z"),
        ({"X.speed": 1}, "and the limits velocity, acceleration, jerk"),
        ({"X": 1}, "there is no limit 'X'"),
        ({"X.jerk": 0}, "the limit X.jerk is 0: give a number > 0 [mm/s³]"),
        ({"X.jerk": math.nan}, "give a number > 0"),
        ({"X.jerk": "5"}, "the limit X.jerk is '5'"),
        ({"X.velocity": 1e12}, "axis X: max_velocity is 1"),
        ([("X.jerk", 1)], "limits is [('X.jerk', 1)]: give a dictionary"),
    ],
)
def test_limits_that_cannot_be_given(limits: object, words: str, tmp_path: Path) -> None:
    path = file(GRBL, tmp_path, "g.txt")
    with pytest.raises(MachineError) as caught:
        import_machine(path, limits)  # type: ignore[arg-type]
    assert words in str(caught.value)


def test_limits_are_given_in_place_of_the_files(tmp_path: Path) -> None:
    path = file(GRBL, tmp_path, "g.txt")
    machine = import_machine(path, {"x.max_velocity": 80, "Z.jerk": 300}, name="mine")
    assert (machine.name, rows(machine)[0][1], rows(machine)[2][3]) == ("mine", 80, 300)
    text = find_machine(path, {"X.velocity": 80}).to_toml()
    assert "# given in place of 100.0 of $110 = 6000.000" in text


@pytest.mark.parametrize("given", [3, None, "no/such/file.ini", ".", "a\0b"])
def test_no_file_is_one_sentence(given: object) -> None:
    with pytest.raises(MachineError):
        import_machine(given)  # type: ignore[arg-type]


def test_comments_of_a_machine_file_are_one_line_whatever_the_source_is(tmp_path: Path) -> None:
    text = GRBL.replace("mm/min)", "\x1b[31m\u2028\x85max_jerk = 1\x0b " + "w" * 500)
    found = find_machine(file(text, tmp_path, "g.txt"))
    assert import_machine(tmp_path / "g.txt").axis("X").max_jerk == math.inf
    assert all(letter.isprintable() or letter == "\n" for letter in found.to_toml())
    assert max(map(len, found.to_toml().splitlines())) < 250

"""INI files of LinuxCNC become machines: units, includes, gantries, agreement with LinuxCNC's reader."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import pytest

from feedplan import FeedplanError, Machine, MachineError, import_machine
from feedplan.machine.importers import find_machine
from feedplan.machine.importers.linuxcnc import Ini
from feedplan.machine.importers.text_files import TextFiles

SAMPLES = Path("/usr/share/doc/linuxcnc/examples/sample-configs")
NONE = "LinuxCNC is not installed (Debian's linuxcnc-uspace): its sample configurations are not read"

MILL = """# a mill in inches
[EMC]
MACHINE = Small Mill
[EMCMOT]
SERVO_PERIOD = 500000
[KINS]
KINEMATICS = trivkins coordinates=XYYZA kinstype=both
JOINTS = 5
[TRAJ]
COORDINATES = X Y Y Z A
LINEAR_UNITS = inch
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = 0.1
MAX_LINEAR_VELOCITY = 4
[AXIS_X]
MAX_VELOCITY = 5
MAX_ACCELERATION = 20 # of the table
MIN_LIMIT = -1.0
MAX_LIMIT = 10
[JOINT_0]
MAX_VELOCITY = 3.0
MAX_ACCELERATION = 30.0
MAX_LIMIT = 9.5
[AXIS_Y]
MAX_VELOCITY = 2
MAX_ACCELERATION = 10
[JOINT_1]
MAX_VELOCITY = 2
MAX_ACCELERATION = 10
[JOINT_2]
MAX_VELOCITY = 2
MAX_ACCELERATION = 8
[AXIS_Z]
MAX_VELOCITY = 1
MAX_ACCELERATION = 5
MAX_JERK = 100
[AXIS_A]
MAX_VELOCITY = 60
MAX_ACCELERATION = 400
"""


def ini(text: str, folder: Path, name: str = "mill.ini") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def limits(machine: Machine) -> dict[str, tuple[object, ...]]:
    return {axis.name: (axis.max_velocity, axis.max_acceleration, axis.max_jerk) for axis in machine.axes}


def test_a_setting_that_a_later_one_contradicts_is_told(tmp_path: Path) -> None:
    """LinuxCNC uses the first of two values too, but people tend to look at the last."""
    again = "[JOINT_0]\nMAX_VELOCITY = 300.0\nMAX_LIMIT = 9.5\n[DISPLAY]\nCYCLE = 1\nCYCLE = 2\n"
    found = find_machine(ini(MILL + again, tmp_path))
    assert found.warnings == (
        "mill.ini line 41: '300.0' of [JOINT_0] MAX_VELOCITY is left out: the first counts, "
        "'3.0' of mill.ini line 21",
    )
    assert find_machine(ini(MILL, tmp_path)).warnings == ()


def test_inches_and_the_least_of_axis_joints_and_path(tmp_path: Path) -> None:
    machine = import_machine(ini(MILL, tmp_path))
    assert machine.name == "Small Mill"
    assert machine.period == 0.0005
    own = limits(machine)
    assert own["X"] == pytest.approx((3 * 25.4, 20 * 25.4, math.inf))
    assert own["Y"] == pytest.approx((2 * 25.4, 8 * 25.4, math.inf)), "two joints move Y"
    assert own["Z"] == pytest.approx((25.4, 5 * 25.4, 100 * 25.4))
    assert own["A"] == (60.0, 400.0, math.inf), "degrees are no inches"
    assert machine.axis("X").travel == pytest.approx((-25.4, 9.5 * 25.4))
    assert machine.axis("Y").travel == (-math.inf, math.inf)


def test_each_number_has_its_source_and_the_text_loads_as_the_machine(tmp_path: Path) -> None:
    found = find_machine(ini(MILL, tmp_path), {"X.jerk": 5000})
    text = found.to_toml()
    assert "max_velocity = 76.2            # [JOINT_0] MAX_VELOCITY = 3.0, mill.ini line 21\n" in text
    assert "max_jerk = 5000.0              # given\n" in text
    assert "# max_jerk = ...  # [deg/s³], the file has none\n" in text
    assert "MAX_LINEAR_VELOCITY: along the path there" in text
    file = ini(text, tmp_path, "machine.toml")
    assert Machine.load(file) == import_machine(tmp_path / "mill.ini", {"X.jerk": 5000})
    [note] = found.notes()
    assert "no jerk of Y, A: jerk-limited" in note


def test_the_model_of_the_controller_has_the_limits_along_the_path(tmp_path: Path) -> None:
    more = "[TRAJ]\nMAX_ACCELERATION = 30\nARC_BLEND_OPTIMIZATION_DEPTH = 20\n"
    found = find_machine(ini(MILL.replace("[TRAJ]\n", more), tmp_path))
    assert {key: own.value for key, own in found.parameters.items()} == {
        "max_linear_velocity": pytest.approx(4 * 25.4),
        "max_linear_acceleration": pytest.approx(30 * 25.4),
        "arc_blend_optimization_depth": 20,
    }
    table = found.to_toml().split("[controller]")[1].split("[[axes]]")[0]
    assert "max_linear_velocity = 101.6 " in table
    assert "# [TRAJ] MAX_LINEAR_VELOCITY = 4, mill.ini line 16" in table
    assert "arc_blend_optimization_depth = 20.0 " in table
    assert Machine.load(ini(found.to_toml(), tmp_path, "machine.toml")).controller is not None
    assert not find_machine(ini(MILL.replace("trivkins", "corexykins"), tmp_path)).parameters


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("mm", 1.0), ("METRIC", 1.0), ("in", 25.4), ("imperial", 25.4), ("1.0", 1.0), ("0.1", 10.0)],
)
def test_linear_units(unit: str, factor: float, tmp_path: Path) -> None:
    machine = import_machine(ini(MILL.replace("= inch", f"= {unit}"), tmp_path))
    assert machine.axis("Z").max_velocity == pytest.approx(factor)
    assert machine.axis("A").max_velocity == 60.0


@pytest.mark.parametrize(("unit", "degrees"), [("deg", 1.0), ("rad", 180 / math.pi), ("gon", 0.9)])
def test_angular_units(unit: str, degrees: float, tmp_path: Path) -> None:
    machine = import_machine(ini(MILL.replace("= degree", f"= {unit}"), tmp_path))
    assert machine.axis("A").max_velocity == pytest.approx(60.0 * degrees)


def test_syntax_is_as_lenient_as_linuxcncs(tmp_path: Path) -> None:
    text = """
  ; a comment
[TRAJ] # what follows is passed over
LINEAR_UNITS=mm
COORDINATES = x z
a line that is no setting
[KINS]
KINEMATICS = trivkins \\
  coordinates=xz
[JOINT_0]
MAX_VELOCITY = .5e2
MAX_VELOCITY = 70
MAX_ACCELERATION = 500
[JOINT_1]
\tMAX_VELOCITY = 25
  MAX_ACCELERATION=250   \r
"""
    machine = import_machine(ini(text, tmp_path))
    assert limits(machine) == {"X": (50.0, 500.0, math.inf), "Z": (25.0, 250.0, math.inf)}


def test_joints_were_called_axes_before_2_8(tmp_path: Path) -> None:
    text = "[TRAJ]\nAXES = 2\nCOORDINATES = X Y\nLINEAR_UNITS = 0.03937007874016\nMAX_VELOCITY = 1.2\n"
    text += "".join(f"[AXIS_{k}]\nMAX_VELOCITY = {k + 1}\nMAX_ACCELERATION = 20\n" for k in range(2))
    found = find_machine(ini(text, tmp_path))
    assert [axis.limits["velocity"].value for axis in found.axes] == pytest.approx([25.4, 1.2 * 25.4])
    assert "has no [KINS] KINEMATICS" in found.notes()[0]


def test_files_include_others(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    ini("#INCLUDE y.inc\n[AXIS_X]\nMAX_VELOCITY = 1\nMAX_ACCELERATION = 1\n", tmp_path, "below/x.inc")
    ini("[AXIS_Y]\nMAX_VELOCITY = 2\nMAX_ACCELERATION = 2\n", tmp_path, "below/y.inc")
    text = "[TRAJ]\nCOORDINATES = XY\nLINEAR_UNITS = mm\n#INCLUDE below/x.inc\n#INCLUDE gone.inc\n"
    found = find_machine(ini(text, tmp_path))
    assert [axis.limits["velocity"].value for axis in found.axes] == [1.0, 2.0]
    assert "y.inc line 2" in found.to_toml()
    assert any("'gone.inc' is not there" in note for note in found.notes())


def test_a_part_of_the_velocity_may_be_kept_for_offsets(tmp_path: Path) -> None:
    text = MILL.replace("[AXIS_Z]\n", "[AXIS_Z]\nOFFSET_AV_RATIO = 0.25\n")
    assert limits(import_machine(ini(text, tmp_path)))["Z"] == pytest.approx((19.05, 95.25, 2540.0))


def test_corexy_motors_keep_the_limits_of_x_and_y(tmp_path: Path) -> None:
    text = MILL.replace("trivkins coordinates=XYYZA kinstype=both", "corexykins")
    machine = import_machine(ini(text, tmp_path))
    assert machine.kinematics == "corexy"
    assert machine.axis_names == ("U", "V", "Z", "A")
    assert machine.axis("U").max_velocity == machine.axis("V").max_velocity == pytest.approx(2 * 25.4)
    assert machine.axis("U").travel == (-math.inf, math.inf)


@pytest.mark.parametrize(("jerk", "expected"), [("1000", 25400.0), ("1e9", math.inf), ("0", 0.0)])
def test_the_jerk_of_the_path_is_one_of_each_axis(jerk: str, expected: float, tmp_path: Path) -> None:
    text = MILL.replace("MAX_LINEAR_VELOCITY = 4", f"MAX_LINEAR_JERK = {jerk}")
    found = limits(import_machine(ini(text, tmp_path)))
    assert found["X"][2] == pytest.approx(expected or math.inf)
    assert found["A"][2] == math.inf


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("MAX_VELOCITY = 5\n", "MAX_VELOCITY = fast\n", "mill.ini line 16: [AXIS_X] MAX_VELOCITY is 'fast'"),
        ("MAX_VELOCITY = 5\n", "MAX_VELOCITY = 5,5\n", "give a number"),
        ("trivkins", "genhexkins", "'genhexkins'"),
        ("trivkins", "xyzac-trt-kins", "--like trunnion-ac"),
        ("LINEAR_UNITS = inch\n", "", "has no [TRAJ] LINEAR_UNITS: add it there, as LINEAR_UNITS = mm"),
        ("LINEAR_UNITS = inch", "LINEAR_UNITS = furlong", "mill.ini line 11: LINEAR_UNITS is 'furlong'"),
        ("LINEAR_UNITS = inch", "LINEAR_UNITS = 0", "give mm or inch"),
        ("ANGULAR_UNITS = degree\n", "", "has no [TRAJ] ANGULAR_UNITS"),
        ("MAX_LIMIT = 10", "MAX_LIMIT = -3", "axis X: travel is [-25.4, -76.2]"),
        ("MAX_VELOCITY = 60", "MAX_VELOCITY = -60", "axis A: max_velocity is -60.0"),
        (
            "MAX_VELOCITY = 60",
            "MAX_VELOCITY = 1e99",
            "no velocity of A: give each by --limit, as --limit A.vel",
        ),
        ("[AXIS_A]", "[AXIS_B]", "no velocity or acceleration of A"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(old: str, new: str, words: str, tmp_path: Path) -> None:
    assert old in MILL
    file = ini(MILL.replace(old, new), tmp_path)
    with pytest.raises(MachineError) as caught:
        import_machine(file)
    assert words in str(caught.value)


@pytest.mark.skipif(not SAMPLES.is_dir(), reason=NONE)
def test_linuxcncs_own_samples_are_imported_or_refused_by_name() -> None:
    imported, refused = 0, []
    for file in sorted(SAMPLES.rglob("*.ini")):
        try:
            machine = import_machine(file)
        except FeedplanError as error:
            refused.append(str(error))
            continue
        imported += 1
        assert all(0 < axis.velocity_range[1] < 1e6 for axis in machine.axes)
    known = ("the kinematics is", "has no", "travel is [0.0, 0.0]", "is no file of a machine")
    assert [sentence for sentence in refused if not any(words in sentence for words in known)] == []
    assert imported > 8 * len(refused)


@pytest.mark.skipif(not SAMPLES.is_dir() or not shutil.which("inivar"), reason=NONE)
def test_settings_are_what_linuxcncs_own_reader_reads() -> None:
    files = [
        file
        for file in sorted(SAMPLES.rglob("*.ini"))
        if "#INCLUDE" not in file.read_text("utf-8", "replace")
    ]
    for file in files[::40]:
        own = Ini(file, TextFiles(file))
        for section in ("TRAJ", "KINS", "EMCMOT", "AXIS_X", "JOINT_1"):
            for key in ("COORDINATES", "KINEMATICS", "SERVO_PERIOD", "MAX_VELOCITY", "MAX_LINEAR_VELOCITY"):
                command = ["inivar", "-ini", str(file), "-sec", section, "-var", key]
                told = subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
                setting = own.get(section, key)
                assert (setting.text if setting else "") == told, (file.name, section, key)

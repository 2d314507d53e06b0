"""Machine files: the bundled ones load, wrong ones are refused in one sentence."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feedplan import Machine, MachineError, plan
from feedplan.machine.axis import Axis
from feedplan.machine.machine import bundled_machines

GOOD = """
name = "one"
period = 0.002
chord_tolerance = 0.01
[[axes]]
name = "X"
max_velocity = 100.0
max_acceleration = 1000.0
travel = [-10.0, 300.0]
max_velocity_jump = 2.0
"""


def load(text: str, folder: Path) -> Machine:
    file = folder / "machine.toml"
    file.write_text(text, "utf-8")
    return Machine.load(file)


def test_a_byte_order_mark_before_a_machine_file_is_left_out(tmp_path: Path) -> None:
    assert load("\ufeff" + GOOD, tmp_path) == load(GOOD, tmp_path)
    with pytest.raises(MachineError, match="name is 5: give a text"):
        load(GOOD.replace('"one"', "5"), tmp_path)


def test_tarus_has_the_limits_of_the_thesis() -> None:
    machine = Machine.load("tarus")
    rows = [(a.name, a.max_velocity, a.max_acceleration, a.max_jerk) for a in machine.axes]
    assert rows == [("X", 170, 400, 4000), ("Y", 180, 600, 6000), ("Z", 240, 2000, 20000)]
    assert machine.chord_tolerance == 0.0254


@pytest.mark.parametrize("name", bundled_machines())
def test_every_bundled_machine_loads_under_its_name(name: str) -> None:
    assert Machine.load(name).name == name


def test_a_file_gives_every_field(tmp_path: Path) -> None:
    machine = load(GOOD, tmp_path)
    axis = machine.axis("X")
    assert (machine.period, machine.chord_tolerance) == (0.002, 0.01)
    assert (axis.travel, axis.max_velocity_jump) == ((-10.0, 300.0), 2.0)
    assert machine.with_period(0.004).period == 0.004


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("max_velocity = 100.0", "", "max_velocity"),
        ("max_velocity = 100.0", "max_velocity = -1", "max_velocity"),
        ("max_velocity = 100.0", "max_velocity = inf", "max_velocity"),
        ("max_velocity = 100.0", "max_velocity = nan", "max_velocity"),
        ("max_velocity = 100.0", 'max_velocity = "fast"', "max_velocity"),
        ("max_velocity = 100.0", "max_velocity = true", "max_velocity"),
        ("period = 0.002", "period = 0", "period"),
        ('name = "X"', 'name = "Q "', "axis name"),
        ("travel = [-10.0, 300.0]", "travel = [10.0, -300.0]", "travel"),
        ("travel = [-10.0, 300.0]", "travel = [10.0]", "travel"),
        ("max_velocity_jump = 2.0", "max_velocity_jump = -2.0", "max_velocity_jump"),
        ("max_velocity_jump = 2.0", "max_velocitty = 2.0", "max_velocitty"),
        ("chord_tolerance = 0.01", "speed = 1", "speed"),
        ("[[axes]]", "[axes]", "axes"),
        ("period = 0.002", "period = ", "TOML"),
        ('name = "one"', 'name = "one"\nkinematics = "delta"', "kinematics"),
        ('name = "one"', 'name = "one"\noffsets = {G54 = [1.0, 2.0]}', "G54"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, word: str, tmp_path: Path) -> None:
    with pytest.raises(MachineError, match=word) as caught:
        load(GOOD.replace(old, new), tmp_path)
    assert "machine.toml" in str(caught.value)
    assert "\n" not in str(caught.value) or word == "TOML"


GANTRY = """
kinematics = {type = "cartesian", map = {U = "X"}}
home = [1.0, 2.0, 3.0]
offsets = {G54 = [4.0, 5.0, 6.0]}
""" + "".join(f"[[axes]]\nname = '{name}'\nmax_velocity = 1.0\nmax_acceleration = 1.0\n" for name in "XUYZ")


def test_home_and_offsets_are_in_the_letters_of_a_program(tmp_path: Path) -> None:
    gantry = load(GANTRY, tmp_path)
    assert gantry.axis_names == ("X", "U", "Y", "Z")
    assert gantry.program_letters == ("X", "Y", "Z")
    assert gantry.home == (1, 2, 3)
    assert gantry.offsets == (("G54", (4, 5, 6)),)
    assert load(GANTRY.replace("home", "# home"), tmp_path).home == ()
    for key in ("home", "G54"):
        wrong = GANTRY.replace(f"{key} = [", f"{key} = [0.0, ")
        with pytest.raises(
            MachineError, match=f"{key} is .*: give 3 finite numbers, for the program's axes X, Y, Z"
        ):
            load(wrong, tmp_path)


def test_unknown_names_and_files_say_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match="tarus"):
        Machine.load("nobody")
    with pytest.raises(MachineError, match="cannot be read"):
        Machine.load(tmp_path / "none.toml")
    with pytest.raises(MachineError, match="no axis W"):
        Machine.load("mill").axis("W")


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    travel = np.array([-5, 50])
    axes = [Axis(name, np.int64(100), 1000, max_jerk=20000, travel=travel) for name in "XYZ"]
    machine = Machine("own", axes, period=1, home=np.array([1, 2, 3]), offsets={"G54": [4, 5, 6]})
    assert machine.offsets == (("G54", (4.0, 5.0, 6.0)),)
    values = (axes[0].max_velocity, axes[0].travel[0], machine.period, machine.home[0])
    assert all(type(value) is float for value in values)
    program = tmp_path / "own.ngc"
    program.write_text("G1 F600 X5\nY3\n")
    assert plan(program, replace(machine, period=0.001)).audit().ok


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"max_velocity": 0}, "axis X: max_velocity is 0: give a number from 1e-05 to 1e\\+09 \\[mm/s\\]"),
        ({"max_velocity": "fast"}, "max_velocity is 'fast'"),
        ({"max_acceleration": math.inf}, "max_acceleration is inf"),
        ({"max_jerk": math.nan}, "max_jerk is nan"),
        ({"travel": (1.0, -1.0)}, "travel"),
        ({"travel": 3}, "travel"),
        ({"travel": (math.nan, 1.0)}, "travel"),
        ({"name": "X Y"}, "axis name is 'X Y'"),
        ({"name": 3}, "axis name is 3"),
        ({"kind": "round"}, "kind"),
    ],
)
def test_wrong_limits_are_refused_where_they_are_given(fields: dict[str, Any], word: str) -> None:
    with pytest.raises(MachineError, match=word):
        Axis(**{"name": "X", "max_velocity": 1.0, "max_acceleration": 1.0, **fields})


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"axes": ()}, "1 to 9 axes"),
        ({"axes": "XYZ"}, "axis 1 is 'X': give an Axis"),
        ({"axes": 2 * (Axis("X", 1, 1),)}, "axis X comes twice: give each axis another name"),
        ({"period": -1}, "period is -1: give a number from 1e-06 to 10 \\[s\\]"),
        ({"axes": Axis("X", 1, 1)}, "1 to 9 axes"),
        ({"home": (math.inf,)}, "home is .*: give 1 finite numbers"),
        ({"home": 2}, "home is 2: give 1 finite numbers"),
        ({"offsets": 3}, "offsets is 3"),
        ({"offsets": ("G54",)}, "offsets is"),
        ({"offsets": (("G54", 3),)}, "G54 is 3: give 1 finite numbers"),
        ({"home": (1, 2)}, "home is .*: give 1 finite numbers, for the program's axes X"),
        ({"kinematics": "delta"}, "delta"),
    ],
)
def test_a_wrong_machine_is_refused_where_it_is_made(fields: dict[str, Any], word: str) -> None:
    with pytest.raises(MachineError, match=word):
        Machine(**{"name": "own", "axes": (Axis("X", 1, 1),), **fields})


# v, a, j of one axis and the period, in any unit of length.
REASONABLE = {
    "mill": (200.0, 2000.0, 40_000.0, 1e-3),
    "mill in metres": (0.2, 2.0, 40.0, 1e-3),
    "mill in micrometres": (2e5, 2e6, 4e7, 1e-3),
    "controller of 24 ms": (200.0, 2000.0, 40_000.0, 0.024),
    "jerk as good as unlimited": (200.0, 2000.0, 1e8, 1e-3),
    "linear motor": (5000.0, 50_000.0, 1e7, 5e-5),
    "micrometre stage": (1.0, 10.0, 1000.0, 1e-4),
    "micrometre stage in metres": (1e-3, 1e-2, 1.0, 1e-4),
    "huge gantry": (500.0, 50.0, 50.0, 0.01),
    "slow gantry in metres": (0.5, 0.02, 0.02, 0.05),
    "joint in radians": (2.0, 8.0, 100.0, 4e-3),
    "rotary table in degrees": (0.1, 0.05, 0.1, 1e-3),
    "rotary table in radians": (2e-3, 1e-3, 2e-3, 1e-3),
    "galvanometer in radians": (1000.0, 1e7, 1e11, 1e-5),
    "telescope in degrees": (4.0, 0.05, 0.01, 0.01),
    "log of one row a second": (200.0, 2000.0, 40_000.0, 1.0),
}


@pytest.mark.parametrize("name", REASONABLE)
def test_reasonable_machines_are_in_the_ranges(name: str) -> None:
    *limits, period = REASONABLE[name]
    machine = Machine(name, (Axis("X", *limits), Axis("Y", *limits)), period=period)
    assert machine.period == period


def test_axes_of_very_different_speeds_are_refused() -> None:
    with pytest.raises(
        MachineError, match=r"axis Y: max_velocity is 0.0001: give 0.001 mm/s or more, beside 100000"
    ):
        Machine("own", (Axis("X", 1e5, 1e6), Axis("Y", 1e-4, 1e-3)))

"""Kinematics in machine files: every type builds, users can add types, and errors are one sentence."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from feedplan import Axis, Machine, MachineError
from feedplan.machine import kinematics as registry
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.machine import bundled_machines
from feedplan.machine.numbers import Number, sqrt
from feedplan.machine.parameters import Parameters


class Bipod(Kinematics):
    """A plotter on two strings from feet at x = 0 and x = `span`."""

    tip_names = ("X", "Y")
    joint_names = ("U", "V")

    def __init__(self, span: float) -> None:
        self.span = span

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        x, y = tip
        return sqrt(x * x + y * y), sqrt((x - self.span) ** 2 + y * y)


@pytest.fixture
def bipod() -> Iterator[None]:
    def build(axes: tuple[Axis, ...], parameters: Parameters) -> Bipod:
        return Bipod(parameters.number("span"))

    registry.register("bipod", build)
    yield
    del registry._registered["bipod"]


def load(folder: Path, axes: str, kinematics: str) -> Machine:
    file = folder / "machine.toml"
    rows = "".join(f'[[axes]]\nname = "{a}"\nmax_velocity = 1.0\nmax_acceleration = 1.0\n' for a in axes)
    file.write_text(f"{kinematics}\n{rows}")
    return Machine.load(file)


def test_there_is_a_bundled_machine_of_every_type() -> None:
    assert {Machine.load(name).kinematics for name in bundled_machines()} == set(registry.types())


@pytest.mark.parametrize("name", bundled_machines())
def test_a_bundled_machine_s_joints_are_its_axes(name: str) -> None:
    machine = Machine.load(name)
    assert machine.inverse.joint_names == machine.axis_names
    assert [axis.unit for axis in machine.axes] == ["deg" if r else "mm" for r in machine.inverse.rotary]


def test_a_string_or_a_table_names_the_type(tmp_path: Path) -> None:
    assert load(tmp_path, "XYZ", 'kinematics = "cartesian"').is_plain
    machine = load(tmp_path, "XYZAC", '[kinematics]\ntype = "trunnion-ac"\ntool_length = 80.0')
    assert machine.kinematics == "trunnion-ac"
    assert machine.parameters == {"tool_length": 80.0}
    assert not machine.is_plain
    assert machine.inverse.joints((0.0, 0.0, 0.0, 0.0, 0.0))[2] == 80.0
    assert load(tmp_path, "CXZ", 'kinematics = "cylindrical"').inverse.tip_names == ("X", "Y", "Z")


@pytest.mark.usefixtures("bipod")
def test_a_user_s_kinematics_is_known_by_its_name(tmp_path: Path) -> None:
    machine = load(tmp_path, "UV", '[kinematics]\ntype = "bipod"\nspan = 700.0')
    assert "bipod" in registry.types()
    assert machine.inverse.joints((300.0, 400.0)) == pytest.approx((500, 565.685425))
    with pytest.raises(MachineError, match=r"span is 'missing': give a finite number \[mm\]"):
        load(tmp_path, "UV", 'kinematics = "bipod"')
    with pytest.raises(MachineError, match=r"no tip\(joints\)"):
        machine.inverse.tip((1.0, 2.0))


def test_a_factory_makes_a_kinematics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registered", {})
    registry.register("forgotten", lambda axes, parameters: None)  # type: ignore[arg-type, return-value]
    with pytest.raises(MachineError, match="the factory of 'forgotten' is None: give a Kinematics"):
        Machine("m", (Axis("X", 1.0, 10.0),), kinematics="forgotten")


def test_bundled_names_are_taken() -> None:
    with pytest.raises(MachineError, match="register yours under another name"):
        registry.register("corexy", lambda axes, parameters: Bipod(1.0))


@pytest.mark.parametrize(
    ("axes", "kinematics", "words"),
    [
        ("XYZ", 'kinematics = "delta"', "'delta': give one of cartesian, corexy, .*register"),
        ("XYZ", "kinematics = 3", "a name, or a table"),
        ("XYZ", "[kinematics]\nmap = {}", "a name, or a table"),
        ("XYZ", 'kinematics = "trunnion-ac"', "axes are X, Y, Z: this kinematics needs X, Y, Z, A, C"),
        ("XYZBC", 'kinematics = "trunnion-ac"', "needs X, Y, Z, A, C in that order"),
        (
            "XYZAC",
            '[kinematics]\ntype = "trunnion-ac"\ntool_lenght = 3',
            "tool_lenght.*give only .*tool_length",
        ),
        ("XYZAC", '[kinematics]\ntype = "trunnion-ac"\ntool_length = "long"', "tool_length is 'long'"),
        ("XYZAC", '[kinematics]\ntype = "trunnion-ac"\npivot_a = [1, 2]', r"pivot_a is \[1, 2\]: give three"),
        ("XYZAC", '[kinematics]\ntype = "trunnion-ac"\nreversed = ["B"]', "reversed.*letters A, C"),
        ("XYZBC", '[kinematics]\ntype = "head-table"\nhead = "C"', "head is 'C': give one of A, B"),
        ("XYZBC", '[kinematics]\ntype = "head-table"\ntable = "B"', "cannot tilt the tool every way"),
        ("XZC", 'kinematics = "cylindrical"', "axis X is linear, but this kinematics needs it rotary"),
        ("CX", 'kinematics = "cylindrical"', "axes are C, X: this kinematics needs C, X, Z"),
        ("XZC", '[kinematics]\ntype = "polar"\nside = "left"', "side is 'left': give one of plus, minus"),
        ("ABZ", 'kinematics = "corexy"', "axis A is rotary, but this kinematics needs it linear"),
        ("XYZ", 'kinematics = "corexy"', "other letters than X and Y"),
        (
            "XYZ",
            '[kinematics]\ntype = "cartesian"\nscale = {X = 0}',
            "scale is 0: give a number other than 0",
        ),
        ("XYZ", '[kinematics]\ntype = "cartesian"\nscale = {U = 1}', "scale is 'U': give one of the joints"),
        ("XYZ", '[kinematics]\ntype = "cartesian"\nmap = {X = "Q"}', "map is 'Q': give one of the letters"),
        ("XYZ", '[kinematics]\ntype = "cartesian"\nmap = {X = "A"}', "the linear joint X follows A"),
        ("XYZ", '[kinematics]\ntype = "cartesian"\nmap = 3', "map is 3: give a table"),
    ],
)
def test_what_is_wrong_is_one_sentence(axes: str, kinematics: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(MachineError, match=words) as caught:
        load(tmp_path, axes, kinematics)
    assert "machine.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_limits_of_rotary_axes_are_in_degrees(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    file.write_text('[[axes]]\nname = "A"\nmax_velocity = 0\nmax_acceleration = 1.0\n')
    with pytest.raises(MachineError, match=r"axis A: max_velocity is 0: give .* \[deg/s\]"):
        Machine.load(file)
    file.write_text('[[axes]]\nname = "A"\nkind = "linear"\nmax_velocity = 1\nmax_acceleration = 0\n')
    with pytest.raises(MachineError, match=r"\[mm/s²\]"):
        Machine.load(file)
    file.write_text('[[axes]]\nname = "A"\nkind = "turning"\nmax_velocity = 1\nmax_acceleration = 1\n')
    with pytest.raises(MachineError, match='kind is \'turning\': give "linear" or "rotary"'):
        Machine.load(file)


def test_importing_feedplan_loads_no_kinematics() -> None:
    code = (
        "import feedplan, sys; print([m for m in sys.modules if 'kinematics' in m or 'machine.numbers' in m])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"

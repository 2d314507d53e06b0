"""`feedplan.check` of a plan's folder, unchanged and after changes of its files."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feedplan import Axis, Machine, plan, planners
from feedplan.checking import check
from feedplan.cli import main
from feedplan.errors import InputError
from feedplan.machine.kinematics import Kinematics, _registered, register
from feedplan.plan_folder import write_plan
from tests.outputs.parquet import FORMATS
from tests.sentences import assert_one_sentence

PROGRAM = "G21 G90 G64 P0.05\nF3000\nG1 X20 Y5\nG3 X10 Y15 I-5 J5\nG1 X0 Y10\nG1 Y0\nM2\n"

OWN = """
name = "mill"
period = 0.002
[[axes]]
name = "X"
max_velocity = 60.0
max_acceleration = 500.0
max_jerk = 20000.0
[[axes]]
name = "Y"
max_velocity = 60.0
max_acceleration = 400.0
max_jerk = 20000.0
[[axes]]
name = "Z"
max_velocity = 30.0
max_acceleration = 300.0
max_jerk = 20000.0
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of plans by two methods; their program and machine file are removed afterwards."""
    home = tmp_path_factory.mktemp("made")
    program, machine = home / "part.ngc", home / "own.toml"
    program.write_text(PROGRAM)
    machine.write_text(OWN)
    for method in ("bang-bang", "jerk-limited"):
        options = ["-m", str(machine), "--method", method, "-o", str(home / method), "-q"]
        assert main(["plan", str(program), *options]) == 0
    program.unlink()
    machine.unlink()
    return home


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Callable[[str], Path]:
    """A copy of one of the folders."""
    return lambda method: shutil.copytree(made / method, tmp_path / method)


def test_a_folder_holds_its_machine_whatever_its_name(folder: Any, capsys: Any) -> None:
    out = folder("bang-bang")
    assert main(["check", str(out), "--json"]) == 0
    audit = json.loads(capsys.readouterr().out)
    # The bundled machine of that name has 3000 mm/s².
    assert audit["acceleration"]["X"]["limit"] == 500.0
    assert audit["acceleration"]["X"]["ratio"] == pytest.approx(1.0, abs=1e-6)


def test_plan_json_has_program_machine_and_options(made: Path) -> None:
    summary = json.loads((made / "bang-bang" / "plan.json").read_text())
    assert summary["format"] == 1
    assert summary["units"] == {"length": "mm", "angle": "deg", "time": "s"}
    assert (summary["machine"], summary["method"], summary["program"]) == ("mill", "bang-bang", "part.ngc")
    assert summary["program_sha256"] == hashlib.sha256(PROGRAM.encode()).hexdigest()
    assert summary["options"]["feed_override"] == 1.0
    with np.load(made / "bang-bang" / "setpoints.npz") as arrays:
        count, last = len(arrays["t"]), arrays["t"][-1]
        assert (arrays["format"], arrays["period"], list(arrays["units"])) == (1, 0.002, ["mm"] * 3)
    assert summary["setpoints"] == {
        "axes": ["X", "Y", "Z"],
        "units": ["mm", "mm", "mm"],
        "period": 0.002,
        "count": count,
        "duration": last,
    }


def zeros(arrays: Any) -> None:
    arrays["acceleration"][:] = 0.0


def one_axis_of_zeros(arrays: Any) -> None:
    arrays["acceleration"][:, 1] = 0.0


def zeros_for_a_while(arrays: Any) -> None:
    fast = np.abs(arrays["acceleration"]).max(axis=1) > 350.0
    start = next(i for i in range(len(fast)) if fast[i : i + 20].all())
    arrays["acceleration"][start : start + 20] = 0.0


def opposite(arrays: Any) -> None:
    arrays["acceleration"] *= -1.0


def in_metres(arrays: Any) -> None:
    arrays["acceleration"] *= 1e-3


def no_jerk(arrays: Any) -> None:
    arrays["jerk"][:] = 0.0


def stretched(arrays: Any) -> None:
    arrays["t"] *= 1e300


def not_a_number(arrays: Any) -> None:
    arrays["position"][7, 1] = np.nan


def no_time(arrays: Any) -> None:
    arrays["t"][7] = np.nan


def backwards(arrays: Any) -> None:
    arrays["t"][[7, 8]] = arrays["t"][[8, 7]]


def uneven(arrays: Any) -> None:
    arrays["t"][7:-1] += 1e-4


def another_period(arrays: Any) -> None:
    arrays["period"] = np.array(0.004)


def half_the_time(arrays: Any) -> None:
    for name, power in (("t", -1), ("velocity", 1), ("acceleration", 2), ("jerk", 3)):
        arrays[name] *= 2.0**power
    arrays["period"] = arrays["period"] / 2.0


def twice(arrays: Any) -> None:
    arrays["axes"] = np.array(["X", "X", "Z"])


def other_axes(arrays: Any) -> None:
    arrays["axes"] = np.array(["Y", "X", "Z"])


def unknown_version(arrays: Any) -> None:
    arrays["format"] = np.array(2)


def in_degrees(arrays: Any) -> None:
    arrays["units"] = np.array(["mm", "mm", "deg"])


def shifted(arrays: Any) -> None:
    arrays["position"][20:, 0] += 0.001


def one_missing(arrays: Any) -> None:
    for name in ("t", "position", "velocity", "acceleration", "jerk", "line"):
        arrays[name] = arrays[name][:-1]


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (zeros, 1, "change of the recorded velocity beyond the recorded acceleration"),
        (one_axis_of_zeros, 1, "Y change of the recorded velocity beyond"),
        (zeros_for_a_while, 1, "change of the recorded velocity beyond"),
        (opposite, 1, "change of the recorded velocity beyond"),
        (in_metres, 1, "change of the recorded velocity beyond"),
        (stretched, 2, "last time is"),
        (not_a_number, 1, "number that is not finite"),
        (no_time, 1, "number that is not finite"),
        (backwards, 1, "irregularity of the time steps"),
        (uneven, 1, "irregularity of the time steps"),
        (another_period, 2, "the period is 0.004 s"),
        (half_the_time, 2, "the period is 0.001 s"),
        (twice, 2, "the axis X comes 2 times"),
        (other_axes, 2, "the axes is Y X Z"),
        (unknown_version, 2, "has the format 2, this feedplan reads 1"),
        (in_degrees, 2, "axis Z is in deg, on the machine mill in mm"),
        (shifted, 1, "error of the recorded velocity"),
        (one_missing, 2, "the number of setpoints is"),
    ],
)
@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited"])
def test_changed_setpoints_are_refused_in_one_sentence(
    method: str, change: Any, code: int, words: str, folder: Any, capsys: Any
) -> None:
    out = folder(method)
    change_setpoints(out, change)
    assert main(["check", str(out)]) == code
    assert_one_sentence(capsys.readouterr().err, words)


def test_a_period_of_nothing_in_plan_json_is_refused(folder: Any, capsys: Any) -> None:
    file = folder("bang-bang") / "plan.json"
    summary = json.loads(file.read_text(encoding="utf-8"))
    summary["setpoints"]["period"] = 0
    file.write_text(json.dumps(summary), encoding="utf-8")
    assert main(["check", str(file.parent)]) == 2
    assert_one_sentence(capsys.readouterr().err, "period")


def test_a_column_of_jerk_is_judged_where_the_method_limits_it(folder: Any, capsys: Any) -> None:
    out = folder("jerk-limited")
    change_setpoints(out, no_jerk)
    assert main(["check", str(out)]) == 1
    assert_one_sentence(
        capsys.readouterr().err, "change of the recorded acceleration beyond the recorded jerk"
    )


def test_without_plan_json_the_period_of_the_file_is_used(folder: Any, made: Path, capsys: Any) -> None:
    out = folder("bang-bang")
    (out / "plan.json").rename(out / "own.json")
    machine = out / "own.toml"
    machine.write_text(OWN)
    assert main(["check", str(out), "-m", str(machine)]) == 0
    capsys.readouterr()
    change_setpoints(out, stretched)
    assert main(["check", str(out), "-m", str(machine)]) == 1
    assert_one_sentence(capsys.readouterr().err, "irregularity of the time steps")


def changed(**entries: Any) -> Callable[[dict[str, Any]], object]:
    return lambda summary: summary.update(entries)


def without(name: str) -> Callable[[dict[str, Any]], object]:
    return lambda summary: summary.pop(name)


def faster_machine(summary: dict[str, Any]) -> None:
    summary["machine_file"] = summary["machine_file"].replace("500.0", "5000.0")


def no_machine(summary: dict[str, Any]) -> None:
    summary["machine_file"] = "name = "
    summary["machine_file_sha256"] = hashlib.sha256(b"name = ").hexdigest()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (changed(format=2), "has the format 2, this feedplan reads 1"),
        (without("format"), "format is missing"),
        (changed(format=True), "format is True"),
        (faster_machine, "machine_file was changed"),
        (no_machine, "is not valid TOML"),
        (without("machine_file"), "machine_file is missing"),
        (without("machine_file_sha256"), "machine_file_sha256 is missing"),
        (changed(method="magic"), "the method 'magic' is unknown"),
        (changed(time=0.5), "the time is 0.5 s, its setpoints take"),
        (changed(time="long"), "time is 'long'"),
        (changed(time=None), "time is None"),
        (without("setpoints"), "setpoints is missing"),
        (changed(setpoints=[]), "setpoints is []"),
        (changed(setpoints={}), "setpoints axes is missing"),
        (changed(runs=1e9), "runs is 1000000000.0"),
        (changed(runs=10**400), "runs is 10000000"),
    ],
)
def test_a_changed_plan_is_refused_in_one_sentence(change: Any, words: str, folder: Any, capsys: Any) -> None:
    out = folder("bang-bang")
    summary = json.loads((out / "plan.json").read_text())
    change(summary)
    (out / "plan.json").write_text(json.dumps(summary))
    assert main(["check", str(out)]) == 2
    assert_one_sentence(capsys.readouterr().err, words)


@pytest.mark.parametrize("text", ["", "[]", "{", "null", "[" * 100_000, '{"format": 1}'])
def test_a_damaged_plan_is_refused_in_one_sentence(text: str, folder: Any, capsys: Any) -> None:
    out = folder("bang-bang")
    (out / "plan.json").write_text(text)
    assert main(["check", str(out)]) == 2
    assert_one_sentence(capsys.readouterr().err, "plan.json")


def test_the_plan_of_other_setpoints_is_refused(folder: Any, capsys: Any) -> None:
    one, other = folder("bang-bang"), folder("jerk-limited")
    shutil.copy(other / "plan.json", one / "plan.json")
    assert main(["check", str(one)]) == 2
    assert_one_sentence(capsys.readouterr().err, "these are not the setpoints of this plan")


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("method", sorted(set(planners.methods()) - {"casadi", "clarabel", "toppra"}))
def test_the_check_of_every_format_agrees_with_the_audit_for_each_method(
    method: str, name: str, tmp_path: Path
) -> None:
    made = planned(method)
    write_plan(made, tmp_path, [name], step=made.machine.period if name == "pvt" else None)
    audit = check(tmp_path)
    # Methods that break limits must fail here too, except for checks that setpoints alone do not allow.
    expected = {(c.name, c.axis) for c in made.audit().broken} & {(c.name, c.axis) for c in audit.checks}
    assert {(c.name, c.axis) for c in audit.broken} >= expected
    assert audit.ok or not made.audit().ok


PLANS: dict[str, Any] = {}


def planned(method: str) -> Any:
    if method not in PLANS:
        from feedplan.program.gcode import read_gcode

        # A circle as a polygon: methods that pass corners make a velocity jump at each.
        angles = np.linspace(0.0, 2.0 * np.pi, 60)
        points = "".join(f"G1 X{10 * np.cos(a):.4f} Y{10 * np.sin(a):.4f}\n" for a in angles)
        PLANS[method] = plan(
            read_gcode(f"G21 G90 G64 P0.01\nF2400\n{points}M2\n".encode(), None, "circle"), "router", method
        )
    return PLANS[method]


class Leaning(Kinematics):
    """A kinematics whose axis Y is not perpendicular to X."""

    tip_names, joint_names = ("X", "Y"), ("X", "Y")

    def __init__(self, lean: float) -> None:
        self.lean = lean

    def joints(self, tip: Any) -> Any:
        return tip[0] + tip[1] * self.lean, tip[1]

    def tip(self, joints: Any) -> Any:
        return joints[0] - joints[1] * self.lean, joints[1]


def test_the_check_needs_no_registered_kinematics(tmp_path: Path, capsys: Any) -> None:
    register("leaning", lambda axes, parameters: Leaning(parameters.number("lean", 0.0, "")))
    try:
        machine = Machine(
            "leaning",
            (Axis("X", 100, 500, 5e4), Axis("Y", 100, 500, 5e4)),
            kinematics="leaning",
            parameters={"lean": 0.25},
            home=(1.0, 2.0),
            offsets=(("G54", (3.0, 4.0)),),
        )
        made = plan(feedplan_path(), machine)
        assert made.audit().ok
        write_plan(made, tmp_path)
    finally:
        del _registered["leaning"]
    assert 'type = "leaning"\nlean = 0.25' in json.loads((tmp_path / "plan.json").read_text())["machine_file"]
    assert main(["check", str(tmp_path)]) == 0


def feedplan_path() -> Any:
    from feedplan import Path as ToolPath

    return ToolPath.from_bezier([[0, 0], [30, 0], [30, 20], [0, 20]], feed=40.0)


def test_the_check_from_python_takes_machines_too(folder: Any) -> None:
    out = folder("bang-bang")
    assert check(out).ok
    assert not check(out / "setpoints.npz", "tarus", jerk=True).ok
    weak = Machine("weak", tuple(Axis(name, 100, 100) for name in "XYZ"), period=0.002)
    assert not check(out, weak).ok
    with pytest.raises(InputError, match=r"none does not exist: give the setpoints or the folder of a plan"):
        check(out / "none")
    with pytest.raises(InputError, match="does not exist"):
        check(out / "none.npz")
    with pytest.raises(InputError, match=r"plan\.json is not a file of setpoints.*or the folder of a plan"):
        check(out / "plan.json")


def change_setpoints(folder: Path, change: Any) -> None:
    with np.load(folder / "setpoints.npz") as file:
        arrays = dict(file)
    change(arrays)
    np.savez(folder / "setpoints.npz", **arrays)

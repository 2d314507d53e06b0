"""Axes in any unit, in every file and table; no unit has a scale of its own."""

from __future__ import annotations

import json
import re
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.checking import check
from feedplan.cli import main
from feedplan.errors import InputError, MachineError
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine

NAMES = ("j1", "j2", "j3", "j4")
KNOTS = [0, 0, 0, 0, 1, 2, 3, 3, 3, 3]


def arm(unit: str, scale: float = 1.0) -> Machine:
    axes = tuple(
        Axis(name, 2.0 * scale, (5.0 + k) * scale, 60.0 * scale, unit=unit) for k, name in enumerate(NAMES)
    )
    return Machine("arm", axes, period=0.002)


def spline(scale: float = 1.0, names: tuple[str, ...] = NAMES, **changes: Any) -> Path:
    points = scale * np.random.default_rng(4).standard_normal((6, len(names)))
    return Path.from_bspline(points, KNOTS, 3, axes=names, **changes)


def test_the_unit_of_an_axis_is_in_every_file(tmp_path: FilePath) -> None:
    plan = feedplan.plan(spline(), arm("rad"))
    feedplan.write_plan(plan, tmp_path, ("npz", "csv"))
    summary = json.loads((tmp_path / "plan.json").read_text())
    assert summary["setpoints"]["units"] == ["rad"] * 4
    assert summary["units"] == {"length": "mm", "angle": "rad", "time": "s"}
    assert summary["turn"] == pytest.approx(plan.trajectory.length)
    assert 'unit = "rad"' in summary["machine_file"]
    lines = (tmp_path / "setpoints.csv").read_text().split("\n")
    assert "velocity j1 [rad/s]" in next(line for line in lines if not line.startswith("#"))
    assert np.load(tmp_path / "setpoints.npz")["units"].tolist() == ["rad"] * 4
    report = (tmp_path / "report.html").read_text()
    assert "rad/s²" in report
    assert "mm/s" not in report.split("<script")[0]
    for file in (tmp_path, tmp_path / "setpoints.csv", tmp_path / "setpoints.npz"):
        assert check(file).check("velocity", "j1").unit == "rad/s"
    with pytest.raises(InputError, match="axis j1 is in rad, on the machine arm in mm"):
        check(tmp_path / "setpoints.npz", arm("mm"))


def test_a_machine_file_keeps_the_unit() -> None:
    for unit in ("rad", "µm", "°", "counts"):
        machine = arm(unit)
        from feedplan.machine.machine import Machine

        assert Machine.from_toml(machine.to_toml(), "arm.toml") == machine


@pytest.mark.parametrize(
    ("axis", "unit", "kind"),
    [
        (Axis("X", 1, 1), "mm", "linear"),
        (Axis("A", 1, 1), "deg", "rotary"),
        (Axis("A", 1, 1, kind="linear"), "mm", "linear"),
        (Axis("A", 1, 1, unit="rad"), "rad", "rotary"),
        (Axis("j1", 1, 1), "mm", "linear"),
        (Axis("j1", 1, 1, unit="rad"), "rad", "rotary"),
        (Axis("j1", 1, 1, unit="deg"), "deg", "rotary"),
        (Axis("j1", 1, 1, kind="rotary"), "deg", "rotary"),
        (Axis("j1", 1, 1, unit="µm"), "µm", "linear"),
    ],
)
def test_letter_unit_and_kind_follow_from_one_another(axis: Axis, unit: str, kind: str) -> None:
    assert (axis.unit, axis.kind) == (unit, kind)


@pytest.mark.parametrize("unit", ["m m", "a" * 13, "<b>", "[mm]", "\n", 3, None, "mm,"])
def test_a_text_that_is_no_unit_is_refused(unit: Any) -> None:
    with pytest.raises(MachineError, match=r"axis j1: unit is .*: give 1 to 12 characters"):
        Axis("j1", 1.0, 1.0, unit=unit)


@pytest.mark.parametrize("scale", [1e-3, 1e3, 1e6])
@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited", "s-curve", "clarabel"])
def test_the_plan_is_the_same_in_any_unit(method: Any, scale: float) -> None:
    """Lengths times 1e-3 to 1e6: no planner contains a length."""
    one, other = (feedplan.plan(spline(by), arm("rad", by), method) for by in (1.0, scale))
    rel = {"bang-bang": 1e-9, "s-curve": 1e-6}.get(method, 2e-4)
    assert other.time == pytest.approx(one.time, rel=rel)
    assert other.audit().ok


@pytest.mark.parametrize("unit", ["rad", "m"])
def test_a_program_is_refused_where_an_axis_has_another_unit(unit: str) -> None:
    machine = Machine("own", (Axis("X", 100, 1000), Axis("A", 10, 100, unit=unit)))
    with pytest.raises(MachineError, match=f"in deg along A, and axis A of machine own in {unit}: convert"):
        feedplan.plan("G21 G90 F600\nG1 X10 A90\n", machine)
    assert feedplan.plan("G21 G90 F600\nG1 X10\n", machine).audit().ok


def test_kinematics_with_dimensions_need_mm_and_degrees() -> None:
    machine = Machine.load("trunnion-ac")
    axes = [
        Axis(a.name, a.max_velocity, a.max_acceleration, unit="rad" if a.name == "C" else "")
        for a in machine.axes
    ]
    with pytest.raises(MachineError, match="axis C is in rad, but its kinematics needs deg"):
        Machine("own", tuple(axes), kinematics="trunnion-ac", parameters=machine.parameters)


def test_mixed_units_have_the_length_of_their_space() -> None:
    axes = (Axis("slide", 100, 1000), Axis("elbow", 3, 30, unit="rad"))
    path = Path.from_bezier([[0.0, 0.0], [3.0, 4.0]], axes=("slide", "elbow"))
    plan = feedplan.plan(path, Machine("robot", axes))
    assert plan.trajectory.length == pytest.approx(5.0)
    assert plan.account.all.turn == pytest.approx(5.0)
    assert plan.problem.unit == "units"
    assert plan.audit().check("velocity", "elbow").unit == "rad/s"
    assert plan.audit().check("velocity", "slide").unit == "mm/s"


def test_a_speed_that_cannot_be_had_is_told_in_the_unit_of_the_path() -> None:
    with pytest.raises(feedplan.InfeasibleError, match=r"^no profile starts at 50 rad/s: .*: give a lower"):
        feedplan.plan(spline(), arm("rad"), start_speed=50.0)


def test_a_path_file_has_the_machines_own_axes_and_units(tmp_path: FilePath) -> None:
    points = np.random.default_rng(4).standard_normal((6, len(NAMES)))
    curve = {"degree": 3, "control_points": points[:, ::-1].tolist(), "knots": KNOTS}
    file = tmp_path / "reach.json"
    file.write_text(json.dumps({"axes": NAMES[::-1], "curves": [curve]}))
    for method, accuracy in (("bang-bang", 1e-9), ("jerk-limited", 1e-3)):
        plan = feedplan.plan(file, arm("rad"), method=method)
        assert plan.audit().ok
        same = feedplan.plan(spline(), arm("rad"), method=method)
        assert plan.time == pytest.approx(same.time, rel=accuracy)
        assert plan.path.axes == NAMES
    with pytest.raises(InputError, match="axes has j4 and the machine does not: use X, Y, Z"):
        feedplan.plan(file, "mill")


def test_distances_from_the_path_are_told_in_its_unit(tmp_path: FilePath, capsys: Any) -> None:
    (tmp_path / "arm.toml").write_text(arm("rad").to_toml())
    curve = {"degree": 1, "control_points": [[0, 0], [1, 0], [1, 1]], "knots": [0, 0, 1, 2, 2]}
    file = tmp_path / "arm.json"
    file.write_text(json.dumps({"axes": NAMES[:2], "feed": 1.5, "curves": [curve]}))
    command = ["plan", str(file), "-m", str(tmp_path / "arm.toml"), "--method", "jerk-limited"]
    assert main([*command, "-o", str(tmp_path / "out"), "--format", "none"]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert rows["feed"].endswith(" s, 1.998 rad")
    assert rows["tolerance"] == "0.01 rad"
    assert rows["deviation"].endswith(" rad")
    assert re.fullmatch(r"\S+ rad inside at most, \S+ rad outside, bends \S+ rad in the mean", rows["sides"])
    assert rows["fit"].startswith("1 point as 1 spline (")
    assert main(["fit", *command[1:4], "--smooth"]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert rows["deviation"].endswith(" rad")
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert re.search(r"Tolerance asked for</td><td[^>]*>0.01 rad<", page)
    assert re.search(r"Deviation from the program</td><td[^>]*>0.00\d+ rad<", page)


def test_a_program_that_only_turns_is_judged_in_degrees() -> None:
    turning, moving = (
        feedplan.plan(f"G21\nG1 A90 {word} F1000\nM2\n", "rotary-table") for word in ("", "X10")
    )
    for plan, unit in ((turning, "deg"), (moving, "mm")):
        units = {check.name: check.length for check in plan.audit().checks if check.axis is None}
        assert (units["feed"], units["deviation"], plan.trajectory.unit) == (unit, unit, unit)
    with pytest.raises(feedplan.InfeasibleError, match="no profile starts at 500 deg/s"):
        feedplan.plan("G21\nG1 A90 F60000\nM2\n", "rotary-table", start_speed=500.0)

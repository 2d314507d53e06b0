"""Machines with any set of axes, such as a laser or one rotary axis, plan programs, path files and paths."""

import json
from pathlib import Path as FilePath

import pytest

import feedplan
from feedplan import Axis, Machine, Path
from feedplan.cli import main
from feedplan.errors import MachineError, ProgramError
from feedplan.plan_folder import write_plan
from feedplan.program.read import read_program

SUBSETS = ("XY", "YX", "XZ", "ZX", "X", "Y", "A", "XA", "XYA", "UV", "XU", "ABC", "ZC")


def machine_of(names: str) -> Machine:
    return Machine("own", tuple(Axis(name, 100.0, 1000.0, 20000.0) for name in names), period=1e-3)


def points_of(names: str) -> list[list[float]]:
    """Four points, not on one line if there are several axes."""
    rows = [[0.0] * len(names), [9.0] * len(names), [14.0 + 3.0 * k for k in range(len(names))]]
    return [*rows, [22.0] * len(names)]


def gcode(names: str) -> str:
    """A program of lines, with a half circle if the machine has its plane."""
    rows = [" ".join(f"{name}{q:g}" for name, q in zip(names, row, strict=True)) for row in points_of(names)]
    text = "G21 G90 F600\nG1\n" + "\n".join(rows) + "\n"
    if {"X", "Y"} <= set(names):
        text += "G2 X32 Y22 I5 J0\n"
    if {"X", "Z"} <= set(names):
        text += "G18 G2 X32 Z22 I5 K0\n"
    return text + "M2\n"


@pytest.mark.parametrize("names", SUBSETS)
def test_every_source_is_planned_on_a_machine_of_any_axes(names: str, tmp_path: FilePath) -> None:
    machine = machine_of(names)
    program, curves = tmp_path / "own.ngc", tmp_path / "own.json"
    program.write_text(gcode(names))
    curve = {"degree": 3, "control_points": points_of(names)}
    curves.write_text(json.dumps({"axes": list(names), "feed": 8.0, "curves": [curve]}))
    points = Path.from_points(points_of(names), 0.01, axes=names, feed=8.0)
    for source in (program, curves, points):
        plan = feedplan.plan(source, machine)
        assert plan.audit().ok, (source, plan.audit().failures)
        assert set(plan.path.axes) == set(names)
    plan = feedplan.plan(program, machine, "jerk-limited")
    assert plan.audit().ok
    write_plan(plan, tmp_path / "out")
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.parametrize("names", SUBSETS)
def test_a_program_that_moves_another_axis_is_refused(names: str, tmp_path: FilePath) -> None:
    machine = machine_of(names)
    other = next(name for name in "YBVW" if name not in names)
    file = tmp_path / "own.ngc"
    file.write_text(gcode(names).replace("M2", f"G1 {other}1\nM2"))
    with pytest.raises(
        ProgramError, match=rf"^own\.ngc line \d+: word {other} moves an axis that the machine"
    ):
        feedplan.plan(file, machine)
    with pytest.raises(MachineError, match=rf"^own\.ngc, line \d+: axis {other} moves and machine own"):
        feedplan.plan(read_program(file), machine)


@pytest.mark.parametrize("names", ["XY", "XZ", "A"])
def test_methods_are_compared_on_a_machine_of_any_axes(names: str, tmp_path: FilePath) -> None:
    file, program = tmp_path / "own.toml", tmp_path / "own.ngc"
    row = "max_velocity = 100\nmax_acceleration = 1000\nmax_jerk = 20000\n"
    axes = "".join(f'[[axes]]\nname = "{name}"\n{row}' for name in names)
    file.write_text(f'name = "own"\nperiod = 0.001\n{axes}')
    program.write_text(gcode(names))
    methods = ["--methods", "bang-bang,s-curve"]
    assert main(["compare", str(program), "--machine", str(file), *methods]) == 0


def test_a_path_file_of_two_columns_is_planned_on_a_mill(tmp_path: FilePath) -> None:
    curves = tmp_path / "flat.json"
    curves.write_text(json.dumps({"curves": [{"degree": 2, "control_points": [[0, 0], [10, 0], [10, 10]]}]}))
    plan = feedplan.plan(curves, "mill", feed=80.0)
    assert plan.audit().ok
    assert plan.path.axes == ("X", "Y", "Z")


def test_a_program_is_taken_along_some_axes_in_their_order(tmp_path: FilePath) -> None:
    file = tmp_path / "own.ngc"
    file.write_text("G21 G90 F600\nG1 X1 Z3\nG18 G2 X11 I5\nM2\n")
    program = read_program(file)
    assert program.axes == ("X", "Y", "Z")
    assert program.moving().tolist() == [[True, False, True], [True, False, True]]
    turned = program.along(("Z", "X"))
    assert turned.target.tolist() == [[3.0, 1.0], [3.0, 11.0]]
    assert turned.along(("Z", "X")) is turned
    with pytest.raises(feedplan.InputError, match=r"own\.ngc, line 2: axis Z moves, and only X, Y may"):
        program.along(("X", "Y"))

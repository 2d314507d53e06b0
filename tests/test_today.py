"""The controller of today: in machine files, in Python and on the command line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import feedplan
from feedplan import Axis, Machine, MachineError, compare, plan
from feedplan.cli import main
from feedplan.errors import InputError
from feedplan.machine.controller import MODELS, Controller
from feedplan.one_step_more import one_step_more
from feedplan.planners import methods, options_of
from feedplan.today import time_by

A, V = 500.0, 100.0
AXES = tuple(Axis(name, V, A) for name in "XYZ")
PLANE = Machine("plane", AXES)
# Two lines at a right angle.
ANGLE = "G21 G90 G64 P0.05 F3000\nG1 X40\nY30\nM2\n"


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "angle.ngc"
    file.write_text(ANGLE, encoding="ascii")
    return file


@pytest.mark.parametrize("name", MODELS)
def test_a_machine_file_names_its_controller(name: str) -> None:
    machine = Machine("mine", AXES, controller=name)
    again = Machine.from_toml(machine.to_toml(), "mine.toml")
    assert again == machine
    assert again.controller == Controller(name)
    short = machine.to_toml().replace(f'[controller]\ntype = "{name}"\n', "")
    assert Machine.from_toml(f'controller = "{name}"\n{short}', "mine.toml") == machine
    # Every parameter is an option of its method, and its default value is accepted.
    model = MODELS[name]
    assert model.method in methods()
    assert set(Controller(name).options) <= set(options_of(model.method))
    assert {own.option for own in model.parameters.values()} <= set(options_of(model.method))
    defaults = {key: own.default for key, own in model.parameters.items() if own.default is not None}
    assert Controller(name, defaults).options == Controller(name).options


def test_parameters_of_a_machine_file_are_kept_and_reach_the_model() -> None:
    table = {"type": "marlin", "jerk": [8.0, 8.0, 0.4], "block_buffer_size": 31}
    machine = Machine.from_toml(Machine("mine", AXES, controller=table).to_toml(), "mine.toml")
    assert machine.controller is not None
    assert dict(machine.controller.parameters) == {"jerk": [8.0, 8.0, 0.4], "block_buffer_size": 31}
    options = machine.controller.options
    assert (options["axis_jumps"], options["blocks"], options["deviation"]) == ([8.0, 8.0, 0.4], 31, 0.013)
    assert Machine.from_toml(PLANE.to_toml(), "plane.toml").controller is None


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("fanuc", "the controller is 'fanuc': give one of linuxcnc, grbl, grblhal, klipper, marlin"),
        ({"junction_deviation": 0.1}, "the controller is .*: give one of .*, or a table with type"),
        (
            {"type": "grbl", "jerk": 3},
            r"controller grbl: the keys .*jerk.* are not known: give only",
        ),
        (
            {"type": "grbl", "junction_deviation": 0},
            r"deviation is 0: give a positive number \[mm\]",
        ),
        ({"type": "grbl", "block_buffer_size": 1}, "block_buffer_size is 1: give a whole number from 2"),
        ({"type": "klipper", "minimum_cruise_ratio": 1}, "ratio is 1: give a number from 0 to less than 1"),
        (
            {"type": "marlin", "jerk": [1, 2]},
            r"jerk is .*: give three positive numbers \[mm/s\]",
        ),
    ],
)
def test_an_unknown_controller_is_refused_in_one_sentence(given: Any, sentence: str) -> None:
    with pytest.raises(MachineError, match=sentence):
        Machine("mine", AXES, controller=given)
    with pytest.raises(MachineError, match=sentence):
        plan(ANGLE, PLANE, controller=given)


def test_a_plan_tells_what_is_saved() -> None:
    made = plan(ANGLE, PLANE, controller={"type": "grbl", "junction_deviation": 0.001})
    assert made.today is not None
    by_method = plan(ANGLE, PLANE, "junction-deviation", deviation=0.001, blocks=15, arc_tolerance=0.002)
    assert made.today.time == by_method.time
    assert made.today.saved == by_method.time - made.time > 0.0
    summary = made.summary()["today"]
    assert summary == {
        "controller": "grbl",
        "parameters": {"junction_deviation": 0.001},
        "time": by_method.time,
        "saved": made.today.saved,
    }
    assert plan(ANGLE, PLANE).today is None
    assert plan(ANGLE, PLANE).summary()["today"] is None


def test_the_request_of_the_plan_holds_for_the_controller() -> None:
    machine = Machine("mine", AXES, controller="linuxcnc")
    program = feedplan.read_program(ANGLE, machine)
    for request in ({"feed": 10.0}, {"feed_override": 0.5}, {"start_speed": 5.0}, {"tolerance": 0.4}):
        made = plan(program, machine, **request)  # type: ignore[arg-type]
        same = plan(program, PLANE, "linuxcnc", **request)  # type: ignore[arg-type]
        assert made.today is not None
        assert made.today.time == same.time, request
    # Both times include the pauses.
    paused = plan(ANGLE.replace("Y30", "G4 P2\nG1 Y30"), machine)
    assert paused.today is not None
    assert paused.today.time > 2.0
    assert 0.0 <= paused.today.saved < 0.5


def test_a_path_has_a_controller_too() -> None:
    path = feedplan.Path.from_points([[0, 0], [10, 0], [10, 10]], 0.01, feed=50.0)
    made = plan(path, PLANE, controller="grbl")
    assert made.today is not None
    assert made.today.time == pytest.approx(made.time, rel=0.05)


def test_a_model_without_a_plan_gives_a_warning() -> None:
    made = plan("G21 G90 G64 P0.01 F3000\nG1 X20 Y10\nX30 Y20\nM2\n", "polar", controller="grbl")
    assert made.today is None
    assert any(
        sentence.startswith("the time by grbl is not known: this method takes the program's axes")
        for sentence in made.warnings
    )


def test_a_comparison_tells_what_each_method_saves(program: Path) -> None:
    machine = Machine("mine", AXES, controller="klipper")
    rows = compare(program, machine, ("bang-bang", "arc-transition"))
    today = time_by(Controller("klipper"), feedplan.read_program(program, PLANE), PLANE, None)
    assert [row.saved for row in rows] == [today - row.time for row in rows if row.time is not None]
    assert all(row.plan and row.plan.machine == machine for row in rows)
    assert rows[0].to_json()["saved"] == rows[0].saved
    other = compare(program, machine, ("bang-bang",), controller="grbl")
    assert other[0].plan is not None
    assert other[0].plan.today is not None
    assert other[0].plan.today.controller == Controller("grbl")
    assert [row.saved for row in compare(program, PLANE, ("bang-bang",))] == [None]


def test_one_step_more_of_the_feed_shortens_lines_at_the_feed() -> None:
    # One line at the feed, with ramps at X's acceleration at both ends.
    length, feed = 40.0, 50.0
    made = plan(f"G21 G90 G64 F{60 * feed:g}\nG1 X{length:g}\nM2\n", Machine("mine", AXES, controller="grbl"))
    steps = {step.limit: step for step in one_step_more(made)}
    more = 1.2 * feed
    by_feed = (length / feed + feed / A) - (length / more + more / A)
    by_axis = feed / A - feed / (1.2 * A)
    assert list(steps)[:2] == ["feed", "X acceleration"]
    assert steps["feed"].saved == pytest.approx(by_feed, rel=1e-6)
    assert steps["X acceleration"].saved == pytest.approx(by_axis, rel=1e-6)
    assert steps["feed"].time == pytest.approx(made.time - by_feed, rel=1e-9)
    assert steps["tolerance"].saved == pytest.approx(0.0, abs=1e-9)


def test_one_step_more_keeps_method_and_request() -> None:
    machine = Machine("mine", tuple(Axis(name, V, A, 1e4) for name in "XYZ"))
    made = plan(ANGLE, machine, "s-curve", feed=30.0, tolerance=0.02)
    steps = {step.limit: step for step in one_step_more(made)}
    faster = plan(ANGLE, machine, "s-curve", feed=30.0, tolerance=0.02, feed_override=1.2)
    assert steps["feed"].time == pytest.approx(faster.time, rel=1e-9)
    wider = plan(ANGLE, machine, "s-curve", feed=30.0, tolerance=0.04)
    assert steps["tolerance"].time == pytest.approx(wider.time, rel=1e-9)


def test_the_commands_print_it(program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(Machine("mine", AXES, controller={"type": "grbl", "arc_tolerance": 0.01}).to_toml())
    options = ["--controller-option", "junction_deviation=0.001", "--one-step-more"]
    assert main(["plan", str(program), "--machine", str(mine), *options, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["today"]["parameters"] == {"arc_tolerance": 0.01, "junction_deviation": 0.001}
    assert summary["today"]["saved"] == pytest.approx(summary["today"]["time"] - summary["time"])
    assert {"limit", "factor", "time", "saved"} == set(summary["one_step_more"][0])
    assert main(["plan", str(program), "--machine", str(mine), *options]) == 0
    rows = dict(line.split("  ", 1) for line in capsys.readouterr().out.splitlines())
    assert rows["today"].strip().startswith(f"{summary['today']['time']:.3f} s by grbl: the plan saves ")
    assert rows["feed × 1.2"].strip().endswith("less")
    blocks = [*options, "--controller-option", "block_buffer_size=31", "--json"]
    assert main(["plan", str(program), "--machine", str(mine), *blocks]) == 0
    assert json.loads(capsys.readouterr().out)["today"]["parameters"]["block_buffer_size"] == 31
    # Another controller does not use the parameters in the machine file.
    assert main(["plan", str(program), "--machine", str(mine), "--controller", "marlin", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["today"]["parameters"] == {}
    assert main(["plan", str(program), "--machine", "mill", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["today"] is None
    assert "one_step_more" not in summary


def test_the_table_of_a_comparison_has_a_column(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["compare", str(program), "--machine", "mill", "--methods", "bang-bang,arc-transition"]
    assert main([*arguments, "--controller", "linuxcnc"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert "saved s" in printed[0]
    assert printed[-1].startswith("today: ")
    assert printed[-1].endswith(" by linuxcnc")
    assert main([*arguments, "--controller", "linuxcnc", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert set(summary["today"]) == {"controller", "parameters", "time"}
    assert main(arguments) == 0
    assert "saved" not in capsys.readouterr().out


def test_a_time_below_the_bound_is_one_that_breaks_limits(
    program: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wide = ["--controller", "grbl", "--controller-option", "junction_deviation=1"]
    assert main(["plan", str(program), "--machine", "mill", *wide]) == 0
    printed = capsys.readouterr().out
    assert "the plan takes longer by" in printed
    assert "no plan of this path within the limits is as fast" in printed


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ["--controller-option", "junction_deviation=0.1"],
            "give --controller NAME as well",
        ),
        (
            ["--controller", "grbl", "--controller-option", "deep"],
            "deep is no number by name: give NAME=",
        ),
        (["--controller", "grbl", "--controller-option", "depth=3"], "the keys .* are not known: give only"),
    ],
)
def test_wrong_options_are_refused(
    options: list[str], sentence: str, program: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(program), "--machine", "mill", *options]) == 2
    assert re.search(sentence, capsys.readouterr().err)


def test_a_controller_is_checked_before_anything_is_read() -> None:
    with pytest.raises((MachineError, InputError), match="the controller is 'nobody'"):
        plan("no program at all", PLANE, controller="nobody")

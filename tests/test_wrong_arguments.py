"""Arguments of wrong types: every public function accepts them or refuses them in one sentence."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan import Axis, FeedplanError, Machine, Path
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.corners import Corners
from feedplan.geometry.fit_settings import FitSettings
from feedplan.machine import kinematics
from feedplan.machine.kinematics import register
from feedplan.one_step_more import Step
from feedplan.outputs import load_setpoints
from feedplan.planners import options_of

PROGRAM = "G21 G90 G64 P0.05\nG1 F1000\nX10 Y0 Z0\nY10\nM2\n"
POINTS = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]
KNOTS = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
LONGEST = 300


class Odd:
    """A type that no function accepts; its text is long and has several lines."""

    def __repr__(self) -> str:
        return "very odd\n" * 1000


WRONG: list[Any] = [
    None,
    True,
    0,
    3,
    -1.5,
    10**400,
    float("nan"),
    float("inf"),
    1j,
    "",
    "text",
    "two\nlines",
    "nul\0",
    "\ud800",
    b"bytes",
    b"\xff\xfe",
    [],
    [None],
    [[1.0], [2.0, 3.0]],
    ["a", 1],
    (1, 2),
    {},
    {"a": 1},
    {1},
    np.array([1.0, np.nan]),
    np.array(["a"]),
    np.zeros((2, 2, 2)),
    range(3),
    slice(None),
    len,
    int,
    Odd(),
]
# Functions are left out, because an exception of a progress function is raised unchanged.
NO_FUNCTIONS = [value for value in WRONG if not callable(value)]


def cases(tmp_path: FilePath) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Functions by name, each with valid arguments by name."""
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM)
    table = tmp_path / "tool.tbl"
    table.write_text("T1 D6\n")
    dump = tmp_path / "grbl.txt"
    dump.write_text("$110=600\n$120=200\n")
    machine = Machine.load("mill")
    plan = feedplan.plan(file, machine)
    points = plan.setpoints()
    feedplan.write_plan(plan, tmp_path / "part")
    curve = CompositeCurve.from_nurbs(POINTS, KNOTS, 2)
    planned = {"feed_step": 5.0, "inverse_time": True, "dialect": "grbl", "expand": True}
    common = {
        "source": PROGRAM,
        "machine": machine,
        "tolerance": 0.01,
        "feed": 50.0,
        "feed_override": 1.0,
        "period": 0.001,
        "start_speed": 0.0,
        "end_speed": 0.0,
        "interpolator": "newton",
        "path": "as-fitted",
        "path_rounds": 1,
        "reading": {"whole_step": 1.0},
        "controller": "grbl",
        "progress": None,
    }
    spline = {"control_points": POINTS, "knots": KNOTS, "degree": 2}
    named = {"axes": ("X", "Y"), "feed": 50.0}
    limits = {"max_velocity": 100.0, "max_acceleration": 1000.0, "max_jerk": 1e4}
    axis = Axis("X", **limits)
    found: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
        "plan": (
            feedplan.plan,
            {**common, "method": "bang-bang", "max_setpoints": 100_000, "elsewhere": None},
        ),
        "plan of a path": (feedplan.plan, {"source": plan.path, "machine": machine, "feed": 50.0}),
        "compare": (
            feedplan.compare,
            {**common, "methods": ("bang-bang", "tangential"), "time_limit": 1.0, "accuracy": 1e-3},
        ),
        "check": (
            feedplan.check,
            {
                "place": tmp_path / "part",
                "machine": machine,
                "resolution": 0.0,
                "jerk": False,
                "progress": None,
            },
        ),
        "import_machine": (
            feedplan.import_machine,
            {"file": dump, "limits": {"X.jerk": 5000.0}, "name": "mine"},
        ),
        "read_program": (
            feedplan.read_program,
            {
                "source": PROGRAM,
                "machine": machine,
                "name": "a",
                "block_delete": True,
                "tool_table": table,
                "subprograms": [tmp_path],
                "feed": 50.0,
                "whole_step": 1.0,
                "max_bytes": 1000,
                "max_moves": 1000,
                "progress": None,
            },
        ),
        "write_plan": (
            feedplan.write_plan,
            {
                "plan": plan,
                "folder": tmp_path / "again",
                "formats": ("csv", "pvt"),
                "step": 0.01,
                "program": feedplan.planned_program(plan),
                "drawing": True,
                "one_step_more": (Step("feed", 1.2, 1.0, 0.5),),
                "progress": None,
            },
        ),
        "planned_program": (feedplan.planned_program, {"plan": plan, **planned}),
        "write_program": (
            feedplan.write_program,
            {"plan": plan, "file": tmp_path / "planned.ngc", **planned},
        ),
        "Axis": (
            Axis,
            {"name": "X", **limits, "travel": (0.0, 1.0), "max_velocity_jump": 0.0, "kind": "linear"},
        ),
        "Machine": (
            Machine,
            {
                "name": "own",
                "axes": (axis,),
                "period": 0.001,
                "chord_tolerance": 0.01,
                "kinematics": "cartesian",
                "home": (0.0,),
                "offsets": {"G54": (1.0,)},
                "parameters": {},
            },
        ),
        "register": (
            register,
            {"name": "odd", "factory": lambda axes, parameters: None},
        ),
        "FitSettings": (FitSettings, {own.name: own.default for own in fields(FitSettings)}),
        "load_setpoints": (load_setpoints, {"place": tmp_path / "part", "progress": None}),
        "Machine.load": (Machine.load, {"source": "mill"}),
        "Machine.from_toml": (
            Machine.from_toml,
            {"text": machine.to_toml(), "name": "mill.toml", "joints_only": False},
        ),
        "Machine.of": (Machine.of, {"given": "mill"}),
        "Machine.axis": (machine.axis, {"name": "X"}),
        "Machine.with_period": (machine.with_period, {"period": 0.001}),
        "Path.from_points": (
            Path.from_points,
            {"points": POINTS, "tolerance": 0.01, **named, "settings": None, "corners": Corners.ROUNDED},
        ),
        "Path.from_curve": (Path.from_curve, {"curve": curve, **named}),
        "Path.from_bezier": (Path.from_bezier, {"control_points": POINTS, "weights": [1, 1, 1], **named}),
        "Path.from_bspline": (Path.from_bspline, {**spline, "periodic": False, **named}),
        "Path.from_nurbs": (
            Path.from_nurbs,
            {**spline, "weights": [1.0, 2.0, 1.0], "periodic": False, **named},
        ),
        "Plan.setpoints": (plan.setpoints, {"period": 0.001, "interpolator": "newton", "progress": None}),
        "Plan.knots": (plan.knots, {"step": 0.01}),
        "Knots.chunks": (lambda size: list(plan.knots(0.01).chunks(size)), {"size": 1000}),
        "Plan.at": (plan.at, {"t": 0.5}),
        "Plan.operations": (plan.operations, {"tool_change": 5.0}),
        "Plan.make_account": (plan.make_account, {"progress": None}),
        "Plan.audit": (replace(plan).audit, {"progress": None}),
        "Setpoints.chunks": (lambda size: list(points.chunks(size)), {"size": 1000}),
        "Path.evaluate": (plan.path.evaluate, {"s": [1.0], "order": 1}),
        "Trajectory.at": (plan.trajectory.at, {"t": [0.1, 0.2]}),
        "Trajectory.distance": (plan.trajectory.distance, {"t": 0.5}),
        "Trajectory.time": (plan.trajectory.time, {"s": 1.0}),
        "Trajectory.speed": (plan.trajectory.speed, {"s": [1.0]}),
        "CompositeCurve": (
            CompositeCurve,
            {"control_points": POINTS, "weights": None, "offsets": [0, 3], "width": [1.0]},
        ),
        "CompositeCurve.from_pieces": (
            CompositeCurve.from_pieces,
            {"control_points": [POINTS], "width": [1.0]},
        ),
        "CompositeCurve.from_bezier": (
            CompositeCurve.from_bezier,
            {"control_points": POINTS, "weights": None, "width": 1.0},
        ),
        "CompositeCurve.joined": (CompositeCurve.joined, {"curves": [curve], "gap": 1e-6}),
        "CompositeCurve.evaluate": (curve.evaluate, {"piece": 0, "u": 0.5, "order": 1}),
        "CompositeCurve.elevated": (curve.elevated, {"degree": 3}),
        "CompositeCurve.split": (curve.split, {"piece": [0], "u": [0.5]}),
        "CompositeCurve.with_width": (curve.with_width, {"width": 2.0}),
        "CompositeCurve[]": (curve.__getitem__, {"pieces": slice(0, 1)}),
    }
    for method in feedplan.methods():
        options = options_of(method)
        if options:
            found[f"plan by {method}"] = (
                feedplan.plan,
                {"source": plan.path, "machine": machine, "method": method, **options},
            )
    return found


def outcome(function: Callable[..., Any], arguments: dict[str, Any]) -> str | None:
    """What is wrong with the function's reaction to these arguments; None if nothing is."""
    try:
        function(**arguments)
    except FeedplanError as error:
        sentence = str(error)
        if "\n" in sentence or not 0 < len(sentence) <= LONGEST or ": " not in sentence:
            return f"its sentence is {sentence!r:.400}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None


def test_every_argument_of_a_wrong_type_is_one_sentence(
    tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = cases(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(kinematics, "_registered", {})
    faults = []
    for name, (function, arguments) in found.items():
        assert outcome(function, arguments) is None, name
        for argument in arguments:
            for value in WRONG if argument != "progress" else NO_FUNCTIONS:
                fault = outcome(function, {**arguments, argument: value})
                if fault is not None:
                    faults.append(f"{name}({argument}={value!r:.40}): {fault}")
    assert not faults, f"{len(faults)} faults\n" + "\n".join(faults)


def test_the_cases_are_all_public_functions_with_all_their_arguments(tmp_path: FilePath) -> None:
    found = cases(tmp_path)
    for name in feedplan.__all__:
        thing = getattr(feedplan, name)
        if inspect.isfunction(thing) and inspect.signature(thing).parameters:
            arguments = {
                own.name
                for own in inspect.signature(thing).parameters.values()
                if own.kind is not inspect.Parameter.VAR_KEYWORD
            }
            assert arguments <= set(found[name][1]), name
    for name, kind in (("Plan", feedplan.Plan), ("Machine", Machine), ("Path", Path)):
        for method, function in inspect.getmembers(kind, callable):
            if method.startswith("_") or not hasattr(function, "__doc__") or isinstance(function, type):
                continue
            parameters = [own for own in inspect.signature(function).parameters if own != "self"]
            if parameters and (name, method) not in {("Path", "cut"), ("Plan", "pass_setpoints")}:
                assert set(parameters) <= set(found[f"{name}.{method}"][1]), (name, method)


def test_numbers_of_other_types_are_accepted(tmp_path: FilePath) -> None:
    exact = feedplan.plan(PROGRAM, "mill", feed=8, tolerance=0.5, start_speed=0)
    for number in (np.float32, np.int64, np.float64, Fraction):
        own = feedplan.plan(PROGRAM, "mill", feed=number(8), tolerance=number(1) / 2, start_speed=number(0))
        assert own.time == exact.time
        feedplan.write_plan(own, tmp_path, ())


def test_a_sentence_is_one_line_and_loses_its_middle_where_it_is_long() -> None:
    assert str(feedplan.InputError("one\ntwo")) == "one two"
    long = feedplan.ProgramError(f"the name is {'n' * 5000}/part.ngc: give a shorter one", line=3)
    assert re.fullmatch(r"the name is n{19}\.\.\.n+/part\.ngc: give a shorter one", str(long))
    long = feedplan.InputError(f"use one of {'a, ' * 500}or z")
    assert len(str(long)) == LONGEST
    assert re.fullmatch(r"use one of (a, )*a?\.\.\.,?( a,)* or z", str(long))
    path = f"/{'folder/' * 30}part.ngc"
    assert path in str(feedplan.InputError(f"{path} is missing: write it"))


def test_a_number_of_numpy_is_shown_as_a_number() -> None:
    with pytest.raises(FeedplanError, match=r"^axis X: max_jerk is 0\.001: give a number from"):
        Axis("X", 100.0, 1000.0, max_jerk=np.float64(1e-3))


def test_a_period_of_zero_is_refused_and_not_the_machines() -> None:
    with pytest.raises(feedplan.InputError, match="the period is 0 s: give a positive number"):
        feedplan.plan(PROGRAM, "mill").setpoints(0)


def test_a_path_has_its_own_tolerance_and_size() -> None:
    path = Path.from_points(POINTS, 0.01)
    with pytest.raises(feedplan.InputError, match=r"path is 'fastest': give it where the path is made"):
        feedplan.plan(path, "mill", path="fastest")
    with pytest.raises(feedplan.InputError, match=r"the tolerance is 0\.1: give it where the path is made"):
        feedplan.plan(path, "mill", tolerance=0.1)


def test_what_has_been_read_is_read_no_other_way() -> None:
    reading: Any = {"block_delete": False}
    for source in (feedplan.read_program(PROGRAM), Path.from_points(POINTS, 0.01)):
        kind = type(source).__name__
        sentence = f"reading is 'block_delete': give it where the program is read: this {kind} has been read"
        with pytest.raises(feedplan.InputError, match=sentence):
            feedplan.plan(source, "mill", reading=reading)
        with pytest.raises(feedplan.InputError, match=sentence):
            feedplan.compare(source, "mill", ["bang-bang"], reading=reading)


@pytest.mark.parametrize("columns", [7, 8, 9])
def test_more_columns_than_axis_names_are_refused(columns: int) -> None:
    points = np.zeros((3, columns))
    points[:, 0] = range(3)
    with pytest.raises(feedplan.InputError, match=f"{columns} coordinates and no names: name the axes"):
        Path.from_points(points, 0.01)
    assert Path.from_points(points, 0.01, axes="XYZABCUVW"[:columns]).axes == tuple("XYZABCUVW"[:columns])
    with pytest.raises(feedplan.InputError, match=f"for points of {columns} coordinates"):
        Path.from_points(points, 0.01, axes="XYZ")

"""Programs of curves and tool tips planned end to end: every limit holds in the audit on every machine."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np
import pytest

import feedplan
from feedplan.machine import kinematics
from feedplan.machine.kinematics import Kinematics
from feedplan.machine.numbers import Number

FIVE_AXES = ("trunnion-ac", "trunnion-bc", "head-table", "head-head")
ROOT = FilePath(__file__).parents[1]
BUTTERFLY = ROOT / "benchmarks" / "curves" / "butterfly.json"

SPLINES = """G21 G90 G17 G64 P0.01 F2000
G0 X60 Y20 Z2
G1 Z0
G5 I5 J5 P-5 Q5 X80 Y20
G5 I5 J-5 P0 Q-8 X100 Y20
G5.1 I10 J10 X120 Y20
G5.2 X125 Y25 P1 L3
X130 Y30 P2
X140 Y20 P1
X150 Y15 P1
G5.3
G1 X160 Y20
M2
"""
ARCS = """G21 G90 G17 G64 P0.01 F1500
G0 X60 Y10 Z5
G1 Z0
Y40
G3 X40 Y60 I-20 J0
G2 X60 Y80 I20 J0
G3 X60 Y80 Z3 I5 J5
G0 Z20
M2
"""


def planned(text: str, machine: feedplan.Machine | str, tmp_path: FilePath) -> feedplan.Plan:
    file = tmp_path / "part.ngc"
    file.write_text(text)
    return feedplan.plan(file, machine)


def assert_sound(plan: feedplan.Plan) -> None:
    verdict = plan.audit()
    assert verdict.ok, verdict.failures
    # Plans are by bang-bang: some limit is used fully.
    used = [check.ratio for check in verdict.checks if check.name in ("acceleration", "velocity", "feed")]
    assert max(used) > 1 - 1e-6
    assert plan.lower_bound <= plan.time


@pytest.mark.parametrize("form", ["tip", "vector", "joints"])
@pytest.mark.parametrize("name", FIVE_AXES)
def test_five_axes_keep_their_limits_whatever_the_words(name: str, form: str, tmp_path: FilePath) -> None:
    file = tmp_path / "impeller.ngc"
    options = ["--machine", name, "--form", form, "--blocks", "90", "--levels", "1", "--output", str(file)]
    subprocess.run([sys.executable, str(ROOT / "examples" / "impeller.py"), *options], check=True)
    plan = feedplan.plan(file, name)
    assert plan.setpoints().axes == plan.machine.axis_names
    assert_sound(plan)


@pytest.mark.parametrize("machine", ["mill", "corexy", "polar", "cylindrical", "rotary-table", "head-head"])
@pytest.mark.parametrize("text", [SPLINES, ARCS], ids=["splines", "arcs"])
def test_splines_and_arcs_are_planned_on_every_kind_of_machine(
    text: str, machine: str, tmp_path: FilePath
) -> None:
    assert_sound(planned(text, machine, tmp_path))


def test_the_butterfly_of_a_path_file_takes_its_known_time(tmp_path: FilePath) -> None:
    data = json.loads(BUTTERFLY.read_text(encoding="utf-8"))
    curve = {key: data[key] for key in ("degree", "control_points", "weights")}
    # The published time belongs to the knots as most publications print them.
    curve["knots"] = [round(knot, 4) for knot in data["knots"]]
    file = tmp_path / "butterfly.json"
    file.write_text(json.dumps({"unit": "mm", "curves": [curve], "feed": 250.0}))
    axes = tuple(feedplan.Axis(letter, 250.0, 3000.0) for letter in "XYZ")
    plan = feedplan.plan(file, feedplan.Machine("table", axes))
    assert plan.time == pytest.approx(2.622026012553, rel=1e-9)
    assert_sound(plan)


def test_a_feed_that_a_path_does_not_take_is_refused() -> None:
    points = [[0, 0], [10, 0], [10, 10]]
    with pytest.raises(feedplan.InputError, match="give it where the path is made: this Path has no feed"):
        feedplan.plan(feedplan.Path.from_bezier(points), "mill", feed=5.0)
    path = feedplan.Path.from_bezier(points, feed=50.0)
    assert feedplan.plan(path, "mill", feed=5.0).time > 2 * feedplan.plan(path, "mill").time


def test_a_circle_is_followed_exactly(tmp_path: FilePath) -> None:
    plan = planned("G21 G90 G61 F60000\nG0 X10 Y0\nG3 X10 Y0 I-10 J0\nM2\n", "mill", tmp_path)
    chunk = plan.setpoints().all()
    on_circle = chunk.line == 3
    radius = np.hypot(chunk.position[on_circle, 0], chunk.position[on_circle, 1])
    np.testing.assert_allclose(radius, 10.0, atol=1e-12)


@dataclass(frozen=True)
class Skewed(Kinematics):
    """A kinematics whose axis Y leans by 30 degrees and whose Z moves by a lever."""

    joint_names: tuple[str, ...]
    tip_names: tuple[str, ...] = ("X", "Y", "Z")

    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        x, y, z = tip
        return x - y * math.tan(math.radians(30.0)), y / math.cos(math.radians(30.0)), z + 0.001 * z * z


def test_a_kinematics_of_ones_own_is_planned_and_audited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinematics, "_registered", {})
    kinematics.register("skewed", lambda axes, parameters: Skewed(tuple(axis.name for axis in axes)))
    axes = tuple(feedplan.Axis(letter, 200.0, 2000.0) for letter in "XYZ")
    machine = feedplan.Machine("skewed", axes, kinematics="skewed")
    path = feedplan.Path.from_bezier([[0, 0, 0], [30, 40, 5], [60, -40, -5], [90, 0, 0]], feed=150.0)
    assert_sound(feedplan.plan(path, machine))

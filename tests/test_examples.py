"""Every script in examples/ runs, and the programs that they write agree with their descriptions."""

from __future__ import annotations

import contextlib
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import feedplan
from benchmarks.named import EXAMPLES, example
from feedplan.curves.composite import CompositeCurve
from feedplan.machine.axis_words import axis_words
from feedplan.machine.coordinate_mode import CoordinateMode
from feedplan.machine.machine import Machine
from feedplan.machine.path_derivatives import positions
from feedplan.program.gcode import read_gcode
from feedplan.program.program import Program
from tests.service.servers import running

# Post-processors run inside CAM systems (test_freecad.py).
SCRIPTS = sorted(path.name for path in EXAMPLES.glob("*.py") if not path.stem.endswith("_post"))


def moves(text: str, words: str) -> NDArray[np.float64]:
    """The numbers in the lines that contain all of `words`, one row for each line."""
    pattern = ".*".join(
        rf"\b{word}(-?[\d.]+)" if i == 0 else rf"{word}(-?[\d.]+)" for i, word in enumerate(words)
    )
    found = [re.search(pattern, line) for line in text.splitlines()]
    return np.array([[float(number) for number in match.groups()] for match in found if match])


def test_the_times_of_the_panel_are_those_of_the_documentation(tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLES / "panel.py"), "--passes", "4", "--output", "panel.json"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    times = [
        f"{feedplan.plan(tmp_path / 'panel.json', 'tarus', method).time:.1f} s by `{method}`"
        for method in ("s-curve", "ruckig", "jerk-limited")
    ]
    text = (EXAMPLES.parent / "docs" / "methods.md").read_text("utf-8")
    assert f"four passes take {times[0]}, {times[1]} and {times[2]}" in " ".join(text.split())


def test_the_corner_of_the_documentation_takes_its_times() -> None:
    machine = Machine("fast", tuple(feedplan.Axis(name, 250.0, 3000.0, 50_000.0) for name in "XY"))
    text = "G21 G90 G64 F60000\nG1 X10\nG1 X10 Y10\nM2\n"
    said = []
    for tolerance in (0.01, 0.05):
        options = {"tolerance": tolerance, "path": "as-fitted"}, {"tolerance": tolerance, "path": "fastest"}
        said += [f"{feedplan.plan(text, machine, 'jerk-limited', **own).time:.3f}" for own in options]
    words = "{} s as fitted and {} s at 0.01 mm, {} and {} s at 0.05 mm".format(*said)
    assert words in " ".join((EXAMPLES.parent / "docs" / "methods.md").read_text("utf-8").split())


def test_the_client_of_the_service_tells_a_file_that_is_missing(tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLES / "service_client.py"), "none.ngc"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "error: none.ngc: No such file or directory\n")


@pytest.mark.parametrize("script", SCRIPTS)
def test_the_script_runs_and_writes_below_out(script: str, tmp_path: Path) -> None:
    if "matplotlib" in (EXAMPLES / script).read_text(encoding="utf-8"):
        pytest.importorskip("matplotlib")
    # A package that is compiled at its first import may contain invalid escape sequences.
    warnings = "error,ignore:invalid escape sequence"
    environment = dict(os.environ, PYTHONWARNINGS=warnings, MPLCONFIGDIR=str(tmp_path / "matplotlib"))
    with contextlib.ExitStack() as stack:
        of_service = "FEEDPLAN_SERVER" in (EXAMPLES / script).read_text(encoding="utf-8")
        if of_service:
            environment["FEEDPLAN_SERVER"] = stack.enter_context(running(tmp_path / "store")).url
        done = subprocess.run(
            [sys.executable, str(EXAMPLES / script)],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" or (of_service and "% write" in done.stderr)
    assert done.stdout.strip()
    written = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert written
    assert all(path.stat().st_size > 0 for path in written)


@pytest.mark.parametrize("name", ["vase", "lettering", "head"])
@pytest.mark.parametrize("blocks", [500, 5000, 20_000])
def test_a_program_has_about_as_many_blocks_as_asked(name: str, blocks: int) -> None:
    text = example(name).program(blocks)
    assert text.count("\n") == pytest.approx(blocks, rel=0.12, abs=60)


@pytest.mark.parametrize("name", ["vase", "lettering", "head"])
def test_a_program_is_the_same_every_time_and_complete(name: str) -> None:
    text = example(name).program(1000)
    assert text == example(name).program(1000)
    lines = text.splitlines()
    assert (lines[0], lines[-2], lines[-1]) == ("%", "M30", "%")
    assert lines[1].startswith("(")
    words = " ".join(line for line in lines if not line.startswith("(")).split()
    assert {"G21", "G90", "G17", "M3", "M5"} <= set(words)
    assert any(word.startswith("F") for word in words)
    assert any(word.startswith("S") for word in words)


def test_a_vase_pass_has_486_points_in_one_plane() -> None:
    vase = example("vase")
    text = vase.program(3 * 486)
    passes = re.split(r"\(pass \d+\)\n", text)[1:]
    assert len(passes) == 3
    for number, block in enumerate(passes):
        points = moves(block, "YZ")
        assert points.shape == (486, 2)
        assert len(moves(block, "X")) == 1, "x moves only on the way to the pass"
        direction = np.sign(np.diff(points[:, 0]))
        assert np.all(direction == (1.0 if number % 2 == 0 else -1.0))


def test_a_vase_pass_has_creases_and_smooth_stretches_between_them() -> None:
    points = example("vase").pass_points(0.0)
    edges = np.diff(points, axis=0)
    turn = np.abs(np.diff(np.arctan2(edges[:, 1], edges[:, 0])))
    curvature = turn / (0.5 * np.linalg.norm(points[2:] - points[:-2], axis=1))
    # Equation 2 of Zhang et al. with α = 4 at 100 mm/s, with the accelerations of both axes together.
    threshold = 4.0 * math.hypot(3000.0, 1000.0) / 100.0**2
    creases = np.count_nonzero(curvature > threshold)
    assert 25 <= creases <= 70, "each crease shows at one point or two"
    assert np.median(curvature) < 0.4 * threshold


def test_the_passes_of_a_vase_never_leave_its_field() -> None:
    vase = example("vase")
    assert np.allclose(vase.planes(3, 0.1), [-0.1, 0.0, 0.1])
    many = vase.planes(100_000, 0.1)
    assert many[0] == pytest.approx(-vase.HALF_WIDTH)
    assert many[-1] == pytest.approx(vase.HALF_WIDTH)
    assert vase.height(vase.HALF_WIDTH, np.linspace(0.0, vase.LENGTH, 500)).max() == 0.0


def test_arcs_of_the_lettering_end_on_their_circles() -> None:
    lettering = example("lettering")
    text = lettering.program(2000, text="".join(lettering.FONT))
    x = y = 0.0
    arcs = 0
    for line in text.splitlines():
        words = {word[0]: float(word[1:]) for word in line.split() if word[0] in "XYIJ"}
        target = words.get("X", x), words.get("Y", y)
        if "I" in words:
            arcs += 1
            middle = x + words["I"], y + words["J"]
            radius = math.hypot(words["I"], words["J"])
            assert math.dist(middle, target) == pytest.approx(radius, abs=2e-4)
        x, y = target
    assert arcs > 100


def test_a_half_circle_and_a_quarter_have_their_centres_by_hand() -> None:
    lettering = example("lettering")
    assert lettering.centre((0.0, 0.0), (2.0, 0.0), 1.0) == pytest.approx((1.0, 0.0))
    # Counter-clockwise from (1, 0) to (0, 1): about the origin.
    assert lettering.centre((1.0, 0.0), (0.0, 1.0), math.tan(math.pi / 8)) == pytest.approx((0.0, 0.0))
    assert lettering.centre((0.0, 1.0), (1.0, 0.0), -math.tan(math.pi / 8)) == pytest.approx((0.0, 0.0))


def test_the_tool_is_up_on_every_rapid_of_the_lettering() -> None:
    z = math.inf
    for line in example("lettering").program(1000).splitlines():
        match = re.search(r"Z(-?[\d.]+)", line)
        if line.startswith("G0") and not match:
            assert z > 0.0
        z = float(match.group(1)) if match else z


def test_letters_that_the_font_lacks_are_refused() -> None:
    with pytest.raises(ValueError, match="FEED!"):
        example("lettering").program(100, text="feed!")


def test_blocks_of_the_head_are_as_long_as_their_curvature_allows() -> None:
    head = example("head")
    points = head.pass_points(0.3, 0.002)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert lengths.min() >= 0.9 * 0.05
    assert lengths.max() <= 1.001
    assert lengths.max() > 5.0 * lengths.min()
    # The chord error: the distance from the middle of a block to the path of the tool tip.
    path = head.tool_tip(0.3, np.linspace(points[0, 1], points[-1, 1], 20_000))
    middle = 0.5 * (points[1:] + points[:-1])
    beside = np.column_stack([np.interp(middle[:, 1], path[:, 1], path[:, k]) for k in range(3)])
    along = np.diff(points, axis=0) / lengths[:, None]
    error = np.linalg.norm(np.cross(beside - middle, along), axis=1)
    assert error.max() <= 1.1 * 0.002
    assert np.median(error) >= 0.4 * 0.002


def test_the_ball_does_not_gouge_the_head() -> None:
    head = example("head")
    for x in np.linspace(-0.5 * head.WIDTH, 0.5 * head.WIDTH, 30):
        points = head.pass_points(float(x), 0.002)
        assert np.all(np.diff(points[:, 1]) > 0.0), "a gouge would turn the pass back"


def test_the_head_moves_all_three_axes() -> None:
    points = moves(example("head").program(2000), "XYZ")
    assert np.all(np.mean(np.abs(np.diff(points, axis=0)) > 0.0, axis=0) > 0.8)


def joint_positions(program: Program, machine: Machine) -> NDArray[np.float64]:
    """Joint positions at the end of every move."""
    assert program.coordinate_mode is not None
    found = np.empty((len(program), len(machine.axes)))
    for coordinate_mode in CoordinateMode:
        rows = program.coordinate_mode == coordinate_mode
        axis = axis_words(machine, program.axes, coordinate_mode) if rows.any() else None
        if axis is not None:
            found[rows] = positions(axis.kinematics, axis.tip(program.target[rows]))
    return found


@pytest.mark.parametrize("name", ["trunnion-ac", "trunnion-bc", "head-table", "head-head"])
def test_the_impeller_is_the_same_motion_in_every_form(name: str) -> None:
    impeller = example("impeller")
    machine = Machine.load(name)
    programs = [read_gcode(impeller.program(machine, form, 600), machine) for form in impeller.FORMS]
    tip, vector, joints = (joint_positions(program, machine) for program in programs)
    assert len(joints) > 500
    assert np.abs(tip - joints).max() < 1e-3
    # A direction determines the angles only up to whole turns and one of two poses.
    assert programs[1].coordinate_mode is not None
    pointed = programs[1].coordinate_mode == CoordinateMode.VECTOR
    kinematics = axis_words(machine, programs[1].axes, CoordinateMode.VECTOR).kinematics
    directions = np.array([kinematics.tip(row) for row in joints])
    assert np.abs(directions[pointed] - programs[1].target[pointed][:, [0, 1, 2, 5, 6, 7]]).max() < 1e-3
    assert np.abs(vector - joints)[~pointed].max() < 1e-3
    # After the end of the tip words all forms agree: their last move is one of joints.
    starts = [program.starts()[-1][:5] for program in programs]
    assert starts[0] == pytest.approx(starts[2], abs=1e-3)
    assert starts[1] == pytest.approx(starts[2], abs=1e-3)
    low, high = (np.array([axis.travel[end] for axis in machine.axes]) for end in (0, 1))
    assert ((joints >= low) & (joints <= high)).all()
    feeds = [program.feed[np.isfinite(program.feed)] for program in programs]
    assert feeds[0] == pytest.approx(np.full(len(feeds[0]), 50))


def test_the_flank_of_the_tool_stays_beside_the_blade() -> None:
    impeller = example("impeller")
    tips, directions = impeller.blade_pass(0, 9.0, 60)
    hub, rulings = impeller.ruling(np.linspace(0, 1, 2001), 0)
    middle = hub + 9.0 * rulings
    away = np.array([np.linalg.norm(middle - tip, axis=1).min() for tip in tips])
    reach = impeller.TOOL_RADIUS + 0.5 * impeller.THICKNESS
    assert away == pytest.approx(np.full(len(tips), reach), abs=0.02)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(len(tips)))


def test_the_passes_of_the_panel_are_joined_as_asked() -> None:
    panel = example("panel")
    for joint in panel.JOINTS:
        parts = [
            CompositeCurve.from_bspline(curve["control_points"], curve["knots"], 3)
            if "knots" in curve
            else CompositeCurve.from_bezier(curve["control_points"])
            for curve in panel.panel(3, joint)["curves"]
        ]
        curves = CompositeCurve.joined(parts, 1e-9)
        last = np.cumsum([len(part) for part in parts])[:-1]
        assert len(last) == 4, "two loops, each with two ends"
        ends = curves.evaluate(last - 1, curves.width[last - 1], 2), curves.evaluate(last, 0 * last, 2)
        tangents, bends = [], []
        for _, first, second in ends:
            speed = np.linalg.norm(first, axis=1)[:, None]
            tangents.append(first / speed)
            across = second - tangents[-1] * (second * tangents[-1]).sum(axis=1)[:, None]
            bends.append(across / speed**2)
        assert np.abs(tangents[0] - tangents[1]).max() < 1e-6
        jump = np.linalg.norm(bends[0] - bends[1], axis=1)
        assert (jump < 1e-6).all() if joint == "curvature" else (jump > 1e-2).all()


def test_the_ball_touches_the_panel_and_nowhere_gouges_it() -> None:
    panel = example("panel")
    y = np.linspace(0.0, panel.WIDTH, 200)
    tips = panel.tool_tip(np.full_like(y, 95.0), y)
    centres = tips + np.array([0.0, 0.0, panel.TOOL_RADIUS])
    around = np.linspace(-6.0, 6.0, 61)
    for centre in centres[::10]:
        x, z = np.meshgrid(centre[0] + around, centre[1] + around)
        below = np.stack([x, z, panel.height(x, z)], axis=-1)
        assert np.linalg.norm(below - centre, axis=-1).min() == pytest.approx(panel.TOOL_RADIUS, abs=0.02)

"""Smooth paths keep the size of arcs and of bends of G1 moves, and report by how much they miss it."""

from __future__ import annotations

import json
import math
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from feedplan.cli import main
from feedplan.errors import InputError
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.geometry.path import Path
from feedplan.geometry.rules import Motion
from feedplan.machine.machine import Machine
from feedplan.planning import plan
from feedplan.program.gcode import read_gcode
from feedplan.program.program import Program
from tests.campaign import examples

Array = NDArray[np.float64]

MILL = Machine.load("mill")
# Three full circles of radius 2 mm about (8, 0), entered and left by lines at right angles to them.
HOLE = "G21 G90 G64\nG0 X0 Y0\nF600\nG1 X10\n" + 3 * "G3 X10 Y0 I-2 J0\n" + "G1 X20\nM2\n"


def program(text: str) -> Program:
    return read_gcode(text.encode(), MILL, "size.ngc")


def hole_radii(path_choice: str) -> Array:
    """Distances from the centre [mm], of setpoints on the circles at least 1 mm from the corners."""
    chunk = plan(program(HOLE), MILL, "jerk-limited", tolerance=0.1, path=path_choice).setpoints().all()
    place = chunk.position[:, :2]
    on_circle = (chunk.line >= 5) & (chunk.line <= 7) & (np.hypot(*(place - [10.0, 0.0]).T) > 1.0)
    radii: Array = np.hypot(*(place[on_circle] - [8.0, 0.0]).T)
    return radii


def test_a_hole_of_two_millimetres_is_cut_at_two_millimetres() -> None:
    radii = hole_radii("as-fitted")
    assert len(radii) > 1000
    # 2 % of the tolerance of 0.1 mm.
    np.testing.assert_allclose(radii, 2.0, rtol=0, atol=0.002)


def test_the_fastest_path_cuts_bends_and_says_so(
    tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    assert np.median(hole_radii("fastest")) < 1.93
    file = tmp_path / "hole.ngc"
    file.write_text(HOLE, encoding="utf-8")
    found = {}
    for choice in ("as-fitted", "fastest"):
        command = ["plan", str(file), "--method", "s-curve", "--tolerance", "0.1", "--path", choice]
        assert main([*command, "-o", str(tmp_path / choice)]) == 0
        # The command tells the user which side.
        assert "outside" in capsys.readouterr().out
        found[choice] = json.loads((tmp_path / choice / "plan.json").read_text(encoding="utf-8"))["fit"]
        assert "outside" in (tmp_path / choice / "report.html").read_text(encoding="utf-8")
    assert abs(found["as-fitted"]["mean_offset"]) < 0.002
    assert -0.1 < found["fastest"]["mean_offset"] < -0.05
    for fit in found.values():
        assert 0 < fit["inside"] <= fit["deviation"] <= 0.1
        assert 0 <= fit["outside"] <= fit["deviation"]
    with pytest.raises(InputError, match="'fast'"):
        plan(program(HOLE), MILL, path="fast")


def arc_of(path: Path, move: int, count: int = 300) -> Array:
    """Points of the pieces that follow a move."""
    piece = np.flatnonzero((path.move[:, 0] <= move) & (path.move[:, 1] >= move))
    piece = np.repeat(piece, count)
    part = np.tile(np.linspace(0.0, 1.0, count), len(piece) // count)
    places: Array = path.curve.evaluate(piece, part * path.width[piece], 0)[0]
    return places


@given(
    radius=st.floats(0.5, 50.0),
    sweep=st.floats(90.0, 350.0),
    tolerance=st.floats(-3.0, -1.0).map(lambda power: 10.0**power),
    touch=st.booleans(),
    climb=st.sampled_from([0.0, 0.2]),
)
@example(radius=50.0, sweep=340.0, tolerance=0.03, touch=False, climb=0.0)
@settings(max_examples=examples(60), deadline=None)
def test_arcs_of_any_size_are_followed_to_two_percent_of_the_tolerance_away_from_their_ends(
    radius: float, sweep: float, tolerance: float, touch: bool, climb: float
) -> None:
    """A line before and after touches the arc, or makes a corner of 90°, which bends the arc near its ends.

    Away from the ends means farther than 2 √(6 tolerance · radius), two intervals of the fit, or in the
    middle half.
    """
    turn = math.radians(sweep)
    assume(touch or radius * turn / 4 >= 10 * tolerance)
    end = radius * np.array([math.sin(turn), -math.cos(turn)])
    out = np.array([math.cos(turn), math.sin(turn)]) if touch else -end / radius
    start = (-1.0, -radius) if touch else (0.0, -radius + 0.4 * radius)
    last = end + out * (1.0 if touch else 0.4 * radius)
    text = (
        f"G21 G90 G64 F1000\nG0 X{start[0]:.6f} Y{start[1]:.6f} Z0\nG1 X0 Y{-radius:.6f}\n"
        f"G3 X{end[0]:.6f} Y{end[1]:.6f} Z{climb * radius:.6f} I0 J{radius:.6f}\n"
        f"G1 X{last[0]:.6f} Y{last[1]:.6f}\nM2\n"
    )
    path = build_path(program(text), MILL, tolerance, corners=Corners.SMOOTH)
    place = arc_of(path, 2)
    angle = np.mod(np.arctan2(place[:, 0], -place[:, 1]), 2 * math.pi)
    end_part = min(turn / 4, 2 * math.sqrt(6 * tolerance / radius))
    away = np.abs(angle - turn / 2) <= turn / 2 - end_part
    assert away.sum() > 50
    np.testing.assert_allclose(np.hypot(*place[away, :2].T), radius, rtol=0, atol=0.02 * tolerance + 2e-6)


def offsets(moves: Program, path: Path) -> Array:
    """Offsets [mm] of the path at the points of G1 moves that turn by less than 30°, positive outwards."""
    points = np.vstack([moves.start, moves.target])[:, :2]
    found = []
    for i in range(2, len(points) - 1):
        before, after = points[i] - points[i - 1], points[i + 1] - points[i]
        before, after = before / np.hypot(*before), after / np.hypot(*after)
        turn = abs(math.atan2(before[0] * after[1] - before[1] * after[0], float(before @ after)))
        if 1e-6 < turn < math.pi / 6:
            outwards = (before - after) / np.hypot(*(before - after))
            away = np.vstack([arc_of(path, move)[:, :2] for move in (i - 1, i)]) - points[i]
            found.append(float(away[np.hypot(*away.T).argmin()] @ outwards))
    return np.array(found)


@given(
    radius=st.floats(0.5, 50.0),
    turn=st.floats(2.0, 29.5),
    sweep=st.floats(90.0, 360.0),
    tolerance=st.floats(-3.0, -1.0).map(lambda power: 10.0**power),
    noise=st.sampled_from([0.0, 0.3]),
    seed=st.integers(0, 1000),
)
@settings(max_examples=examples(50), deadline=None)
def test_points_on_a_bend_are_within_a_tenth_of_the_tolerance_in_the_mean(
    radius: float, turn: float, sweep: float, tolerance: float, noise: float, seed: int
) -> None:
    """Chords of an arc between lines that touch it, with noise where that is far below the sagitta."""
    count = max(3, round(sweep / turn))
    angle = math.radians(turn) * np.arange(count + 1)
    off = np.zeros(count + 1)
    if noise * tolerance < 0.1 * math.radians(turn) ** 2 * radius:
        off = np.random.default_rng(seed).uniform(-noise * tolerance, noise * tolerance, count + 1)
    rows = (radius + off)[:, None] * np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    rows = np.vstack([rows[0] - [1.0, 0.0], rows, rows[-1] + [math.cos(angle[-1]), math.sin(angle[-1])]])
    lines = "\n".join(f"G1 X{x:.7f} Y{y:.7f}" for x, y in rows[1:])
    moves = program(f"G21 G90 G64 F1000\nG0 X{rows[0, 0]:.7f} Y{rows[0, 1]:.7f}\n{lines}\nM2\n")
    path = build_path(moves, MILL, tolerance, corners=Corners.SMOOTH)
    assert abs(offsets(moves, path).mean()) <= 0.1 * tolerance


def test_what_is_reported_is_what_is_measured(make_program: Any) -> None:
    """A circle of radius 5 mm in chords of 4°, at a tolerance of 0.05 mm."""
    angle = np.radians(4.0) * np.arange(91)
    moves = make_program(5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1), blend_tolerance=0.05)
    # The given motion has a constant speed: the second path cuts the bend up to the tolerance.
    straight, max_jerk = np.zeros((1, 2)), np.full(2, 1e3)
    run, start, place, speed_sq = np.array([[0, 89]]), np.array([0, 1]), np.zeros(1), np.ones(1)
    motion = Motion(run, start, place, speed_sq, straight, straight, max_jerk)
    for own in (None, motion):
        path = build_path(moves, MILL, corners=Corners.SMOOTH, motion=own)
        measured = offsets(moves, path)
        assert path.fit.mean_offset == pytest.approx(measured.mean(), abs=0.0015)
        assert path.fit.inside is not None
        assert path.fit.outside is not None
        assert path.fit.inside == pytest.approx(max(0.0, -measured.min()), abs=0.0015)
        # `outside` includes the 3 µm by which the middle of a chord is inside of the circle.
        assert path.fit.outside >= max(0.0, measured.max()) - 1e-4
    rounded = build_path(moves, MILL)
    assert rounded.fit.mean_offset is None

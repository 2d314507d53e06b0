"""Paths fitted to a plan's speed: never slower, within the tolerance, the faster one in each section."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.cli.terminal import gain_text
from feedplan.errors import InputError
from feedplan.machine.machine import Axis, Machine
from feedplan.planning import Plan, plan
from feedplan.program.gcode import read_gcode
from tests.campaign import seeds

FAST = Machine("fast", tuple(Axis(name, 250.0, 3000.0, max_jerk=5e4) for name in "XY"), period=0.0005)
SLOW = Machine("slow", tuple(Axis(name, 100.0, 500.0, max_jerk=5e4) for name in "XY"), period=0.0005)
CORNER = "G1 X10\nG1 Y10\n"


def made(lines: str, machine: Machine = FAST, method: Any = "jerk-limited", **options: Any) -> Plan:
    text = f"G21 G90 G64\nF60000\nG1 X0 Y0\n{lines}M2\n"
    return plan(read_gcode(text.encode(), machine, "lines.ngc"), machine, method, **options)


def distances(found: Plan, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances of setpoints from the polyline [mm]."""
    places = found.setpoints().all().position[:, None, :]
    start, way = points[:-1], np.diff(points, axis=0)
    along = np.clip(((places - start) * way).sum(axis=2) / (way**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(places - start - along[..., None] * way, axis=2).min(axis=1))


def test_a_corner_is_passed_sooner_the_more_the_path_may_leave_it() -> None:
    # The least times when path and speed are optimised together: 0.3408, 0.3216 and 0.3107 s.
    corner = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    for tolerance, most in ((0.01, 0.345), (0.05, 0.329), (0.1, 0.319)):
        found = made(CORNER, tolerance=tolerance, path="fastest")
        assert found.time < most
        assert found.audit().ok
        assert distances(found, corner).max() <= tolerance


def test_a_turn_of_170_degrees_is_no_stop() -> None:
    turn = "G1 X10\nG1 X0.151922 Y1.736482\n"
    first, found = made(turn, tolerance=0.05), made(turn, tolerance=0.05, path="fastest")
    assert len(first.path.runs) == 3
    assert len(found.path.runs) == 2
    assert found.time < 0.3200 < 0.37 < first.time
    assert found.audit().ok


def test_each_section_between_stops_follows_the_faster_path() -> None:
    """A line, which cannot become faster, and a corner, with a pause between them."""
    lines = "G1 X-20\nG4 P0.1\nG1 X-10\nG1 Y10\n"
    first, found = made(lines, tolerance=0.05), made(lines, tolerance=0.05, path="fastest")
    assert found.gain is not None
    assert (found.gain.sections, found.gain.faster) == (2, 1)
    assert found.gain.times == (pytest.approx(first.time, rel=1e-12), pytest.approx(found.time, rel=1e-12))
    # The line is the one of the first plan, piece by piece.
    assert found.profile.run_times[0] == first.profile.run_times[0]
    assert found.profile.run_times[1] < 0.9 * first.profile.run_times[1]
    pieces = int(first.path.runs[1])
    np.testing.assert_array_equal(
        found.path.curve[:pieces].control_points, first.path.curve[:pieces].control_points
    )
    assert found.audit().ok
    assert found.lower_bound <= found.time
    assert found.summary()["gain"]["gained"] == pytest.approx(first.time - found.time)
    assert found.at(found.time).position == pytest.approx([-10.0, 10.0])


def test_where_the_feed_governs_there_is_no_second_plan() -> None:
    found = made("F60\n" + CORNER, tolerance=0.05, path="fastest")
    assert found.gain is not None
    assert found.gain.times == (found.time,)
    assert found.gain.faster == 0


def test_the_path_as_fitted_is_that_of_the_program_alone() -> None:
    control = [made(CORNER, machine, tolerance=0.05).path.curve.control_points for machine in (FAST, SLOW)]
    np.testing.assert_array_equal(*control)
    assert made(CORNER, tolerance=0.05).gain is None


def test_bang_bang_takes_the_smooth_path_on_noise() -> None:
    random = np.random.default_rng(3)
    x = np.concatenate(([0.0], np.cumsum(random.uniform(0.15, 0.6, 60))))
    form = 1.5 * np.sin(2.0 * np.pi * x / 12.0) + 0.3 * np.sin(2.0 * np.pi * x / 3.1)
    y = form + 0.005 * random.standard_normal(61)
    lines = "".join(f"G1 X{a:.6f} Y{b:.6f}\n" for a, b in zip(x[1:], y[1:] - y[0], strict=True))
    options = {"machine": SLOW, "method": "bang-bang", "tolerance": 0.05}
    first, one, three = (
        made(lines, **options, **more)
        for more in ({}, {"path": "fastest"}, {"path": "fastest", "path_rounds": 3})
    )
    assert one.time < 0.95 * first.time
    # The least time when path and speed are optimised together is 0.880 s.
    assert three.time < 0.925
    for found in (one, three):
        assert found.audit().ok


def test_steps_along_the_gradient_keep_what_they_promise() -> None:
    turn = "G1 X10\nG1 X2.928932 Y7.071068\n"
    one, three = (made(turn, tolerance=0.05, path="fastest", path_rounds=k) for k in (1, 3))
    assert one.gain is not None
    assert three.gain is not None
    assert one.gain.promised == ()
    assert three.gain.times[:2] == one.gain.times
    assert list(three.gain.times) == sorted(three.gain.times, reverse=True)
    # Each step that was taken has the gain that was promised for it; one more step is promised but not taken.
    assert len(three.gain.promised) == 3
    assert len(three.gain.times) == 4
    assert all(promised >= 0.0 for promised in three.gain.promised)
    saved = one.time - three.gain.times[2]
    assert 0.3 * three.gain.promised[0] < saved < 3.0 * three.gain.promised[0]
    assert three.summary()["gain"]["promised"] == three.gain.promised
    assert three.audit().ok


def test_two_steps_round_the_facets_of_a_circle_within_the_tolerance() -> None:
    # Chords of 0.3 mm, 0.01 mm from the circle; least time with path and speed optimised together: 0.329 s.
    count = 24
    angle, radius = np.arange(count + 1) * 2.0 * np.pi / count, 0.3**2 / 0.08 + 0.005
    points = np.round(radius * np.column_stack((np.sin(angle), 1.0 - np.cos(angle))), 6)
    lines = "".join(f"G1 X{x:.6f} Y{y:.6f}\n" for x, y in points[1:])
    found = made(lines, SLOW, tolerance=0.05, path="fastest", path_rounds=3)
    assert found.gain is not None
    assert found.time < 0.3325 < 0.98 * found.gain.times[1]
    assert found.audit().ok
    assert distances(found, points).max() <= 0.05


def test_rounds_are_one_to_three() -> None:
    turn = "G1 X10\nG1 X2.928932 Y7.071068\n"
    for wrong in (0, 4, 1.5):
        with pytest.raises(InputError, match="path_rounds"):
            made(turn, path="fastest", path_rounds=wrong)
    with pytest.raises(InputError, match="path_rounds is 2: give it with the path fastest, or leave it out"):
        made(turn, path_rounds=2)


@pytest.mark.parametrize("method", ["linuxcnc", "junction-deviation"])
def test_a_method_with_one_path_says_so(method: str) -> None:
    turn = "G1 X10\nG1 X2.928932 Y7.071068\n"
    says = f"the method {method} knows one path only: the path fastest is the path as-fitted"
    assert says in made(turn, method=method, path="fastest").warnings
    assert says not in made(turn, method=method).warnings
    assert not any("as-fitted" in own for own in made(turn, path="fastest").warnings)


def test_the_gain_is_told_in_words() -> None:
    told = {"times": [2.0, 1.5], "promised": [], "sections": 4, "faster": 1}
    start = "2.000 s → 1.500 s; the last fit is faster in 1 of 4 sections"
    assert gain_text(told) == start
    assert gain_text(told | {"promised": [0.1]}) == f"{start}; a step along the gradient promises 100.0 ms"
    steps = "the steps promised 200.0 ms, one more promises 100.0 ms"
    assert gain_text(told | {"promised": [0.2, 0.1]}) == f"{start}; {steps}"


@pytest.mark.parametrize("seed", range(seeds(6)))
def test_no_section_of_a_random_program_is_slower_or_beyond_its_tolerance(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, lines = [np.zeros(2)], ""
    for _ in range(int(random.integers(5, 25))):
        heading = random.uniform(0.0, 2.0 * np.pi)
        points.append(
            points[-1] + random.choice([0.1, 1.0, 8.0]) * np.array([np.cos(heading), np.sin(heading)])
        )
        points[-1] = np.round(points[-1], 6)
        kind = random.choice(["G0", "G1", "G1", "G1"])
        lines += f"{kind} X{points[-1][0]:.6f} Y{points[-1][1]:.6f}\n" + random.choice(["", "", "G4 P0.01\n"])
    machine = random.choice([FAST, SLOW])
    method = str(random.choice(["jerk-limited", "bang-bang", "s-curve"]))
    rounds = int(random.integers(1, 4))
    tolerance = float(random.choice([0.01, 0.1]))
    first = made(lines, machine, method, tolerance=tolerance)
    found = made(lines, machine, method, tolerance=tolerance, path="fastest", path_rounds=rounds)
    assert found.gain is not None
    assert found.time <= first.time * (1.0 + 1e-12)
    assert list(found.gain.times) == sorted(found.gain.times, reverse=True)
    assert found.audit().ok, found.audit()
    assert distances(found, np.array(points)).max() <= tolerance
    assert found.path.fit.deviation <= tolerance * (1.0 + 1e-9)
    assert (found.path.move[1:, 0] >= found.path.move[:-1, 0]).all()
    assert found.at(found.time).position == pytest.approx(points[-1], abs=1e-9)

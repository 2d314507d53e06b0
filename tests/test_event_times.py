"""Events happen at the tool's place and in the order of the program, both in the plan and in setpoints."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feedplan import Axis, Machine, Path, plan

# 50 mm/s is reached in 0.1 s over 2.5 mm.
AXES = [Axis(name, max_velocity=100.0, max_acceleration=500.0, max_jerk=50_000.0) for name in "XYZ"]
MACHINE = Machine("bench", AXES, period=0.004)
FEED = "F3000"
METHODS = ["bang-bang", "jerk-limited", "arc-transition", "junction-deviation", "s-curve", "tangential"]


def planned(text: str, method: Any = "bang-bang", machine: Machine = MACHINE, **options: Any) -> Any:
    limit = {"time_limit": 0.0} if method == "jerk-limited" else {}
    return plan(f"G21 G90 {FEED}\n{text}\n", machine, method, **limit, **options)


def rows(made: Any) -> list[tuple[float, str]]:
    return [(round(event.time, 9), event.text) for event in made.events]


def test_at_stops_events_and_dwells_follow_each_other() -> None:
    # 10 mm: 0.1 s up, 0.1 s at 50 mm/s, 0.1 s down.
    made = planned(
        "(part 7)\nT3 M6\nG4 P0.25\nS8000 M3\nG1 X10\nM5\nG4 P0.5\n(MSG, turn it)\nM0\nM4 S100\n"
        "G4 P0.125\nM8\nX0\nM9\nM2"
    )
    assert rows(made) == [
        (0.0, "part 7"),
        (0.0, "T3"),
        (0.0, "M6 P3"),
        (0.0, "G4 P0.25"),
        (0.25, "S8000"),
        (0.25, "M3"),
        (0.55, "M5"),
        (0.55, "G4 P0.5"),
        (1.05, "turn it"),
        (1.05, "M0"),
        (1.05, "S100"),
        (1.05, "M4"),
        (1.05, "G4 P0.125"),
        (1.175, "M8"),
        (1.475, "M9"),
        (1.475, "M2"),
    ]
    assert made.time == pytest.approx(1.475, abs=1e-12)


def test_what_events_do() -> None:
    made = planned(
        "S500\nT4\nM3\nS600\nM4\nM5\nM7\nM8\nM9\nM62 P2\nM63 P2\nM64 P1\nM65 P1\nM67 E3 Q0.5\nM68 E3 Q1\n"
        "M66 P1 L3 Q2\nM61 Q9\nM428\nM1\nM60\n;note\nG1 X1\nM30"
    )
    said = [(event.kind, event.channel, event.value, event.stops) for event in made.events]
    nan = math.nan
    expected = [
        ("spindle", nan, 0.0, False),
        ("select", nan, 4.0, False),
        ("spindle", nan, 500.0, True),
        ("spindle", nan, 600.0, False),
        ("spindle", nan, -600.0, True),
        ("spindle", nan, 0.0, True),
        ("coolant", nan, 1.0, True),
        ("coolant", nan, 3.0, True),
        ("coolant", nan, 0.0, True),
        ("output", 2.0, 1.0, False),
        ("output", 2.0, 0.0, False),
        ("output", 1.0, 1.0, True),
        ("output", 1.0, 0.0, True),
        ("analog", 3.0, 0.5, False),
        ("analog", 3.0, 1.0, True),
        ("input", 1.0, 2.0, True),
        ("tool", nan, 9.0, False),
        ("other", nan, 428.0, True),
        ("stop", nan, 1.0, True),
        ("stop", nan, 60.0, True),
        ("comment", nan, nan, False),
        ("stop", nan, 30.0, True),
    ]
    for found, wanted in zip(said, expected, strict=True):
        assert (found[0], found[3]) == (wanted[0], wanted[3])
        np.testing.assert_array_equal(found[1:3], wanted[1:3])
    assert [event.line for event in made.events] == [2, 3, 4, *range(5, 21), 21, 22, 24]


STOPPING = ["M0", "M1", "M60", "M3", "M4", "M5", "M6 T1", "M7", "M8", "M9", "M64 P0", "M65 P0"]
STOPPING += ["M66 P0 L0", "M68 E0 Q1", "M19", "G4 P0", "M428", "M117 hello"]
PASSING = ["M62 P0", "M63 P0", "M67 E0 Q1", "S900", "T2", "M61 Q2", "(comment)", "; comment", "(MSG, look)"]


@pytest.mark.parametrize("word", STOPPING + PASSING)
def test_the_tool_stops_for_an_event_just_where_it_says(word: str) -> None:
    made = planned(f"S100 M3\nG64 P0.01\nG1 X10\n{word}\nX20\nM2")
    own = [event for event in made.events if event.line == 5]
    assert own
    stops = any(event.stops for event in own)
    assert stops is (word in STOPPING)
    assert len(made.path.runs) - 1 == (2 if stops else 1)
    # 20 mm in one run: 0.1 s up, 0.3 s, 0.1 s down.
    assert made.time == pytest.approx(0.6 if stops else 0.5, abs=1e-9)
    for event in own:
        assert event.time == pytest.approx(0.3 if stops else 0.25, abs=1e-9)
        state = made.at(event.time)
        assert state.position[0] == pytest.approx(10.0, abs=1e-9)
        assert np.abs(state.velocity).max() == pytest.approx(0.0 if stops else 50.0, abs=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_at_a_rounded_corner_an_event_is_at_the_nearest_place(method: Any) -> None:
    made = planned("G64 P0.1\nG1 X10\nM62 P1\nY10\nM2", method)
    event = made.events.time[0]
    assert 0.1 < event < made.time - 0.1
    times = event + np.linspace(-2e-3, 2e-3, 4001)
    away = np.linalg.norm(made.at(times).position - [10.0, 0.0, 0.0], axis=1)
    nearest = np.linalg.norm(made.at(event).position - [10.0, 0.0, 0.0])
    assert nearest <= 0.1 + 1e-9
    assert nearest <= away.min() + 1e-9


def curve_of_points(count: int, words: str) -> str:
    angles = np.linspace(0.0, 4.0, count)
    points = zip(20.0 * np.sin(angles), 3.0 * angles, strict=True)
    return "\n".join(f"G1 X{x:.4f} Y{y:.4f}\n{words.format(k=k)}" for k, (x, y) in enumerate(points))


@pytest.mark.parametrize("method", METHODS)
def test_events_along_fitted_points_change_no_plan_and_are_at_the_points(method: Any) -> None:
    text = "G64 P0.02\nM3\n{}\nM2"
    made = planned(text.format(curve_of_points(80, "M67 E0 Q{k}")), method)
    without = planned(text.format(curve_of_points(80, "")), method)
    assert made.time == without.time
    assert len(made.path.runs) == len(without.path.runs)
    events = [event for event in made.events if event.kind == "analog"]
    assert [event.value for event in events] == list(range(80))
    times = np.array([event.time for event in events])
    assert (np.diff(times) > 0).all()
    # The first point is the start of the program.
    targets = np.concatenate((made.program.start[None], made.program.target))
    assert len(targets) == 80
    away = np.linalg.norm(made.at(times).position - targets, axis=1)
    assert away.max() <= 0.02 + 1e-9
    for near in (-2e-4, 2e-4):
        there = np.clip(times + near, 0.0, made.time)
        assert (np.linalg.norm(made.at(there).position - targets, axis=1) >= away - 1e-9).all()


def test_the_clock_of_setpoints_waits_and_the_events_with_it() -> None:
    # Runs of 0.3 s and √(4 · 3.3/500) s: the second one is no whole number of periods.
    made = planned("G1 X10\nM8\nG4 P0.0011\nM9\nX13.3\nM62 P0\nM5\nG4 P0.01\nY10\nM2")
    points = made.setpoints()
    own, waiting = made.events.time, points.events.time
    short = math.sqrt(4 * 3.3 / 500)
    after = 0.304 + math.ceil(round((short + 0.01) / 0.004, 6)) * 0.004
    expected = [0.3, 0.3, 0.3011, 0.304 + short, 0.304 + short, 0.304 + short, after + 0.3]
    np.testing.assert_allclose(waiting, expected, atol=1e-9)
    plans = [0.3, 0.3, 0.3011, *[0.3011 + short] * 3, 0.3011 + short + 0.01 + 0.3]
    np.testing.assert_allclose(own, plans, atol=1e-9)
    assert waiting[-1] <= points.duration + 1e-9
    assert points.duration - after - 0.3 < 0.004
    # At the first setpoint at or after an event that stops, the tool is at rest.
    chunk = points.all()
    for event in points.events:
        at = int(np.searchsorted(chunk.t, event.time - 1e-12))
        if event.stops:
            assert np.abs(chunk.velocity[at]).max() < 1e-9, event
        until = event.time + (event.value if event.kind == "dwell" else 0.0)
        held = chunk.position[at : max(at + 1, int(np.searchsorted(chunk.t, until + 1e-12, "right")))]
        assert np.ptp(held, axis=0).max() < 1e-12, event


def test_where_words_are_the_tip_events_are_where_the_tip_is() -> None:
    made = planned(
        "G64 P0.05\nG0 X100 Y0 Z10\nM3\nG1 X100 Y40\nM62 P1\nX60 Y60\nM63 P1\nX60 Y0\nM5\nM2",
        machine=Machine.load("cylindrical"),
    )
    passing = [event for event in made.events if event.kind == "output"]
    assert len(passing) == 2
    inverse = made.machine.inverse
    for event, tip in zip(passing, ((100.0, 40.0), (60.0, 60.0)), strict=True):
        joints = made.at(event.time).position
        found = np.asarray(inverse.tip(joints), dtype=np.float64).ravel()[:2]
        assert np.abs(found - tip).max() <= 0.05 + 1e-6
        assert np.abs(made.at(event.time).velocity).max() > 1.0
    assert made.events.time[-1] == pytest.approx(made.time, abs=1e-9)


def test_a_path_has_no_events_and_a_plan_can_be_pickled_with_its_own() -> None:
    line = plan(Path.from_points([[0, 0], [10, 0]], 0.01, axes=["X", "Y"]), MACHINE)
    assert len(line.events) == len(line.setpoints().events) == 0
    made = planned("M3\nG1 X10\nM5\nM2")
    assert "4 events" not in repr(made.events)
    assert repr(made.events) == "<3 events: 2 spindle, 1 stop>"
    assert made.account is not None  # makes its table of lengths again
    again = pickle.loads(pickle.dumps(made))
    assert again.account.to_json() == made.account.to_json()
    assert again.events.sha256() == made.events.sha256()
    points = pickle.loads(pickle.dumps(made.setpoints()))
    assert points.events.sha256() == made.setpoints().events.sha256()


MOVES = st.one_of(
    st.tuples(st.integers(0, 12), st.integers(0, 12)).map(lambda p: f"G1 X{p[0]} Y{p[1]}"),
    st.tuples(st.integers(0, 12), st.integers(0, 12)).map(lambda p: f"G0 X{p[0]} Y{p[1]}"),
    st.sampled_from(["G64 P0.1", "G64 P0.01 Q0.05", "G61", "G61.1", "G91 G3 X2 I1", "G90 G2 X3 Y3 R20"]),
    st.sampled_from(["M62 P1", "M67 E0 Q1", "S50", "(remark)", "T2"]),
    st.sampled_from(["M3", "M0", "G4 P0.01", "G4 P0", "M6 T1", "M8"]),
)


@given(lines=st.lists(MOVES, max_size=25), method=st.sampled_from(METHODS[:3]))
@settings(max_examples=60)
def test_events_of_any_program_are_in_its_order_and_within_its_time(lines: list[str], method: Any) -> None:
    made = planned("\n".join(["G1 Z1", *lines, "G90", "M2"]), method)
    words = made.program.events
    points = made.setpoints()
    for events, end in ((made.events, made.time), (points.events, points.duration)):
        assert [event.text for event in events] == [word.strip("()") for word in words.words()]
        np.testing.assert_array_equal(events.line, words.line)
        assert (np.diff(events.time, prepend=0.0) >= 0.0).all()
        assert (events.time <= end + 1e-9).all()
    states = made.at(np.minimum(made.events.time, made.time))
    assert np.abs(states.velocity[made.events.stops]).max(initial=0.0) <= 1e-6
    ends = np.concatenate((made.program.start[None], made.program.target))[words.move]
    assert np.linalg.norm(states.position - ends[:, :3], axis=1).max(initial=0.0) <= 0.1 + 1e-6
    pauses = made.events.value[made.events.kind == "dwell"].sum()
    assert pauses == pytest.approx(made.path.pauses, abs=1e-12)

"""LinuxCNC's simulator runs a program, the program with planned feeds, and the stream of the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import feedplan
from benchmarks.simulator.__main__ import MACHINE, greatest_distance, places, prepared
from benchmarks.simulator.alone import alone, missing
from benchmarks.simulator.session import Run, SimulatorError, recorded
from feedplan.machine.controller import Controller
from feedplan.program.program import Program
from feedplan.today import time_by
from tests.planners import controller_programs

TOLERANCE = 0.05
# Corners of many angles, a tool change and a pause.
_LINES = controller_programs.zigzag(TOLERANCE).splitlines()
PROGRAM = "\n".join(["T1 M6", *_LINES[:7], "M3 S1000", "G4 P0.2", *_LINES[7:12], "M5", "M2", ""])


def simulated(runs: list[Run]) -> list:
    reason = missing() or (None if alone() else "the simulator needs processes of its own (unshare, as root)")
    if reason is not None:
        pytest.skip(reason)
    try:
        return recorded(MACHINE, runs, TOLERANCE)
    except SimulatorError:  # the simulator runs in real time, which a busy computer may not allow
        return recorded(MACHINE, runs, TOLERANCE)


def model(program: Program) -> float:
    return time_by(Controller("linuxcnc"), program, MACHINE, None)


def test_the_simulator_takes_the_models_time_and_plays_the_stream_to_the_last_bit(tmp_path: Path) -> None:
    plan = feedplan.plan(PROGRAM, MACHINE)
    rewritten = feedplan.planned_program(plan)
    assert rewritten.changed > 3
    again = feedplan.read_program(rewritten.content, MACHINE)
    feedplan.write_plan(plan, tmp_path, ["halstreamer"])
    assert plan.program is not None
    first, second, third = simulated(
        [Run(PROGRAM.encode(), 2.0), Run(rewritten.content, 2.0), Run(tmp_path / "setpoints.halstream", 2.0)]
    )
    pauses = plan.path.pauses
    assert pauses > 0.0
    assert first.motion + pauses == pytest.approx(model(plan.program), rel=0.05)
    assert second.motion + pauses == pytest.approx(model(again), rel=0.05)
    setpoints = plan.setpoints().all()
    np.testing.assert_array_equal(third.played, setpoints.position)
    # Each stop is delayed to a whole period and costs less than one period.
    assert 0.0 <= setpoints.t[-1] - plan.time < MACHINE.period * (len(plan.path.runs) + 1)
    assert setpoints.t[-1] < first.motion + pauses
    way = places(plan.program, MACHINE)
    # LinuxCNC joins lines and rounds corners, each within P.
    for run in (first, second):
        assert greatest_distance(run.position[run.moving], way) < 2.0 * TOLERANCE
    assert greatest_distance(third.played, way) < 1.001 * TOLERANCE


def test_a_refusal_of_the_interpreter_is_reported() -> None:
    with pytest.raises(SimulatorError, match=r"run 1 of 1 failed: LinuxCNC says: Unknown g code"):
        simulated([Run(b"G21 G90\nG1 F600 X1\nG77.7 X2\nM2\n", 1.0)])


def test_programs_are_prepared_by_their_words_alone() -> None:
    text = b"(F1 G64) G20 G64 F.5 ; F2\nG1 X1 f12 G64 P0.1\nG64.1\n"
    assert prepared(text, 10.0, 0.0254) == (
        b"(F1 G64) G20 G64 P0.001000 F5. ; F2\nG1 X1 f120. G64 P0.1\nG64.1\n"
    )

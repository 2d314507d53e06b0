"""The time of a plan of a whole program, with its pauses, and the computing time of each stage."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest

from feedplan.audit import audit
from feedplan.machine.machine import Machine
from feedplan.planning import Plan, plan

MILL = Machine.load("mill")
PROGRAM = """G21 G90 G64 P0.01
{pause}
G1 X10 F3000
X20 Y10
G4 P0.25
X30
M2
"""


@pytest.fixture
def planned(tmp_path: FilePath) -> dict[str, Plan]:
    """The program with and without a pause of 1.5 s before the first move."""
    plans = {}
    for name, pause in (("late", "G4 P1.5"), ("prompt", "")):
        file = tmp_path / f"{name}.ngc"
        file.write_text(PROGRAM.format(pause=pause))
        plans[name] = plan(file, MILL)
    return plans


def test_a_pause_before_the_first_move_counts_like_any_other(planned: dict[str, Plan]) -> None:
    late, prompt = planned["late"], planned["prompt"]
    assert late.path.pauses == 1.75
    assert late.time == pytest.approx(prompt.time + 1.5, rel=1e-15)
    assert late.lower_bound == pytest.approx(prompt.lower_bound + 1.5, rel=1e-15)
    assert late.warnings == prompt.warnings
    chunk = late.setpoints().all()
    waiting = round(1.5 / MILL.period)
    assert (chunk.position[: waiting + 1] == chunk.position[0]).all()
    assert (chunk.position[waiting + 1] != chunk.position[0]).any()
    assert chunk.t[-1] == pytest.approx(prompt.setpoints().duration + 1.5, rel=1e-12)


def test_the_audit_expects_the_pause_before_the_first_move(planned: dict[str, Plan]) -> None:
    late = planned["late"]
    assert late.audit().ok
    # The same setpoints with half of the pause, and with no pause.
    for pause in (0.75, 0.0):
        path = replace(late.path, start_dwell=pause)
        hasty = replace(late, problem=replace(late.problem, path=path)).setpoints()
        assert not audit(late.problem, late.profile, MILL, late.program, hasty).ok
    # With this period the pause does not end at a setpoint.
    slow = late.setpoints(period=0.0037)
    assert audit(late.problem, late.profile, MILL.with_period(0.0037), late.program, slow).ok
    assert np.isclose(slow.duration, late.time, atol=3 * 0.0037)


def test_the_time_of_reading_is_told_where_the_plan_reads(planned: dict[str, Plan]) -> None:
    prompt = planned["prompt"]
    assert list(prompt.compute)[:3] == ["read", "fit", "plan"]
    assert list(plan(prompt.program, MILL).compute)[:2] == ["fit", "plan"]

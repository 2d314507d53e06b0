"""The stream for LinuxCNC's halstreamer, played by LinuxCNC itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.simulator.alone import missing
from feedplan import Machine, plan
from feedplan.outputs import load_setpoints
from feedplan.plan_folder import write_plan
from tests.outputs import hal

PROGRAM = """G21 G90 G64 P0.05
(a pocket, with a remark that is longer than a line of text may be for a reader of lines: {long})
T1 M6
S8000 M3
F2400
G1 X20 Y5 Z-1
G3 X10 Y15 I-5 J5
M62 P1
G1 X0 Y10
G4 P0.05
Y0 M67 E0 Q0.25
M5
M2
"""


def test_linuxcnc_plays_the_stream_to_the_last_bit(tmp_path: Path) -> None:
    reason = missing()
    if reason is not None:
        pytest.skip(reason)
    text = PROGRAM.format(long=5000 * "x")
    made = plan(text, Machine.load("mill"))
    write_plan(made, tmp_path, ["halstreamer"])
    file = tmp_path / "setpoints.halstream"
    setpoints = made.setpoints().all()
    assert 500 < len(setpoints) < hal.DEPTH
    rows = [row.split() for row in hal.played(file, "fffs", len(setpoints), tmp_path)]
    np.testing.assert_array_equal([[float(value) for value in row[:3]] for row in rows], setpoints.position)
    assert [int(row[3]) for row in rows] == setpoints.line.tolist()
    # The file has the events of the plan.
    assert load_setpoints(file).events.sha256() == made.setpoints().events.sha256()

"""Random programs by the jerk-limited method, from text to setpoints: no limit is exceeded."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from feedplan import plan
from feedplan.audit import audit
from tests.planners.random_programs import random_machine, random_program

SEEDS = int(os.environ.get("FEEDPLAN_SEEDS", "24"))
# They are run in so many parts, beside each other.
PARTS = 4
# Setpoints are made of programs that take no longer [s].
LONGEST = 60.0


@pytest.mark.parametrize("part", range(PARTS))
def test_random_programs_keep_every_limit(part: int, tmp_path: Path) -> None:
    found = [fault for seed in range(part, SEEDS, PARTS) for fault in faults_of(seed, tmp_path)]
    assert found == []


def faults_of(seed: int, folder: Path) -> list[str]:
    """What the audit says of a random program, by its profile and by its setpoints."""
    program = folder / f"{seed}.ngc"
    program.write_text(random_program(seed))
    machine = random_machine(seed)
    planned = plan(program, machine, method="jerk-limited")
    points = planned.setpoints() if planned.time <= LONGEST else None
    verdict = audit(planned.problem, planned.profile, machine, planned.program, points, jerk=True)
    return [f"{seed}: {sentence}" for sentence in verdict.failures]

"""Random programs, from text to setpoints: no limit is exceeded."""

from __future__ import annotations

from pathlib import Path

import pytest

from feedplan import plan
from feedplan.planners import limits_jerk
from tests.campaign import seeds
from tests.planners.audited import audited
from tests.planners.random_programs import random_machine, random_program

SEEDS = seeds(4)
# The seeds are divided into this many tests, which can run in parallel.
PARTS = 4


@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited", "ruckig", "s-curve"])
@pytest.mark.parametrize("part", range(PARTS))
def test_random_programs_keep_every_limit(part: int, method: str, tmp_path: Path) -> None:
    found = []
    for seed in range(part, SEEDS, PARTS):
        program = tmp_path / f"{seed}.ngc"
        program.write_text(random_program(seed))
        machine = random_machine(seed)
        planned = plan(program, machine, method=method)
        jerk = limits_jerk(method)
        broken = audited(planned.problem, planned.profile, machine, planned.program, jerk)
        found += [f"{seed}: {sentence}" for sentence in broken]
    assert found == []

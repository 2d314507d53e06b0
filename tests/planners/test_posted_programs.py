"""Programs as shops post them, from text to setpoints: checked by the audit and by plain differences."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from feedplan import plan
from feedplan.errors import FeedplanError
from feedplan.planners import limits_jerk
from tests.campaign import seeds
from tests.planners.differences import beside_the_path, exceeded, too_fast
from tests.planners.posted_programs import posted_program

SEEDS = seeds(4)
# The seeds are divided into this many tests, which can run in parallel.
PARTS = 2
# Time for which ruckig may improve the states between its segments [s]; its first states are a plan already.
TIME_LIMITS = {"ruckig": 0.2}
# A program with more setpoints is planned again with a longer period that gives this number.
MOST_SETPOINTS = 60_000


@pytest.mark.parametrize("method", ["bang-bang", "jerk-limited", "ruckig", "s-curve"])
@pytest.mark.parametrize("part", range(PARTS))
def test_posted_programs_keep_every_limit(part: int, method: str, tmp_path: Path) -> None:
    found = []
    for seed in range(part, SEEDS, PARTS):
        found += [f"{seed}: {sentence}" for sentence in faults(seed, method, tmp_path)]
    assert found == []


def faults(seed: int, method: str, folder: Path) -> list[str]:
    """What is wrong with the plan of a seed's program by a method."""
    posted = posted_program(seed)
    file = folder / f"{seed}.ngc"
    file.write_text(posted.text)
    try:
        made = plan(file, posted.machine, method=method, time_limit=TIME_LIMITS.get(method))
        if made.time > MOST_SETPOINTS * posted.machine.period:
            longer = posted.machine.with_period(made.time / MOST_SETPOINTS)
            posted = replace(posted, machine=longer)
            made = plan(file, longer, method=method, time_limit=TIME_LIMITS.get(method))
        made.audit()
    except FeedplanError as error:
        return [str(error)]
    points = made.setpoints().all()
    period = posted.machine.period
    return [
        *made.audit().failures,
        *([] if made.lower_bound <= made.time else [f"bound {made.lower_bound} above {made.time} s"]),
        *exceeded(points, posted.machine, period, limits_jerk(method)),
        *too_fast(points, posted, period),
        *beside_the_path(points, posted),
    ]


# A table of lengths that was right only half-way (241, 775, 823); a jerk that changes within half a
# micrometre (1863).
@pytest.mark.parametrize("seed", [241, 775, 823, 1863])
def test_programs_that_broke_a_limit_of_jerk(seed: int, tmp_path: Path) -> None:
    assert faults(seed, "jerk-limited", tmp_path) == []


# At a long servo period, sections shorter than 1e-7 of it were left out of short phases.
@pytest.mark.parametrize(("seed", "method"), [(371, "s-curve"), (1343, "ruckig")])
def test_programs_at_long_periods_whose_recorded_durations_were_wrong(
    seed: int, method: str, tmp_path: Path
) -> None:
    assert faults(seed, method, tmp_path) == []


def test_the_checks_can_fail(tmp_path: Path) -> None:
    posted = posted_program(3)
    file = tmp_path / "part.ngc"
    file.write_text(posted.text)
    made = plan(file, posted.machine)
    points, period = made.setpoints().all(), posted.machine.period
    quick = replace(points, position=points.position.copy())
    quick.position[len(points) // 2 :] += 10 * posted.tolerance
    assert exceeded(quick, posted.machine, period, jerk=False)
    assert beside_the_path(quick, posted)
    fastest = np.linalg.norm(np.diff(points.position, axis=0), axis=1).max() / period
    assert too_fast(points, replace(posted, linear=dict.fromkeys(posted.linear, 0.99 * fastest)), period)

"""Runs that are planned separately equal those of the whole plan, bit for bit, and plans are reproducible."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.progress import Listener

ROWS = "\n".join(f"X{k * 7 % 31}.{k % 10} Y{k * 5 % 23} Z{5 + 0.1 * (k % 4):.1f}" for k in range(20))
CORNERS = f"G21 G90 G64 P0.01\nF3000\nG1 {ROWS}\nG2 X40 Y10 R30\nG61.1 G1 X50\nY20\nG64 X0 Y0\nM2\n"
TIP = (
    "G21 G90 G94 G64 P0.01 F2000\nT1 M6 G43.4 H1\nG0 X0 Y0 Z20 A0 C0\n"
    + "\n".join(f"G1 X{2 * k} Y{k % 5} A{3 * (k % 7)} C{5 * k}" for k in range(1, 8))
    + "\nG0 Z40\nG4 P0.1\nG1 X0 Y0 Z20 A0 C0\nG49\nM2\n"
)


class Others:
    """Works on `parts` at a time, on copies such as a connection to another computer makes."""

    def __init__(self, parts: int) -> None:
        self._parts, self.given = parts, 0

    def count(self) -> int:
        return self._parts

    def map(
        self, work: Callable[..., Any], given: Sequence[tuple[Any, ...]], progress: Listener | None
    ) -> list[Any]:
        self.given = len(given)
        work, copies = pickle.loads(pickle.dumps((work, given)))
        return [pickle.loads(pickle.dumps(work(*arguments, lambda _: None))) for arguments in copies]


@pytest.mark.parametrize(
    ("program", "machine"),
    [(CORNERS, "mill"), (TIP, "trunnion-ac")],
    ids=["mill", "tip"],
)
def test_parts_make_the_whole_bit_for_bit(program: str, machine: str) -> None:
    def made(**more: Any) -> feedplan.Plan:
        return feedplan.plan(program, machine, "jerk-limited", accuracy=0.1, start_speed=1.0, **more)

    here = made()
    for count in (2, 1000):
        others = Others(count)
        there = made(elsewhere=others)
        assert 1 < others.given <= min(count, len(here.path.runs) - 1)
        for name in here.profile.__dataclass_fields__:
            own, other = getattr(here.profile, name), getattr(there.profile, name)
            assert np.array_equal(own, other), name
            assert np.asarray(own).dtype == np.asarray(other).dtype, name
        summaries = [json.loads(json.dumps(each.summary())) for each in (here, there)]
        for summary in summaries:
            del summary["compute"]
        assert summaries[0] == summaries[1]


def test_a_path_of_one_run_stays_here() -> None:
    others = Others(4)
    feedplan.plan("G21 G90 F600\nG1 X10\nM2\n", "mill", "jerk-limited", elsewhere=others)
    assert others.given == 0


def test_a_fault_of_a_part_is_that_of_the_whole() -> None:
    said = []
    for more in ({}, {"elsewhere": Others(5)}):
        with pytest.raises(feedplan.InfeasibleError) as caught:
            feedplan.plan(CORNERS, "mill", "jerk-limited", end_speed=400.0, **more)  # type: ignore[arg-type]
        said.append((str(caught.value), caught.value.line))
    assert said[0] == said[1]


def test_methods_that_take_no_parts_and_limits_of_time_say_so() -> None:
    with pytest.raises(feedplan.InputError, match=r"bang-bang plans in less time .*, or use jerk-limited$"):
        feedplan.plan(CORNERS, "mill", elsewhere=Others(2))
    with pytest.raises(feedplan.InputError, match="leave the time limit or the cluster out"):
        feedplan.plan(CORNERS, "mill", "jerk-limited", elsewhere=Others(2), time_limit=1.0)


def test_a_plan_is_the_same_on_any_number_of_threads() -> None:
    """Threads end in any order; a sum in that order would have other last digits."""
    code = """
import feedplan
from tests.service.servers import long_part
program = b"\\n".join(long_part().splitlines()[:120]) + b"\\nM2\\n"
plan = feedplan.plan(program, "mill", "jerk-limited", accuracy=0.1)
print(plan.time, plan.lower_bound, plan.profile.excess)
"""
    told = set()
    for threads in ("1", "5", "16"):
        environment = {**os.environ, "RAYON_NUM_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=Path(__file__).parents[2],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        told.add(done.stdout)
    assert len(told) == 1

"""The time limit of jerk-limited: the first plan, what is left out, and what the plan says about it."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest

from benchmarks.named import FREE, butterfly, lemniscate, trefoil
from feedplan import plan as plan_program
from feedplan._solvers import plan_jerk_limited
from feedplan.accuracy import shortfalls
from feedplan.cli import main
from feedplan.constraints.problem import Problem, build_problem
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import jerk_limited, planner
from feedplan.planners._jerk import jerk_limits
from feedplan.planners._runs import fastest_runs
from feedplan.profile import SpeedProfile
from feedplan.time_limit import FOLLOWING, TimeLimit
from tests.planners.random_paths import random_problem

MACHINE = Machine(
    "jerk", tuple(Axis(name, 250.0, 3000.0, max_jerk=50_000.0) for name in "XYZ"), chord_tolerance=np.inf
)
SEEDS = int(os.environ.get("FEEDPLAN_SEEDS", "6"))
PROGRAM = """G21 G90 G64 P0.01
G1 X20 F{feed}
X40 Y10
G2 X60 Y10 I10 J-10
G61.1
G1 X80
G64 P0.01
Y40
X0 Y30
M2
"""


def named(curve: object) -> Problem:
    return build_problem(Path.from_curve(curve(), feed=FREE), MACHINE)  # type: ignore[operator]


@pytest.fixture
def program(tmp_path: FilePath) -> FilePath:
    """A program with three runs at 100 mm/s; the second run is a line."""
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM.format(feed=6000))
    return file


def problems(tmp_path: FilePath) -> list[Problem]:
    """Named and random curves, and a program with feeds far below what the axes allow, for which the method
    s-curve is nearly optimal."""
    found = [named(curve) for curve in (lemniscate, trefoil, butterfly)]
    found += [random_problem(seed) for seed in range(SEEDS)]
    for feed in (60, 600, 6000):
        file = tmp_path / f"{feed}.ngc"
        file.write_text(PROGRAM.format(feed=feed))
        found.append(plan_program(file, MACHINE, "s-curve").problem)
    return found


def test_the_first_plan_is_no_slower_than_s_curve_and_near_the_best(tmp_path: FilePath) -> None:
    for problem in problems(tmp_path):
        first = planner("jerk-limited", time_limit=0.0)(problem)
        assert first.stopped
        assert first.time <= planner("s-curve")(problem).time * (1.0 + 1e-12)
        assert first.time <= 1.1 * planner("jerk-limited")(problem).time


def test_without_time_there_is_a_first_plan_on_a_coarse_grid_and_nothing_more(
    program: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned: list[tuple[float, bool]] = []

    def counted(
        problem: Problem, limits: object, resolution: float, gap: float, proves: bool, *more: object
    ) -> object:
        planned.append((resolution, proves))
        return plan_jerk_limited(problem, limits, resolution, gap, proves, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(jerk_limited, "plan_jerk_limited", counted)
    plan = plan_program(program, MACHINE, "jerk-limited", time_limit=0.0)
    first, best = (jerk_limited.FIRST_RESOLUTION, False), (jerk_limited.RESOLUTION, True)
    assert planned == [first]
    assert plan.audit().ok
    # There is enough time, but all of it is reserved for what follows the plan.
    profile = jerk_limited.plan(plan.problem, time_limit=1e6, reserve=lambda first: 1e6)
    assert profile.stopped
    assert planned == [first] * 2
    # Enough time for all.
    profile = jerk_limited.plan(plan.problem, time_limit=1e6, reserve=lambda first: 1.0)
    assert not profile.stopped
    assert planned[2:] == [first, best]
    assert profile.time == planner("jerk-limited")(plan.problem).time


def test_no_run_is_begun_after_the_deadline(program: FilePath) -> None:
    problem = plan_program(program, MACHINE, "s-curve").problem
    native, stopped, *_ = plan_jerk_limited(problem, jerk_limits(problem), 16.0, 1e-6, False, 0.0)
    assert stopped
    late = SpeedProfile.of(native)
    assert (len(late), len(late.runs)) == (0, len(problem.path.runs))


def test_each_run_is_the_fastest_that_there_is(program: FilePath) -> None:
    problem = plan_program(program, MACHINE, "s-curve").problem
    best, other = planner("jerk-limited")(problem), planner("s-curve")(problem)
    assert (np.diff(best.runs) > 0).all()
    assert len(best.runs) == 4
    one = int(best.runs[1])
    # One profile has the first run only, the other one all runs.
    names = ("piece", "kind", "axis", "value", "u0", "u1", "p0", "p1", "duration", "a0", "a1")
    part = replace(best, **{n: getattr(best, n)[:one] for n in names}, runs=np.array([0, one, one, one]))
    joined = fastest_runs([other, part])
    np.testing.assert_allclose(joined.run_times, [best.run_times[0], *other.run_times[1:]], rtol=1e-14)
    np.testing.assert_array_equal(joined.piece[joined.runs[1] :], other.piece[other.runs[1] :])
    assert len(joined) == joined.runs[-1] == len(joined.a1)


def test_a_limit_is_one_for_all_that_becomes_of_a_program(program: FilePath) -> None:
    now = [100.0]
    limit = TimeLimit(10.0, lambda: now[0])
    assert limit.left == 10.0
    now[0] += 4.0
    assert limit.left == 6.0
    setpoints = plan_program(program, MACHINE, "s-curve").setpoints()
    ticks = iter([104.0, 104.01])
    limit.clock = lambda: next(ticks, 104.01)
    # A sample of 1/64 of the setpoints took 10 ms.
    assert limit.keep_for(setpoints) == pytest.approx(64 * 0.01 * FOLLOWING)
    assert limit.left == pytest.approx(10.0 - 4.01 - 64 * 0.01 * FOLLOWING)
    limit.kept = 1e3
    assert limit.left == 0.0


def test_a_plan_that_was_stopped_says_so_everywhere(
    program: FilePath, tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = tmp_path / "machine.toml"
    axes = "".join(
        f'[[axes]]\nname = "{name}"\nmax_velocity = 250\nmax_acceleration = 3000\nmax_jerk = 50000\n'
        for name in "XYZ"
    )
    machine.write_text(f'name = "jerk"\nperiod = 0.001\nkinematics = "cartesian"\n{axes}')
    arguments = ["plan", str(program), "-m", str(machine), "--method", "jerk-limited"]
    assert main([*arguments, "--time-limit", "0", "-o", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "plan.json").read_text())
    slower = summary["time"] / summary["lower_bound"] - 1.0
    sentence = f"stopped after 0 s: the plan may be up to {100 * slower:.2g} % slower than the optimum"
    assert sentence in summary["warnings"]
    assert summary["stopped"]
    assert f"warning: {sentence}\n" in capsys.readouterr().err
    assert main(arguments) == 0
    assert "stopped" not in capsys.readouterr().err


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4, 2e-5])
def test_an_accuracy_that_the_plan_reaches_and_the_bound_does_not_prove_is_told(accuracy: float) -> None:
    path = Path.from_curve(butterfly(), feed=FREE)
    plan = plan_program(path, MACHINE, "jerk-limited", accuracy=accuracy)
    assert plan.gap > 5.0 * accuracy
    (sentence,) = plan.warnings
    start = "by its own estimate the plan is within "
    assert sentence.startswith(start)
    gap = f"{100 * plan.gap:.2g} %"
    assert f"reaches the accuracy {accuracy:g}, but the lower bound leaves a gap of {gap}: " in sentence
    assert f"{200 * accuracy:.2g} % for what finer grids may gain" in sentence
    own = float(sentence.removeprefix(start).split()[0]) / 100
    assert own == pytest.approx(plan.summary()["estimated_gap"], rel=0.05)
    # A plan on a finer grid, with more iterations, is faster by about the accuracy at most.
    best = plan_program(path, MACHINE, "jerk-limited", accuracy=1e-5).time
    assert own < accuracy
    assert plan.time <= best * (1.0 + 2.0 * accuracy)
    assert plan_program(path, MACHINE, "jerk-limited").warnings == ()


def test_what_falls_short_is_said_in_words() -> None:
    profile = planner("jerk-limited")(named(lemniscate))

    def said(time: float, accuracy: float = 1e-3, **more: object) -> tuple[str, ...]:
        """The sentences about a plan whose time is `time` times its lower bound."""
        return shortfalls(
            replace(profile, **more),  # type: ignore[arg-type]
            profile.time / time,
            accuracy=accuracy,
            to_prove=False,
            time_limit=2.0,
            left_to_grids=0.0,
        )

    assert said(1.0001) == said(1.25) == ()
    assert said(1.25, excess=0.02 * profile.time) == (
        "the accuracy 0.001 was not reached: the plan may be up to 25 % slower than the optimum, "
        "by its own estimate 2 %",
    )
    stopped = "stopped after 2 s: the plan may be up to 3.1 % slower than the optimum"
    assert said(1.031, stopped=True) == (stopped,)

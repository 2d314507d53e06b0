"""The planners that solve on a mesh: against the exact planner, against each other, and their messages."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.audit import Audit, audit
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InfeasibleError, InputError, MissingPackageError, SolverError
from feedplan.geometry.path import Path
from feedplan.lower_bound import lower_bound
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import _refinement, bang_bang, casadi, clarabel, methods, planner, toppra
from feedplan.profile import PhaseLaw, SpeedProfile
from tests.campaign import seeds
from tests.constraints.test_joints import random_problem, without_travel
from tests.planners.meshes import NAMED, machine_of, random_path_problem

MESHED = ("toppra", "casadi", "clarabel")
# By this relative amount of v² the exact planner stays below a chord-error limit.
CHORD = 2e-4


def test_a_joint_that_only_rounding_moves_gives_no_arc_its_duration() -> None:
    text = b"G21 G64 P0.02\nF1500\nG1 X20 Y25 Z4\nX15 Y20\nM2\n"
    plan = feedplan.plan(text, "corexy", "casadi", path="fastest")
    assert plan.audit().ok, plan.audit().failures


def line_problem(**limits: Any) -> Problem:
    """A line of 100 mm along X, at most 100 mm/s, with 1000 mm/s²."""
    path = Path.from_bezier([[0.0, 0.0], [50.0, 0.0], [100.0, 0.0]], feed=100.0)
    return build_problem(path, machine_of("XY", 200.0, 1000.0), **limits)


def audited(problem: Problem, profile: SpeedProfile) -> Audit:
    """The verdict on a machine that allows velocity jumps, as the problem does at corners."""
    axes = zip(problem.axes, problem.max_velocity, problem.max_acceleration, strict=True)
    machine = Machine(
        "any",
        tuple(Axis(name, float(v), float(a), max_velocity_jump=1e9) for name, v, a in axes),
        chord_tolerance=problem.chord_tolerance,
        period=problem.period,
    )
    return audit(problem, profile, machine)


@pytest.mark.parametrize("method", MESHED)
def test_a_line_takes_the_time_by_hand(method: str) -> None:
    # 0.1 s up, 0.9 s at the feed, 0.1 s down.
    problem = line_problem()
    profile = planner(method, accuracy=1e-3)(problem)
    assert profile.time == pytest.approx(1.1, rel=1e-3)
    assert profile.time >= 1.1 * (1 - 1e-9)
    assert audited(problem, profile).ok


@pytest.mark.parametrize("method", MESHED)
def test_speeds_at_the_ends_are_kept(method: str) -> None:
    # From 60 mm/s: 0.04 s and 3.2 mm up; to 80 mm/s: 0.02 s and 1.8 mm down.
    problem = line_problem(start_speed=60.0, end_speed=80.0)
    profile = planner(method, accuracy=1e-3)(problem)
    assert profile.time == pytest.approx(0.04 + 0.95 + 0.02, rel=1e-3)
    assert audited(problem, profile).ok


@pytest.mark.parametrize("name", NAMED)
def test_the_solvers_agree_with_the_exact_time_as_meshes_get_finer(name: str) -> None:
    problem = NAMED[name]()
    exact = bang_bang.plan(problem).time
    convex = [clarabel.plan(problem, cells=cells).time / exact - 1 for cells in (8, 32)]
    assert casadi.plan(problem, cells=8).time / exact - 1 == pytest.approx(convex[0], abs=2e-5)
    above = [toppra.plan(problem, cells=cells).time / exact - 1 for cells in (8, 32)]
    below = [toppra.plan(problem, cells=cells, scheme="collocation").time / exact - 1 for cells in (32, 128)]
    order = {
        scheme: np.log2(abs(coarse / fine)) / 2
        for scheme, (coarse, fine) in {"clarabel": convex, "toppra": above, "collocation": below}.items()
    }
    print(name, {scheme: round(float(value), 2) for scheme, value in order.items()})
    for fine, coarse in (convex[::-1], above[::-1]):
        assert -1e-7 < fine < 0.6 * coarse
    assert convex[1] < above[1]
    # Collocation is optimistic, except on coarse meshes.
    assert below[1] < 0.5 * above[1]
    assert abs(below[1]) < 0.6 * abs(below[0])


@pytest.mark.parametrize("seed", range(seeds(6)))
def test_random_paths_take_the_exact_time_and_keep_every_limit(seed: int) -> None:
    problem = random_path_problem(seed)
    exact = bang_bang.plan(problem).time
    profile = clarabel.plan(problem, accuracy=1e-3)
    least = -CHORD if np.isfinite(problem.chord_tolerance) else -1e-7
    assert least < profile.time / exact - 1 < 1e-3
    verdict = audited(problem, profile)
    assert verdict.ok, [check for check in verdict.checks if check.judged and not check.ok]


@pytest.mark.parametrize("seed", range(seeds(12)))
def test_other_solvers_agree_on_random_paths_and_none_is_below_the_bound(seed: int) -> None:
    problem = random_path_problem(seed)
    exact = bang_bang.plan(problem)
    least = lower_bound(problem, exact)
    slack = CHORD if np.isfinite(problem.chord_tolerance) else 1e-7

    def time_by(plan: Callable[..., SpeedProfile], cells: int) -> float:
        with suppress(SolverError):
            return plan(problem, cells=cells).time
        # On such a coarse mesh no profile that starts or ends at the given speeds is feasible.
        assert problem.start_speed > 0 or problem.end_speed > 0
        return np.nan

    convex, nonlinear = (time_by(solver.plan, 12) for solver in (clarabel, casadi))
    # Each solver lowers limits that its own solution exceeds.
    assert np.isnan([convex, nonlinear]).any() or convex == pytest.approx(nonlinear, rel=2e-4)
    for time in (convex, nonlinear, time_by(toppra.plan, 24)):
        assert not time < least * (1 - 1e-9)
        assert not time < exact.time * (1 - slack)


@pytest.mark.parametrize("seed", range(1, seeds(4), 3))
@pytest.mark.parametrize("name", ["cylindrical", "trunnion-ac", "head-head", "corexy"])
def test_random_paths_of_joints_take_the_exact_time_and_keep_every_limit(name: str, seed: int) -> None:
    problem = random_problem(name, seed)
    exact = bang_bang.plan(problem).time
    profile = clarabel.plan(problem, accuracy=1e-3)
    assert -1e-7 < profile.time / exact - 1 < 1e-3
    verdict = audit(problem, profile, without_travel(Machine.load(name)))
    assert verdict.ok, [check for check in verdict.checks if check.judged and not check.ok]


PROGRAM = """G21 G90 G64 P0.01 F3000
G1 X20 Y0
G2 X40 Y20 I0 J20
G1 X38 Y30
G1 X30 Y33
G4 P0.25
G0 Z5
M2
"""


@pytest.mark.parametrize("method", MESHED)
def test_a_program_is_planned_sampled_and_audited(method: str, tmp_path: FilePath) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM, encoding="utf-8")
    plan = feedplan.plan(file, "mill", method=method, accuracy=3e-3)
    exact = feedplan.plan(file, "mill").time
    assert 0 <= plan.time / exact - 1 < 3e-3
    assert plan.audit().ok
    assert PhaseLaw.PARAMETER_ACCELERATION in plan.profile.kind


def test_a_cusp_of_a_straight_piece_is_passed_at_speed() -> None:
    # q' vanishes at the inner ends of both pieces, but the motion does not stop: 80 ms up, 80 ms down, as on
    # a line of 100 mm.
    points = [[[0.0, 0.0], [30.0, 40.0], [30.0, 40.0]], [[30.0, 40.0], [30.0, 40.0], [60.0, 80.0]]]
    curve = CompositeCurve.from_pieces(points, [50.0, 50.0]).elevated(3)
    path = Path.from_curve(curve, feed=100.0)
    problem = build_problem(path, machine_of("XY", 200.0, 1000.0))
    profile = clarabel.plan(problem)
    assert profile.time == pytest.approx(1.08, rel=1e-4)
    assert np.isfinite(profile.p1).all()
    assert audited(problem, profile).ok


def test_a_cusp_that_turns_is_a_stop() -> None:
    # (u², u³) from u = −1 to 1: the tool stops in the cusp, and p is finite.
    points = [[1.0, -1.0], [-1.0 / 3.0, 1.0], [-1.0 / 3.0, -1.0], [1.0, 1.0]]
    curve = CompositeCurve.from_bezier(points, width=2.0).split([0], [1.0])
    path = Path.from_curve(curve, feed=100.0)
    problem = build_problem(path, machine_of("XY", 100.0, 1000.0))
    exact = bang_bang.plan(problem).time
    profile = clarabel.plan(problem)
    assert profile.time == pytest.approx(exact, rel=2e-4)
    assert audited(problem, profile).ok


def test_collocation_breaks_limits_between_its_nodes_and_the_audit_tells() -> None:
    problem = NAMED["infinity"]()
    assert not audited(problem, toppra.plan(problem, cells=16, scheme="collocation")).ok
    assert audited(problem, toppra.plan(problem, cells=16)).ok


def test_the_time_falls_with_the_accuracy_asked_for() -> None:
    problem = NAMED["trefoil"]()
    exact = bang_bang.plan(problem).time
    errors = [clarabel.plan(problem, accuracy=accuracy).time / exact - 1 for accuracy in (1e-2, 1e-3, 1e-4)]
    for error, accuracy in zip(errors, (1e-2, 1e-3, 1e-4), strict=True):
        assert -1e-7 < error < accuracy
    assert all(fine <= coarse for coarse, fine in pairwise(errors))


def test_methods_are_the_planners_and_not_what_they_share() -> None:
    assert {"bang-bang", *MESHED} <= set(methods())
    assert not any(name.startswith(("-", "_")) for name in methods())


def test_an_exact_method_takes_no_accuracy() -> None:
    with pytest.raises(InputError, match="the method bang-bang takes no accuracy: leave it out"):
        planner("bang-bang", accuracy=1e-3)


@pytest.mark.parametrize("method", MESHED)
def test_a_missing_package_is_named_with_its_command(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, method, None)
    with pytest.raises(MissingPackageError, match=f"pip install {method}"):
        planner(method)(line_problem())


def test_a_package_that_a_solver_needs_besides_is_named_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(
        MissingPackageError, match="method clarabel needs the package scipy: `pip install scipy`"
    ):
        planner("clarabel")(line_problem())


@pytest.mark.parametrize("method", MESHED)
def test_a_speed_that_cannot_be_had_is_told_with_its_place(method: str) -> None:
    with pytest.raises(InfeasibleError, match=r"no profile starts at 120 mm/s: at most 100 mm/s is allowed"):
        planner(method)(line_problem(start_speed=120.0))
    short = Path.from_bezier([[0.0, 0.0], [0.05, 0.0], [0.1, 0.0]], feed=100.0)
    problem = build_problem(short, machine_of("XY", 200.0, 1000.0), end_speed=90.0)
    with pytest.raises(InfeasibleError, match="no profile ends at 90 mm/s"):
        planner(method)(problem)


@pytest.mark.parametrize("method", MESHED)
def test_time_that_is_up_is_told(method: str) -> None:
    with pytest.raises(SolverError, match=f"{method} found no profile"):
        planner(method, time_limit=1e-9)(line_problem())


def test_the_word_of_a_solver_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    import casadi as package

    class Failing:
        def __call__(self, **values: Any) -> dict[str, Any]:
            return {"x": values["x0"]}

        def stats(self) -> dict[str, Any]:
            return {"success": False, "return_status": "Maximum_Iterations_Exceeded"}

    monkeypatch.setattr(package, "nlpsol", lambda *args: Failing())
    with pytest.raises(SolverError, match=r"casadi found no profile \(Maximum_Iterations_Exceeded\)"):
        casadi.plan(line_problem())


def test_too_many_cells_are_refused_with_what_was_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SolverError, match="would need 1000000 cells, 400000 are the most"):
        clarabel.plan(line_problem(), cells=1_000_000)
    monkeypatch.setattr(_refinement, "MAX_CELLS", 300)
    with pytest.raises(SolverError, match=r"an accuracy above 1e-05 \(.* is reached\), or use"):
        toppra.plan(NAMED["trefoil"](), accuracy=1e-5)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"accuracy": 0.0}, "the accuracy is 0"),
        ({"cells": 0}, "0 cells a piece"),
        ({"time_limit": 0.0}, "the time limit is 0"),
    ],
)
def test_options_out_of_range_are_refused(options: dict[str, float], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        planner("clarabel", **options)(line_problem())


@pytest.mark.parametrize("method", MESHED)
def test_nothing_is_printed(method: str, capfd: pytest.CaptureFixture[str]) -> None:
    planner(method, cells=16)(line_problem())
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""


@pytest.mark.parametrize("degree", [2, 3])
def test_the_audit_measures_arcs_of_constant_parameter_acceleration(degree: int) -> None:
    # (u, u²/2) from rest with s = 10: the acceleration of y is 10 u + p = 30 u, up to 60 mm/s² at u = 2.
    curve = CompositeCurve.from_bezier([[0.0, 0.0], [1.0, 0.0], [2.0, 2.0]], width=2.0).elevated(degree)
    path = Path.from_curve(curve, feed=100.0)
    speed = float(np.sqrt(40.0) * np.hypot(1.0, 2.0))
    problem = build_problem(path, machine_of("XY", 100.0, 60.0), end_speed=speed)
    profile = one_arc(u=(0.0, 2.0), p=(0.0, 40.0), value=10.0, duration=2.0 * 2.0 / np.sqrt(40.0))
    verdict = audited(problem, profile)
    assert verdict.ok
    y = next(c for c in verdict.checks if (c.name, c.axis) == ("acceleration", "Y"))
    assert y.worst == pytest.approx(60.0, rel=1e-6)
    for change in ({"value": 10.1}, {"duration": 0.64}, {"p": (0.1, 40.0)}):
        wrong = one_arc(
            **{"u": (0.0, 2.0), "p": (0.0, 40.0), "value": 10.0, "duration": 4.0 / np.sqrt(40.0), **change}
        )
        assert not audited(problem, wrong).ok


def one_arc(u: tuple[float, float], p: tuple[float, float], value: float, duration: float) -> SpeedProfile:
    return SpeedProfile(
        piece=np.zeros(1, np.uint32),
        kind=np.array([PhaseLaw.PARAMETER_ACCELERATION], np.uint8),
        axis=np.array([255], np.uint8),
        value=np.array([value]),
        u0=np.array(u[:1]),
        u1=np.array(u[1:]),
        p0=np.array(p[:1]),
        p1=np.array(p[1:]),
        duration=np.array([duration]),
        runs=np.array([0, 1]),
    )

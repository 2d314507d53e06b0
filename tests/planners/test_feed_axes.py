"""Feeds count along the axes that RS-274 defines, at every place of the path and with every method."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import feedplan
from feedplan import Axis, Machine, Path, Plan
from feedplan.program.program import Program
from tests.campaign import SEEDS as CAMPAIGN
from tests.campaign import seeds
from tests.planners.rotary_programs import AXES, rotary_machine, rotary_program

NATIVE = ("bang-bang", "jerk-limited", "s-curve")
HEURISTIC = ("tangential", "junction-deviation", "arc-transition", "constant-velocity-transition")
FOREIGN = ("ruckig", "toppra", "casadi", "clarabel")
GROUPS = ("XYZ", "UVW", "ABC")
# Every third seed gives a program in inverse time.
SEEDS = range(seeds(3)) if CAMPAIGN else (1, 2)

FAST = Machine(
    "fast",
    tuple(Axis(name, 1000.0, 20000.0, 4e5) for name in "XYZAB"),
    period=1e-3,
)


def speeds(plan: Plan) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Speed along each group of axes in each period (n, 3), by differences, and the pieces at both ends."""
    rows = plan.setpoints().all()
    groups = np.array([[name in letters for name in rows.axes] for letters in GROUPS])
    way, step = np.diff(rows.position, axis=0), np.diff(rows.t)
    size = np.abs(rows.position).max()
    rounding = 8.0 * np.finfo(float).eps * size
    speed = (np.sqrt((way**2) @ groups.T) - 2.0 * rounding) / step[:, None]
    piece = rows.piece.astype(np.int64)
    return speed, piece[:-1], piece[1:]


def leading(program: Program) -> NDArray[np.int64]:
    """The group of axes along which the feed of each move counts, from its words; 3 for none."""
    group = np.full(len(program), 3)
    starts = np.concatenate([program.start[None], program.target[:-1]])
    moves = program.target != starts
    for number in (2, 1, 0):
        columns = [k for k, name in enumerate(program.axes) if name in GROUPS[number]]
        group[moves[:, columns].any(axis=1)] = number
    group[program.arc_move] = 0
    return group


def check(plan: Plan) -> float:
    """Asserts that no step is faster than a feed of the moves around it; the greatest use of a feed."""
    assert plan.program is not None
    program, group = plan.program, leading(plan.program)
    speed, before, after = speeds(plan)
    most = np.zeros(3)
    same = before == after
    pieces, starts = np.unique(before[same], return_index=True)
    fastest = np.maximum.reduceat(speed[same], starts)
    for row, piece in zip(fastest, pieces.tolist(), strict=True):
        own = np.arange(plan.path.move[piece, 0], plan.path.move[piece, 1] + 1)
        if np.isinf(program.feed[own]).any():
            continue
        wide = np.arange(max(own[0] - 1, 0), min(own[-1] + 2, len(program)))
        for number in range(3):
            feeds = program.feed[wide][group[wide] == number]
            moved = (group[own] == number).any()
            if len(feeds) and (moved or not (group[own] < number).any()):
                use = row[number] / feeds.max()
                assert use <= 1.0 + 1e-6, (plan.method, number, use, program.line[own])
                if moved:
                    most[number] = max(most[number], use)
    return float(most.max())


def planned(text: str, machine: Machine, method: str, tmp_path: FilePath, **options: Any) -> Plan:
    file = tmp_path / "feed.ngc"
    file.write_text(text)
    plan = feedplan.plan(file, machine, method=method, **options)
    assert plan.audit().ok, (method, plan.audit().failures, text)
    return plan


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("method", NATIVE)
def test_no_block_is_faster_than_its_feed(axes: str, method: str, tmp_path: FilePath) -> None:
    uses = []
    for seed in SEEDS:
        feeds = (3000.0, 4500.0, 36000.0)
        text = rotary_program(seed, axes, feeds, inverse=seed % 3 == 2)
        plan = planned(text, rotary_machine(seed, axes), method, tmp_path)
        uses.append(check(plan))
        if seed % 3 == 2:
            continue
        # All feeds along X, Y and Z are equal, so no step outside rapids may be faster.
        speed, before, after = speeds(plan)
        cut = np.isfinite(plan.path.feed)
        steps = cut[before] & cut[after]
        assert speed[steps, 0].max(initial=0.0) <= 50.0 * (1.0 + 1e-6), (axes, method, seed)
    assert max(uses) > 0.999


@pytest.mark.parametrize("method", [*HEURISTIC, *FOREIGN])
def test_other_methods_keep_feeds_along_their_axes(method: str, tmp_path: FilePath) -> None:
    options: dict[str, Any] = {"time_limit": 1.0} if method == "ruckig" else {}
    if method in ("toppra", "casadi", "clarabel"):
        options = {"cells": 8}
    zigzag = "".join(f"G1 X{10 * i} A{100 * (i % 2)}\n" for i in range(1, 5))
    text = f"G21 G90 G94 G64 P0.5\nG0 X0 Y0 Z0 A0\nF60\n{zigzag}F600 A0\nX60\nG2 X66 I3 A30\nM2\n"
    file = tmp_path / "feed.ngc"
    file.write_text(text)
    plan = feedplan.plan(file, FAST, method=method, **options)
    # Methods of controllers may exceed accelerations at corners.
    broken = [found.name for found in plan.audit().broken]
    assert "feed" not in broken
    assert not broken or method in HEURISTIC
    assert check(plan) > 0.99


@pytest.mark.parametrize("method", NATIVE)
def test_a_blend_of_a_linear_and_a_rotary_move_keeps_both_feeds(method: str, tmp_path: FilePath) -> None:
    # F60: 1 mm/s along X, then 1 deg/s about A; on the blend between them both hold.
    plan = planned("G21 G90 G94 G64 P0.5\nG1 F60 X10\nA10\nM2\n", FAST, method, tmp_path)
    assert len(plan.path.runs) == 2
    assert len(plan.path) >= 3
    speed, _, _ = speeds(plan)
    for k in (0, 2):
        assert 1.0 - 1e-5 < speed[:, k].max() <= 1.0 + 1e-6
    # 10 mm and 10 deg, less what the blend cuts off; the way through the corner takes no longer.
    assert 19.0 < plan.time < 20.1


def test_a_line_along_x_and_a_runs_at_the_feed_along_x(tmp_path: FilePath) -> None:
    # X10 A90 at F60: 1 mm/s along X and 9 deg/s about A for ten seconds, plus speeding up and down.
    plan = planned("G21 G90 G94 G61\nG1 F60 X10 A90\nM2\n", FAST, "bang-bang", tmp_path)
    speed, _, _ = speeds(plan)
    assert speed[:, 0].max() == pytest.approx(1.0, rel=1e-9)
    assert speed[:, 2].max() == pytest.approx(9.0, rel=1e-9)
    # A changes its speed by 9 deg/s at 20 000 deg/s²: both ends together cost 9/20 000 s.
    assert plan.time == pytest.approx(10.0 + 9.0 / 20000.0, abs=1e-9)


def test_inverse_time_is_the_time_of_a_block(tmp_path: FilePath) -> None:
    # 10 mm and 90 deg in 1/6 min, then 45 deg alone in another 1/6 min.
    text = "G21 G90 G93 G61\nG1 X10 A90 F6\nA45 F6\nM2\n"
    plan = planned(text, FAST, "bang-bang", tmp_path)
    assert plan.time == pytest.approx(20.0 + 9.0 / 20000.0 + 4.5 / 20000.0, abs=1e-9)


def test_a_zero_of_the_counted_speed_inside_a_piece_limits_nothing() -> None:
    # X turns back in the middle of a parabola while A moves on.
    path = Path.from_bezier([[0, 0], [5, 20], [0, 40]], axes="XA", feed=1.0)
    plan = feedplan.plan(path, replace(FAST, axes=(FAST.axes[0], FAST.axes[3])))
    assert plan.audit().ok, plan.audit().failures
    speed, _, _ = speeds(plan)
    assert speed[:, 0].max() == pytest.approx(1.0, rel=1e-6)
    assert speed[:, 2].max() > 30.0


def test_the_feed_of_a_path_counts_along_its_linear_axes() -> None:
    points = [[0.0, 0.0, 0.0], [10.0, 0.0, 50.0], [10.0, 0.0, 80.0], [20.0, 5.0, 80.0]]
    path = Path.from_points(points, 0.1, axes="XYA", feed=5.0)
    plan = feedplan.plan(path, replace(FAST, axes=tuple(FAST.axes[k] for k in (0, 1, 3))))
    assert plan.audit().ok
    speed, _, _ = speeds(plan)
    assert speed[:, 0].max() == pytest.approx(5.0, rel=1e-6)


@pytest.mark.parametrize("request_", [{"feed": 3.0}, {"feed_override": 0.5}, {"feed_override": 2.0}])
def test_feeds_asked_for_count_along_the_same_axes(request_: dict[str, float], tmp_path: FilePath) -> None:
    text = "G21 G90 G94 G64 P0.5\nG1 F120 X10 A50\nX20 A0\nF600 A90\nM2\n"
    plan = planned(text, FAST, "bang-bang", tmp_path, **request_)
    speed, before, after = speeds(plan)
    factor = request_.get("feed_override", 1.0)
    linear, rotary = (request_["feed"],) * 2 if "feed" in request_ else (2.0 * factor, 10.0 * factor)
    assert speed[:, 0].max() == pytest.approx(linear, rel=1e-6)
    third = plan.path.move.min(axis=1) == 2
    assert speed[third[before] & third[after], 2].max() == pytest.approx(rotary, rel=1e-6)


@pytest.mark.parametrize("doctored", ["path", "problem"])
def test_the_audit_refuses_a_plan_made_with_other_feeds(doctored: str, tmp_path: FilePath) -> None:
    text = "G21 G90 G94 G64 P0.5\nG1 F60 X10 A50\nX20 A0\nX30 A50\nM2\n"
    plan = planned(text, FAST, "bang-bang", tmp_path)
    path = plan.path
    if doctored == "path":
        assert path.group_feed is not None
        path = replace(path, feed=1.5 * path.feed, group_feed=1.5 * path.group_feed)
        fast = feedplan.plan(path, FAST)
    else:
        # A limit of the speed in all axes instead of the feed along X.
        path = replace(path, group_feed=None, feed=np.full(len(path), 5.1))
        fast = feedplan.plan(path, FAST)
    verdict = replace(fast, program=plan.program).audit()
    assert not verdict.ok
    assert any("feed" in sentence or "mm/s" in sentence for sentence in verdict.failures)

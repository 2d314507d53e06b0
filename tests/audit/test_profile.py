"""The audit of speed profiles: correct plans pass; every kind of fault is found, at its place."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.audit import PASS_MARK, Audit, LimitCheck, audit
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.profile import PhaseLaw, SpeedProfile
from tests.along import path_along, problem_along, profile_of
from tests.audit.faults import STRANGE, broken, changed, rubbish


def plane(*max_velocity_jump: float) -> Machine:
    """A machine with X and Y at 500 mm/s and 1000 mm/s²."""
    jumps = max_velocity_jump or (0.0, 0.0)
    return Machine(
        "plane", tuple(Axis(n, 500.0, 1000.0, max_velocity_jump=j) for n, j in zip("XY", jumps, strict=True))
    )


def path_of(points: list[list[list[float]]], width: list[float]) -> Path:
    return path_along(CompositeCurve.from_pieces(points, width), feed=100.0)


def problem_of(path: Path, **changes: Any) -> Problem:
    return problem_along(path, **{"velocity": 500.0, "acceleration": 1000.0, **changes})


LINE = path_of([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]]], [10.0])
# 10 mm from rest to rest at 1000 mm/s² and 50 mm/s: 0.05 s up, 0.15 s at constant speed, 0.05 s down.
TRAPEZOID = profile_of(
    (0, PhaseLaw.AXIS_ACCELERATION, 0, 1000.0, 0.0, 1.25, 0.0, 2500.0, 0.05),
    (0, PhaseLaw.FEED, 255, 2500.0, 1.25, 8.75, 2500.0, 2500.0, 0.15),
    (0, PhaseLaw.AXIS_ACCELERATION, 0, -1000.0, 8.75, 10.0, 2500.0, 0.0, 0.05),
)
# x = u − 1, y = x²/2 for u in [0, 2] at 20 mm/s in X: Y has the constant acceleration 400 mm/s².
PARABOLA = path_of([[[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]]], [2.0])
STEADY_X = profile_of((0, PhaseLaw.AXIS_VELOCITY, 0, 400.0, 0.0, 2.0, 400.0, 400.0, 0.1))
THROUGH = {"start_speed": 20.0 * math.sqrt(2.0), "end_speed": 20.0 * math.sqrt(2.0)}


def test_a_trapezoid_is_measured_as_a_person_would() -> None:
    result = audit(problem_of(LINE, feed=np.array([50.0])), TRAPEZOID, plane())
    assert result.ok
    assert not result.failures
    assert result.check("acceleration", "X").ratio == pytest.approx(1.0, abs=1e-12)
    assert result.check("feed").worst == pytest.approx(50.0, rel=1e-14)
    assert result.check("acceleration", "Y").worst == 0.0


def test_the_acceleration_across_a_parabola_is_its_curvature_times_speed_squared() -> None:
    limits = np.array([1000.0, 400.0])
    result = audit(problem_of(PARABOLA, acceleration=limits, **THROUGH), STEADY_X, plane())
    assert result.ok
    assert result.check("acceleration", "Y").ratio == pytest.approx(1.0, abs=1e-11)
    assert result.check("acceleration", "X").worst < 1e-6
    assert result.check("velocity", "Y").worst == pytest.approx(20.0, rel=1e-14)
    assert result.check("feed").worst == pytest.approx(20.0 * math.sqrt(2.0), rel=1e-14)


def test_the_chord_error_of_a_plan_is_the_sagitta_at_the_tip() -> None:
    # ρ = 1 mm at 20 mm/s and 1 ms: the chord error is 1 − √(1 − 0.01²) mm.
    sagitta = 1.0 - math.sqrt(1.0 - 1e-4)
    result = audit(problem_of(PARABOLA, chord_tolerance=sagitta, **THROUGH), STEADY_X, plane())
    assert result.ok
    assert result.check("chord").worst == pytest.approx(sagitta, rel=1e-10)
    tighter = problem_of(PARABOLA, chord_tolerance=sagitta * (1 - 3e-6), **THROUGH)
    assert broken(audit(tighter, STEADY_X, plane())) == {("chord", None)}


def test_a_limit_just_above_the_pass_mark_fails_and_just_below_passes() -> None:
    for share, ok in ((2e-6, False), (0.5e-6, True)):
        limits = np.array([1000.0 * (1 - share), 1000.0])
        result = audit(problem_of(LINE, acceleration=limits), TRAPEZOID, plane())
        assert result.ok == ok
        assert broken(result) == (set() if ok else {("acceleration", "X")})


def test_arcs_of_a_nanosecond_pass_and_still_show_what_breaks_a_limit() -> None:
    far = replace(LINE, curve=CompositeCurve.from_pieces(LINE.curve.by_piece + 1e4, LINE.width))
    v, width = 50.0, 5e-8
    pieces = [(1.25 + i * width, 1.25 + (i + 1) * width) for i in range(20)]
    tiny = [(0, PhaseLaw.FEED, 255, v * v, a, b, v * v, v * v, (b - a) / v) for a, b in pieces]
    end = pieces[-1][1]
    arcs = (
        (0, PhaseLaw.AXIS_ACCELERATION, 0, 1000.0, 0.0, 1.25, 0.0, v * v, 0.05),
        *tiny,
        (0, PhaseLaw.FEED, 255, v * v, end, 8.75, v * v, v * v, (8.75 - end) / v),
        (0, PhaseLaw.AXIS_ACCELERATION, 0, -1000.0, 8.75, 10.0, v * v, 0.0, 0.05),
    )
    assert audit(problem_of(far), profile_of(*arcs), plane()).ok
    # One of the short phases gains 1e-5 mm/s in a nanosecond: 10 000 mm/s².
    faster = (v + 1e-5) ** 2
    gain = (faster - v * v) / (2 * width)
    a, b = pieces[7]
    sharp = (0, PhaseLaw.AXIS_ACCELERATION, 0, gain, a, b, v * v, faster, width / v)
    result = audit(problem_of(far), profile_of(*arcs[:8], sharp, *arcs[9:]), plane())
    assert ("acceleration", "X") in broken(result)
    assert result.check("acceleration", "X").worst == pytest.approx(gain, rel=1e-3)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(
    ("size", "offset", "period"), [(1.0, 0.0, 1e-3), (0.02, 1e4, 1e-4), (30.0, -1e4, 4e-3)]
)
def test_right_plans_pass_large_and_small_near_and_far(
    spline: Any, seed: int, size: float, offset: float, period: float
) -> None:
    machine = Machine.load(("tarus", "mill", "router", "highspeed")[seed % 4]).with_period(period)
    case = spline(machine, seed, size=size, offset=offset)
    result = case.audit()
    assert result.failures == ()
    assert result.ok
    assert max(result.check("acceleration", name).ratio for name in "XYZ") > 1 - 1e-9


@pytest.mark.parametrize("names", ["X", "XY", "XYZA", "XYZAB", "XYZABC"])
def test_every_number_of_axes_is_audited_and_each_by_its_own_limit(spline: Any, names: str) -> None:
    axes = tuple(Axis(name, 300.0, 800.0 + 100.0 * k) for k, name in enumerate(names))
    case = spline(Machine("many", axes, 0.001, 0.01), 1)
    result = case.audit()
    assert result.failures == ()
    assert {check.axis for check in result.checks} == {None, *names}
    last = len(names) - 1
    for name, field in (("acceleration", "max_acceleration"), ("velocity", "max_velocity")):
        limit = changed(getattr(case.problem, field), last, 0.99 * result.check(name, names[-1]).worst)
        found = broken(case.with_problem(**{field: limit}).audit())
        assert (name, names[-1]) in found
        assert {axis for _, axis in found} == {names[-1]}


def test_a_part_with_arcs_corners_pauses_and_stops_passes(part: Any) -> None:
    result = part.audit()
    assert result.failures == ()
    assert result.checked_samples > 4_500


@pytest.mark.parametrize("arc", [0, 7, 40, -1])
def test_p_scaled_on_one_arc_is_a_jump_there(part: Any, arc: int) -> None:
    profile = part.profile
    arc = arc % len(profile)
    case = part.with_profile(
        p0=changed(profile.p0, arc, lambda p: 1.001 * p), p1=changed(profile.p1, arc, lambda p: 1.001 * p)
    )
    result = case.audit()
    jumps = [check for check in result.broken if check.name == "jump"]
    assert jumps
    worst = max(jumps, key=lambda check: check.ratio)
    assert part.start(arc) - 1e-9 <= worst.time <= part.start(arc + 1) + 1e-9
    pieces = profile.piece[max(arc - 1, 0) : arc + 2]
    assert worst.line in part.path.line[pieces]


@pytest.mark.parametrize("field", ["value", "u0", "u1", "p0", "p1", "duration"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0])
def test_bad_numbers_in_the_profile_are_never_fine(part: Any, field: str, bad: float) -> None:
    arc = len(part.profile) // 2
    result = part.with_profile(**{field: changed(getattr(part.profile, field), arc, bad)}).audit()
    assert not result.ok
    if not math.isfinite(bad) or field in ("p0", "p1", "duration"):
        assert ("numbers", None) in broken(result)
        assert result.check("numbers").line == part.path.line[part.profile.piece[arc]]


def test_an_arc_left_out_twice_there_or_out_of_order_is_a_gap_there(part: Any) -> None:
    count, arc = len(part.profile), 25
    line = part.path.line[part.profile.piece[arc]]
    assert part.profile.runs[1] > arc + 1
    for change, step in (
        (lambda column: np.delete(column, arc), -1),
        (lambda column: np.insert(column, arc, column[arc]), 1),
        (lambda column: column[[*range(arc), arc + 1, arc, *range(arc + 2, count)]], 0),
    ):
        runs = part.profile.runs.copy()
        runs[1:] += step
        result = part.arcs(change, runs).audit()
        assert ("order", None) in broken(result)
        assert abs(result.check("order").line - line) <= 2


def test_a_profile_that_ends_early_is_not_the_whole_path(part: Any) -> None:
    runs = part.profile.runs.copy()
    runs[-1] -= 1
    result = part.arcs(lambda column: column[:-1], runs).audit()
    assert {("order", None), ("junction", None)} <= broken(result)
    assert result.check("order").line == part.path.line[-1]


def test_runs_that_are_not_those_of_the_path_are_found(part: Any) -> None:
    runs = changed(part.profile.runs, 1, lambda offset: offset + 1)
    assert ("order", None) in broken(part.with_profile(runs=runs).audit())
    assert ("order", None) in broken(part.with_profile(runs=part.profile.runs[:-1]).audit())


@pytest.mark.parametrize("arc", [3, 30])
def test_a_wrong_duration_is_found(part: Any, arc: int) -> None:
    for error in (1e-5, -1e-5, 0.5):
        duration = changed(part.profile.duration, arc, lambda time, error=error: time * (1 + error))
        result = part.with_profile(duration=duration).audit()
        assert ("duration", None) in broken(result)
        assert result.check("duration").line == part.path.line[part.profile.piece[arc]]
        assert result.check("duration").worst == pytest.approx(abs(error), rel=1e-3)


def test_another_constant_on_an_arc_is_found(part: Any) -> None:
    for arc in np.flatnonzero(part.profile.kind == PhaseLaw.AXIS_ACCELERATION)[[1, 8, 15]]:
        value = changed(part.profile.value, arc, lambda a: 1.01 * a)
        names = {name for name, _ in broken(part.with_profile(value=value).audit())}
        assert {"acceleration", "jump"} <= names


def test_another_kind_or_axis_of_an_arc_is_found(part: Any) -> None:
    profile = part.profile
    curved = np.flatnonzero((profile.kind == PhaseLaw.AXIS_ACCELERATION) & (profile.p0 != profile.p1))
    for arc in curved[[1, 8, 15]]:
        for kind in (PhaseLaw.PARAMETER_ACCELERATION, PhaseLaw.FEED, PhaseLaw.AXIS_VELOCITY, 77):
            value = profile.value
            if kind == PhaseLaw.PARAMETER_ACCELERATION:
                # With the same value the arc could stay equal, if |C'| = 1 along its axis.
                value = changed(value, arc, 0.0)
            assert not part.with_profile(kind=changed(profile.kind, arc, kind), value=value).audit().ok
        for axis in (0, 1, 2, 9):
            if axis != profile.axis[arc]:
                assert not part.with_profile(axis=changed(profile.axis, arc, axis)).audit().ok


def test_a_run_that_ends_in_motion_is_found() -> None:
    # The last arc stays at 50 mm/s instead of slowing down.
    arc = (0, PhaseLaw.FEED, 255, 2500.0, 8.75, 10.0, 2500.0, 2500.0, 0.025)
    columns = [tuple(column[i] for column in _columns(TRAPEZOID)) for i in range(2)]
    result = audit(problem_of(LINE), profile_of(*columns, arc), plane())
    assert broken(result) == {("junction", None)}
    assert result.check("junction").worst == pytest.approx(50.0)
    assert result.check("junction").time == pytest.approx(0.225)


def test_start_and_end_speed_must_be_those_of_the_problem() -> None:
    for wrong in ("start_speed", "end_speed"):
        result = audit(problem_of(PARABOLA, **{**THROUGH, wrong: 20.0}), STEADY_X, plane())
        assert broken(result) == {("junction", None)}


def corner(speed: float) -> tuple[Path, SpeedProfile]:
    """10 mm in X, 10 mm in Y, at constant speed through the corner."""
    path = path_of(
        [[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [10.0, 5.0], [10.0, 10.0]]], [10.0, 10.0]
    )
    p = speed * speed
    arcs = [(i, PhaseLaw.FEED, 255, p, 0.0, 10.0, p, p, 10.0 / speed) for i in range(2)]
    return path, profile_of(*arcs)


def test_a_corner_may_be_passed_with_the_jump_that_the_machine_allows_and_no_more() -> None:
    path, profile = corner(5.0)
    problem = problem_of(path, start_speed=5.0, end_speed=5.0)
    assert audit(problem, profile, plane(5.0, 5.0)).ok
    result = audit(problem, profile, plane(5.0, 4.99))
    assert broken(result) == {("jump", "Y")}
    check = result.check("jump", "Y")
    assert check.worst == pytest.approx(5.0)
    assert (check.line, check.time) == (20, pytest.approx(2.0))
    assert broken(audit(problem, profile, plane())) == {("jump", "X"), ("jump", "Y")}


def test_a_junction_speed_is_a_limit() -> None:
    path, profile = corner(5.0)
    problem = problem_of(path, start_speed=5.0, end_speed=5.0, junction_speed=np.array([5.0, 4.9, 5.0]))
    result = audit(problem, profile, plane(5.0, 5.0))
    assert broken(result) == {("junction", None)}
    assert result.check("junction").line == 20


def test_a_jump_of_speed_between_pieces_is_found_even_where_the_machine_may_jump() -> None:
    straight = path_of(
        [[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [15.0, 0.0], [20.0, 0.0]]], [10.0, 10.0]
    )
    arcs = [
        (i, PhaseLaw.FEED, 255, v * v, 0.0, 10.0, v * v, v * v, 10.0 / v) for i, v in enumerate((5.0, 5.001))
    ]
    problem = problem_of(straight, start_speed=5.0, end_speed=5.001)
    result = audit(problem, profile_of(*arcs), plane(1.0, 1.0))
    assert broken(result) == {("continuity", None)}
    assert result.check("continuity").worst == pytest.approx(1e-3, rel=1e-6)
    assert ("jump", "X") in broken(audit(problem, profile_of(*arcs), plane()))


def test_every_lowered_limit_is_the_one_that_is_named(part: Any) -> None:
    base = part.audit()
    for name, field in (("acceleration", "max_acceleration"), ("velocity", "max_velocity")):
        for k, axis in enumerate("XYZ"):
            worst = base.check(name, axis)
            limit = changed(getattr(part.problem, field), k, worst.worst * (1 - 1e-5))
            result = part.with_problem(**{field: limit}).audit()
            assert (name, axis) in broken(result)
            # The lower limit also lowers this axis's tolerances for velocity jumps and for recorded values.
            assert {n for n, a in broken(result) if a == axis} <= {
                name,
                "jump",
                "recorded_velocity",
                "recorded_acceleration",
            }
            assert result.check(name, axis).time == pytest.approx(worst.time)


def test_a_feed_exceeded_on_one_line_is_found_on_that_line(part: Any) -> None:
    for piece in (10, 30, len(part.path) - 1):
        feed = part.problem.feed
        slower = changed(feed, piece, 1.0)
        result = part.with_problem(feed=slower).audit()
        assert broken(result) == {("feed", None)}
        assert result.check("feed").line == part.path.line[piece]
        assert result.check("feed").limit == pytest.approx(1.0, rel=0.05)


def test_a_longer_period_or_a_smaller_tolerance_breaks_the_chord_limit(part: Any) -> None:
    worst = part.audit().check("chord").worst
    result = part.with_problem(chord_tolerance=worst * 0.999).audit()
    assert broken(result) == {("chord", None)}


def test_the_position_of_an_axis_is_kept_within_its_travel() -> None:
    def limited(least: float, most: float) -> Machine:
        machine = plane()
        return replace(machine, axes=(replace(machine.axes[0], travel=(least, most)), machine.axes[1]))

    assert audit(problem_of(LINE), TRAPEZOID, limited(0.0, 10.0)).ok
    result = audit(problem_of(LINE), TRAPEZOID, limited(0.0, 9.99))
    assert broken(result) == {("travel", "X")}
    assert (result.check("travel", "X").worst, result.check("travel", "X").limit) == (10.0, 9.99)
    # The lowest point of the parabola lies between its ends.
    low = replace(plane(), axes=(plane().axes[0], replace(plane().axes[1], travel=(0.001, 2.0))))
    assert broken(audit(problem_of(PARABOLA, **THROUGH), STEADY_X, low)) == {("travel", "Y")}


def test_numbers_with_hardly_a_digit_left_end_in_a_verdict() -> None:
    # p has one or two significant bits: two quadrature rules never agree, however short the interval is.
    p0, p1 = 2e-323, 8e-323
    for value in (p1 - p0, 5e-324):
        arc = (0, PhaseLaw.AXIS_ACCELERATION, 0, value, 0.0, 10.0, p0, p1, 1e150)
        assert not audit(problem_of(LINE), profile_of(arc), plane()).ok
    bent = (0, PhaseLaw.AXIS_ACCELERATION, 1, 1e-322, 0.0, 2.0, p0, p1, 1e150)
    assert not audit(problem_of(PARABOLA), profile_of(bent), plane()).ok


@pytest.mark.parametrize("seed", range(12))
def test_a_profile_of_rubbish_ends_in_a_verdict(part: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Every other case uses only values that pass the audit's first check of signs and sizes.
    changes = rubbish(rng, part.profile, (0.02, 0.2, 1.0)[seed % 3], STRANGE if seed % 2 else STRANGE[:5])
    piece = rng.integers(0, 2**32, len(part.profile), dtype=np.uint32)
    changes["piece"] = piece if seed % 4 == 3 else rng.permutation(part.profile.piece)
    for case in (part.with_profile(**{**changes, "piece": part.profile.piece}), part.with_profile(**changes)):
        assert not case.audit().ok


def test_limits_that_are_no_numbers_fail() -> None:
    assert not audit(problem_of(LINE, acceleration=np.array([math.nan, 1000.0])), TRAPEZOID, plane()).ok
    assert not audit(problem_of(LINE, feed=np.array([math.nan])), TRAPEZOID, plane()).ok


def test_the_verdict_is_plain_json(part: Any) -> None:
    good = json.loads(json.dumps(part.audit().to_json(), allow_nan=False))
    assert good["ok"] is True
    assert good["failures"] == []
    for name in ("feed", "chord", "deviation"):
        assert {"worst", "limit", "ratio", "time", "line"} <= set(good[name])
    for name in ("velocity", "acceleration", "jerk"):
        assert list(good[name]) == ["X", "Y", "Z"]
    assert good["jerk"]["X"]["judged"] is False
    assert good["jerk"]["X"]["ratio"] > 1
    bad = part.with_profile(p0=changed(part.profile.p0, 3, math.nan)).audit()
    assert json.loads(json.dumps(bad.to_json(), allow_nan=False))["ok"] is False


def test_jerk_is_judged_only_where_it_is_claimed(part: Any) -> None:
    arguments = (part.problem, part.profile, part.machine, part.program)
    assert audit(*arguments, part.chunks(500)).ok
    claimed = audit(*arguments, part.chunks(500), jerk=True)
    # Arcs of constant axis acceleration have jumps of acceleration; arcs at the feed have them where the
    # curvature jumps.
    assert {name for name, _ in broken(claimed)} == {"jerk", "acceleration_jump"}


def test_a_sentence_names_place_value_and_limit() -> None:
    result = audit(problem_of(LINE, acceleration=np.array([900.0, 900.0])), TRAPEZOID, plane())
    (sentence,) = result.failures
    assert sentence.startswith("line 10, 0.0")
    assert "X acceleration 1000 mm/s², the limit is 900 mm/s²" in sentence
    assert LimitCheck("feed", None, 2.0, 1.0, math.nan, 0.0, 0, True).ok is False
    assert PASS_MARK == 1 + 1e-6


def test_an_audit_of_nothing_is_not_fine() -> None:
    nothing = Audit((), 0)
    assert not nothing.ok
    assert nothing.failures == ("there is nothing that could be measured",)


def test_parts_that_do_not_belong_together_are_refused(part: Any) -> None:
    with pytest.raises(InputError, match="no axis Z"):
        audit(part.problem, part.profile, plane())
    with pytest.raises(InputError, match=r"phases, and `p0` has \d+ entries"):
        part.with_profile(p0=part.profile.p0[:-1])
    with pytest.raises(InputError, match=r"has no axis Z: it has X, Y, A"):
        part.with_program(axes=("X", "Y", "A")).audit()
    flat = problem_of(LINE)
    with pytest.raises(InputError, match=r"axis Z moves, and only X, Y may"):
        audit(flat, None, plane(), part.program)


def _columns(profile: SpeedProfile) -> list[NDArray[Any]]:
    names = ("piece", "kind", "axis", "value", "u0", "u1", "p0", "p1", "duration")
    return [getattr(profile, name) for name in names]

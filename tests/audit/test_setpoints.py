"""The audit of setpoints: their differences, their places on the path, and setpoints from other sources."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from feedplan.audit import Audit, audit, audit_setpoints
from feedplan.constraints.problem import build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import planner
from feedplan.planning import plan
from feedplan.setpoints import SetpointChunk, Setpoints
from tests.along import path_along
from tests.audit.faults import broken, changed


def moving(part: Any, row: int) -> int:
    """The first row from `row` on at which the speed is more than half of the greatest."""
    speed = np.linalg.norm(part.points.velocity, axis=1)
    return int(row + np.flatnonzero(speed[row:] > 0.5 * speed.max())[0])


def test_a_square_is_measured_as_a_person_would(square: Any) -> None:
    result = audit(square.problem, square.profile, square.machine, setpoints=[square.chunk])
    assert result.failures == ()
    assert result.check("acceleration", "X").ratio == pytest.approx(1.0, rel=1e-9)
    assert result.check("velocity", "Y").worst == pytest.approx(50.0, rel=1e-12)
    assert result.check("place").worst < 1e-11
    # The acceleration jumps by 500 mm/s² at a setpoint: two third differences have half each, 2.5e5 mm/s³.
    assert result.check("jerk", "X").worst == pytest.approx(2.5e5, rel=1e-6)
    assert result.check("jerk", "X").ok


def test_the_size_of_the_chunks_changes_nothing(part: Any) -> None:
    whole = part.audit(10**9).to_json()
    for size in (1, 2, 7, 4096):
        assert part.audit(size).to_json() == whole


def test_without_a_profile_the_places_are_found_along_the_path(part: Any) -> None:
    result = audit(part.problem, None, part.machine, part.program, part.chunks(1000))
    assert result.failures == ()
    assert {"feed", "chord", "place", "deviation"} <= {check.name for check in result.checks}


def test_both_interpolators_pass(part: Any) -> None:
    stream = Setpoints(part.problem, part.profile, part.problem.period, "newton")
    assert audit(part.problem, part.profile, part.machine, part.program, stream).failures == ()


def test_another_period_than_the_machines_passes(part: Any) -> None:
    stream = Setpoints(part.problem, part.profile, 0.0037)
    result = audit(replace(part.problem, chord_tolerance=math.inf), part.profile, part.machine, None, stream)
    assert result.failures == ()


@pytest.mark.parametrize("start", [40, 400, 700])
def test_a_setpoint_shifted_by_a_micrometre_is_found(part: Any, start: int) -> None:
    row = moving(part, start)
    along = part.points.velocity[row] / np.linalg.norm(part.points.velocity[row])
    across = np.cross(along, [0.0, 0.0, 1.0])
    for shift in (1e-3 * along, -1e-3 * along, 1e-3 * across, [0.0, 0.0, 1e-3]):
        position = changed(part.points.position, row, lambda q, shift=shift: q + shift)
        result = part.with_points(position=position).audit()
        assert ("place", None) in broken(result)
        check = result.check("place")
        assert check.worst == pytest.approx(1e-3, rel=0.05)
        assert check.time == pytest.approx(part.points.t[row])
        assert check.line == part.points.line[row]


def test_two_setpoints_swapped_are_found(part: Any) -> None:
    row = moving(part, 100)
    order = np.arange(len(part.points.t))
    order[[row, row + 1]] = order[[row + 1, row]]
    result = part.with_points(position=part.points.position[order]).audit()
    assert ("place", None) in broken(result)
    assert result.check("place").time == pytest.approx(part.points.t[row], abs=0.0021)
    assert "acceleration" in {name for name, _ in broken(result)}
    assert {("place", None), ("grid", None)} <= broken(part.rows(lambda column: column[order]).audit())


def test_a_step_backwards_is_found_even_on_the_path_and_without_a_profile(part: Any) -> None:
    row = moving(part, 100)
    position = changed(part.points.position, row, part.points.position[row - 2])
    case = part.with_points(position=position)
    for profile in (part.profile, None):
        result = audit(case.problem, profile, case.machine, None, case.chunks(1000))
        assert ("place", None) in broken(result)
        assert result.check("place").time == pytest.approx(part.points.t[row], abs=0.0011)


def test_setpoints_that_hurry_or_dawdle_on_the_path_are_found(spline: Any) -> None:
    # The same path planned at a feed that is 1 % lower: all differences keep the limits, but the places
    # differ from this plan.
    machine = Machine.load("mill")
    case, slower = spline(machine, 3, feed=20.0), spline(machine, 3, feed=19.8)
    result = audit(case.problem, case.profile, machine, None, slower.chunks(1000))
    assert broken(result) >= {("place", None)}
    assert "acceleration" not in {name for name, _ in broken(result)}


def test_faster_setpoints_break_the_limits_of_the_slower_machine(spline: Any) -> None:
    mill = Machine.load("mill")
    axes = (
        replace(mill.axes[0], max_velocity=70.0),
        mill.axes[1],
        replace(mill.axes[2], max_acceleration=900.0),
    )
    case = spline(mill, 5, feed=150.0)
    slow = replace(mill, axes=axes)
    limits = {
        "max_velocity": np.array([70.0, 500.0, 400.0]),
        "max_acceleration": np.array([3000.0, 3000.0, 900.0]),
    }
    result = audit(replace(case.problem, **limits), None, slow, None, case.chunks(1000))
    assert {("velocity", "X"), ("acceleration", "Z")} <= broken(result)
    assert {axis for name, axis in broken(result) if name in ("velocity", "acceleration")} == {"X", "Z"}
    ratio = np.abs(np.diff(case.points.position[:, 0])).max() / 0.001 / 70.0
    assert result.check("velocity", "X").ratio == pytest.approx(ratio, rel=1e-9)


def test_a_feed_exceeded_by_the_setpoints_of_one_line_is_found_there(spline: Any) -> None:
    case = spline(Machine.load("mill"), 2, feed=30.0)
    feed = changed(case.problem.feed, 30, 29.9)
    result = audit(replace(case.problem, feed=feed), None, case.machine, None, case.chunks(1000))
    assert broken(result) == {("feed", None)}
    assert result.check("feed").line == 31
    assert result.check("feed").limit == pytest.approx(29.9)


@pytest.mark.parametrize("column", ["t", "position", "velocity", "acceleration"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_bad_numbers_in_the_setpoints_are_never_fine(part: Any, column: str, bad: float) -> None:
    for row in (0, 500, len(part.points.t) - 1):
        values = getattr(part.points, column)
        place = row if values.ndim == 1 else (row, 1)
        result = part.with_points(**{column: changed(values, place, bad)}).audit()
        assert ("numbers", None) in broken(result)
        if column != "t":
            assert result.check("numbers").time == pytest.approx(part.points.t[row])


def test_setpoints_left_out_are_found(part: Any) -> None:
    row = moving(part, 200)
    result = part.rows(lambda column: np.delete(column, row, axis=0)).audit()
    assert ("grid", None) in broken(result)
    assert result.check("grid").time == pytest.approx(part.points.t[row + 1])
    for keep in (slice(None, -1), slice(1, None), slice(0, 0)):
        assert ("place", None) in broken(part.rows(lambda column, keep=keep: column[keep]).audit())


def test_uneven_times_are_found(part: Any) -> None:
    for error in (1e-8, -1e-8):
        t = changed(part.points.t, 300, lambda time, error=error: time + error)
        result = part.with_points(t=t).audit()
        assert ("grid", None) in broken(result)
        assert result.check("grid").worst == pytest.approx(1e-8, rel=1e-3)
    assert ("grid", None) in broken(part.with_points(t=part.points.t + 0.5).audit())
    assert ("grid", None) in broken(part.with_points(t=part.points.t[::-1].copy()).audit())


def test_recorded_velocities_and_accelerations_must_be_those_of_the_motion(part: Any) -> None:
    row = moving(part, 100)
    k = int(np.abs(part.points.acceleration[row]).argmax())
    assert abs(part.points.acceleration[row, k]) > 100
    for name, change in (("velocity", lambda v: v + 0.1), ("acceleration", lambda a: -a)):
        values = changed(getattr(part.points, name), (row, k), change)
        result = part.with_points(**{name: values}).audit()
        assert broken(result) == {(f"recorded_{name}", "XYZ"[k])}
        assert result.check(f"recorded_{name}", "XYZ"[k]).time == pytest.approx(part.points.t[row])


def test_setpoints_off_the_program_are_found_where_the_path_is_not(part: Any) -> None:
    # The audit samples the path in eighths of a piece; the setpoint lies between two of its samples.
    row = moving(part, 100)
    assert part.program is not None
    case = part.with_path(tolerance=np.full(len(part.path), 1e-3))
    base = case.audit().check("deviation").worst
    z = changed(part.points.position, (row, 2), lambda z: z + 10 * base + 1.0)
    result = audit(case.problem, None, case.machine, case.program, case.with_points(position=z).chunks(1000))
    assert result.check("deviation").worst > 0.9
    assert result.check("deviation").time == pytest.approx(part.points.t[row])


def test_the_progress_grows_from_nothing_to_all(part: Any) -> None:
    shares: list[float] = []
    stream = Setpoints(part.problem, part.profile, part.problem.period)
    audit(part.problem, part.profile, part.machine, part.program, stream, progress=shares.append)
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert len(shares) > 3


def test_setpoints_far_off_the_path_are_found_without_searching_for_ever(part: Any) -> None:
    for shift in (100.0, 1e300):
        for profile in (part.profile, None):
            case = part.with_points(position=part.points.position + shift)
            result = audit(case.problem, profile, case.machine, part.program, case.chunks(1000))
            assert ("place", None) in broken(result)


@pytest.mark.parametrize("seed", range(6))
def test_setpoints_of_rubbish_end_in_a_verdict(part: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = len(part.points.t)
    order = rng.integers(0, count, 20_000)
    strange = np.array([0.0, -1.0, 5e-324, 1e160, 1e308, -1e308, math.inf, math.nan])
    case = part.rows(lambda column: column[order])
    for name in ("t", "position"):
        values = getattr(case.points, name)
        hit = rng.random(values.shape) < (0.0, 0.01, 0.5)[seed % 3]
        case = case.with_points(**{name: np.where(hit, rng.choice(strange, values.shape), values)})
    for profile in (case.profile, None):
        assert not audit(case.problem, profile, case.machine, case.program, case.chunks(7000)).ok


def test_a_corner_cut_by_a_step_is_a_chord_error() -> None:
    # Two sides of a square at 10 mm/s: the step across the corner, half on each side, cuts it by 5 µm / √2.
    machine = Machine(
        "jumpy", tuple(Axis(n, 100.0, 1000.0, max_velocity_jump=10.0) for n in "XY"), 0.001, 0.004
    )
    half = 0.305  # the tool reaches the corner after 35.5 ms
    corners = np.array([[0.0, 0.0], [half, 0.0], [half, half]])
    points = np.stack([corners[:-1], 0.5 * (corners[:-1] + corners[1:]), corners[1:]], axis=1)
    path = path_along(CompositeCurve.from_pieces(points, np.full(2, half)), feed=10.0)
    problem = build_problem(path, machine)
    profile = planner("bang-bang")(problem)
    points = Setpoints(problem, profile, 0.001).all()
    row = int(np.flatnonzero(points.position[:, 1] > 0)[0])
    before, after = half - points.position[row - 1, 0], points.position[row, 1]
    cut = before * after / math.hypot(before, after)
    result = audit(problem, profile, machine, setpoints=[points])
    assert result.check("chord").worst == pytest.approx(cut, rel=1e-6)
    assert result.check("acceleration", "X").ok
    narrow = replace(problem, chord_tolerance=cut / 2)
    assert ("chord", None) in broken(audit(narrow, profile, machine, setpoints=[points]))


# Setpoints from other sources, without a path.

PLANE = Machine("plane", (Axis("X", 60.0, 1000.0), Axis("Y", 60.0, 1000.0)))
JUMPY = replace(PLANE, axes=tuple(replace(axis, max_velocity_jump=20.0) for axis in PLANE.axes))


def trapezoid(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Position at times t: 10 mm in 0.25 s, at 1000 mm/s² and up to 50 mm/s."""
    up, down = np.minimum(t, 0.05), np.clip(t - 0.2, 0.0, 0.05)
    return np.asarray(500 * up**2 + 50 * np.clip(t - 0.05, 0, 0.15) + 50 * down - 500 * down**2)


T = np.arange(251) / 1000
STRAIGHT = np.column_stack([trapezoid(T), np.zeros(251)])


def audited(
    t: Any,
    position: Any,
    machine: Machine,
    axes: tuple[str, ...] | None = None,
    velocity: Any = None,
    acceleration: Any = None,
    line: Any = None,
    period: float = 0.001,
    **how: Any,
) -> Audit:
    """The audit of setpoints as read from a file, which may lack velocities and accelerations."""
    names = machine.axis_names if axes is None else axes
    none = np.empty((0, len(names)))
    rates = [none if column is None else column for column in (velocity, acceleration)]
    lines = np.zeros(len(t), np.int32) if line is None else line
    return audit_setpoints(
        SetpointChunk(t, position, *rates, none, lines, names), machine, period=period, **how
    )


def through_a_corner(jump_x: float, jump_y: float, share: float = 0.5) -> NDArray[np.float64]:
    """Positions at 20 mm/s in X; within step 100 the velocity jumps by these amounts [mm/s]."""
    steps = np.tile([0.020, 0.0], (200, 1))
    steps[100:] += [1e-3 * jump_x, 1e-3 * jump_y]
    steps[99] += [share * 1e-3 * jump_x, share * 1e-3 * jump_y]
    return np.concatenate(([[0.0, 0.0]], np.cumsum(steps, axis=0)))


def test_a_trapezoid_from_a_file_is_measured_by_differences_alone() -> None:
    result = audited(T, STRAIGHT, PLANE)
    assert result.failures == ()
    assert result.check("acceleration", "X").worst == pytest.approx(1000.0, rel=1e-9)
    assert result.check("velocity", "X").worst == pytest.approx(50.0, rel=1e-12)
    assert {check.name for check in result.checks} == {
        "velocity",
        "acceleration",
        "jerk",
        "travel",
        "grid",
        "numbers",
    }
    assert audited(T, STRAIGHT, PLANE, jerk=True).check("jerk", "X").judged


def test_each_limit_of_the_machine_is_found_with_its_line() -> None:
    lines = np.arange(251, dtype=np.int32)
    slow = replace(PLANE, axes=(replace(PLANE.axes[0], max_velocity=49.0), PLANE.axes[1]))
    result = audited(T, STRAIGHT, slow, line=lines)
    assert broken(result) == {("velocity", "X")}
    assert result.check("velocity", "X").line == round(1000 * result.check("velocity", "X").time)
    weak = replace(PLANE, axes=(replace(PLANE.axes[0], max_acceleration=999.0), PLANE.axes[1]))
    assert broken(audited(T, STRAIGHT, weak)) == {("acceleration", "X")}
    short = replace(PLANE, axes=(replace(PLANE.axes[0], travel=(0.0, 9.0)), PLANE.axes[1]))
    assert broken(audited(T, STRAIGHT, short)) == {("travel", "X")}
    stiff = replace(PLANE, axes=(replace(PLANE.axes[0], max_jerk=1e5), PLANE.axes[1]))
    assert audited(T, STRAIGHT, stiff).ok
    assert broken(audited(T, STRAIGHT, stiff, jerk=True)) == {("jerk", "X")}


def test_positions_rounded_in_a_file_are_measured_within_their_last_digit() -> None:
    rounded = np.round(0.9999 * STRAIGHT, 6)
    assert broken(audited(T, rounded, PLANE)) == {("acceleration", "X")}
    assert audited(T, rounded, PLANE, resolution=1e-6).ok
    faster = np.round(STRAIGHT * 1.005, 6)
    assert ("acceleration", "X") in broken(audited(T, faster, PLANE, resolution=1e-6))


def test_coordinates_far_out_at_a_short_period_pass() -> None:
    t = np.arange(2501) / 10000
    far = np.column_stack([1e4 + trapezoid(t), np.full(2501, -1e4)])
    assert audited(t, far, PLANE, period=1e-4).failures == ()
    weak = replace(PLANE, axes=(replace(PLANE.axes[0], max_acceleration=999.9), PLANE.axes[1]))
    assert broken(audited(t, far, weak, period=1e-4)) == {("acceleration", "X")}


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 1.0])
def test_a_turn_within_the_allowed_jump_is_a_corner_and_nothing_else_is(share: float) -> None:
    times = np.arange(201) / 1000
    turn = through_a_corner(-20.0, 20.0, share)
    assert audited(times, turn, JUMPY).failures == ()
    assert broken(audited(times, turn, PLANE)) == {("acceleration", "X"), ("acceleration", "Y")}
    # In turn: a jump in Y above the allowed one plus 1 mm/s for the acceleration in a step; a jump of the
    # speed alone, in X; a turn that adds speed in Y.
    assert ("acceleration", "Y") in broken(audited(times, through_a_corner(-20.0, 22.2, share), JUMPY))
    assert ("acceleration", "X") in broken(audited(times, through_a_corner(10.0, 0.0, share), JUMPY))
    assert ("acceleration", "Y") in broken(audited(times, through_a_corner(0.0, 20.0, share), JUMPY))


def test_an_acceleration_kept_up_is_no_corner() -> None:
    # A circle of radius 0.5 mm at 30 mm/s: 1800 mm/s² all the way round.
    angle = np.arange(201) * 0.06
    circle = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    result = audited(np.arange(201) / 1000, circle, JUMPY)
    assert broken(result) == {("acceleration", "X"), ("acceleration", "Y")}


def test_recorded_columns_are_compared_where_there_are_any() -> None:
    speed = np.gradient(STRAIGHT, 0.001, axis=0)
    assert audited(T, STRAIGHT, PLANE, velocity=speed).failures == ()
    result = audited(T, STRAIGHT, PLANE, velocity=1.05 * speed, acceleration=np.full((251, 2), 1001.0))
    names = {"recorded_velocity", "recorded_acceleration", "recorded_change"}
    assert {name for name, _ in broken(result)} == names


@pytest.mark.parametrize("place", [(0, 0), (100, 1), (250, 0)])
def test_a_nan_in_a_file_is_never_fine(place: tuple[int, int]) -> None:
    result = audited(T, changed(STRAIGHT, place, math.nan), PLANE)
    assert ("numbers", None) in broken(result)
    assert not audited(changed(T, 7, math.nan), STRAIGHT, PLANE).ok


def test_columns_are_found_by_name() -> None:
    assert audited(T, STRAIGHT[:, :1], PLANE, axes=("X",)).ok
    assert audited(T, STRAIGHT[:, ::-1], PLANE, axes=("Y", "X")).check("velocity", "X").worst > 49
    with pytest.raises(InputError, match="no axis Q"):
        audited(T, STRAIGHT, PLANE, axes=("X", "Q"))
    with pytest.raises(InputError, match="at least two"):
        audited(T[:1], STRAIGHT[:1], PLANE)


def test_what_rotary_axes_do_is_told_in_degrees() -> None:
    turning = Machine("turning", (Axis("X", 100, 1000), Axis("A", 40, 1000)))
    result = audited(T, STRAIGHT[:, ::-1], turning)
    assert result.check("velocity", "A").unit == "deg/s"
    assert result.check("velocity", "X").unit == "mm/s"
    assert "A velocity 50 deg/s, the limit is 40 deg/s" in result.failures[0]


@pytest.mark.parametrize("method", ["jerk-limited", "s-curve", "ruckig"])
def test_a_setpoint_beside_a_stop_where_the_path_turns_back_may_be_on_either_side(method: str) -> None:
    # The tool is within a nanometre of the stop for several periods, while its acceleration changes.
    axes = [Axis(name, 0.018, 0.167, max_jerk=6.1) for name in "XYZ"]
    there_and_back = "G21 G90\nG1 Y0.01 Z0.01 F0.46\nZ0\nZ-0.01\nM2\n"
    made = plan(there_and_back, Machine("small", axes, period=0.001), method, tolerance=3.6e-5)
    assert made.audit().ok, made.audit().failures

"""The audit on pieces of any degree, rational or not: it passes and fails the same plans as on quadratics."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from feedplan.audit import audit
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.errors import InputError
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners.bang_bang import plan
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.program.program import MoveKind, Program
from tests.along import FREE, path_along, problem_along
from tests.audit.curves import machine_of, sampled
from tests.audit.faults import STRANGE, broken, changed, faster, rubbish
from tests.turns import circle

Array = NDArray[np.float64]
SPEED_LINE = PhaseLaw.SPEED_LINE


def rational(curve: CompositeCurve) -> CompositeCurve:
    """The same pieces over the same parameter; numerator and denominator are multiplied by 1 + t."""
    points = curve.by_piece
    count, degree = points.shape[0], points.shape[1] - 1
    one = np.ones((count, degree + 1)) if curve.weights is None else curve.weights_by_piece
    homogeneous = np.concatenate([points * one[..., None], one[..., None]], axis=2)
    raised = np.zeros((count, degree + 2, points.shape[2] + 1))
    for i in range(degree + 2):
        if i <= degree:
            raised[:, i] += (degree + 1 - i) / (degree + 1) * homogeneous[:, i]
        if i > 0:
            raised[:, i] += 2.0 * i / (degree + 1) * homogeneous[:, i - 1]
    weights = raised[..., -1]
    control = raised[..., :-1] / weights[..., None]
    # The end points are copied, so that they still equal those of the neighbouring pieces exactly.
    control[:, 0], control[:, -1] = points[:, 0], points[:, -1]
    return CompositeCurve(
        control.reshape(-1, curve.axes), weights.ravel(), np.arange(count + 1) * (degree + 2), curve.width
    )


FORMS = {"cubic": lambda c: c.elevated(3), "degree 6": lambda c: c.elevated(6), "rational": rational}


@pytest.fixture(scope="session", params=list(FORMS))
def other(request: pytest.FixtureRequest, part: Any) -> Any:
    """The part with its pieces in another form: higher degree or rational."""
    return part.with_path(curve=FORMS[request.param](part.path.curve))


def test_the_same_plan_in_another_form_measures_the_same(part: Any, other: Any) -> None:
    mine, theirs = part.audit(), other.audit()
    assert theirs.failures == ()
    assert {(c.name, c.axis) for c in mine.checks} == {(c.name, c.axis) for c in theirs.checks}
    for name in ("velocity", "acceleration"):
        for axis in "XYZ":
            assert theirs.check(name, axis).worst == pytest.approx(mine.check(name, axis).worst, rel=1e-6)
    # Several lines use the feed equally, and rounding decides which is named: only the ratio is compared.
    assert theirs.check("feed").ratio == pytest.approx(mine.check("feed").ratio, rel=1e-6)
    for name in ("chord", "deviation"):
        assert theirs.check(name).worst == pytest.approx(mine.check(name).worst, rel=1e-6)


@pytest.mark.parametrize("arc", [0, 7, 40, -1])
def test_p_scaled_on_one_arc_is_a_jump_there(other: Any, arc: int) -> None:
    profile = other.profile
    arc = arc % len(profile)
    scaled = {name: changed(getattr(profile, name), arc, lambda p: 1.001 * p) for name in ("p0", "p1")}
    jumps = [check for check in other.with_profile(**scaled).audit().broken if check.name == "jump"]
    worst = max(jumps, key=lambda check: check.ratio)
    assert other.start(arc) - 1e-9 <= worst.time <= other.start(arc + 1) + 1e-9


def test_every_way_of_breaking_a_profile_is_named(other: Any) -> None:
    profile, problem = other.profile, other.problem
    arc = int(np.flatnonzero((profile.kind == PhaseLaw.AXIS_ACCELERATION) & (profile.p0 != profile.p1))[8])
    assert ("duration", None) in broken(
        other.with_profile(duration=changed(profile.duration, arc, lambda t: 1.00001 * t)).audit()
    )
    assert {"acceleration", "jump"} <= {
        name
        for name, _ in broken(
            other.with_profile(value=changed(profile.value, arc, lambda a: 1.01 * a)).audit()
        )
    }
    for kind in (PhaseLaw.PARAMETER_ACCELERATION, PhaseLaw.FEED, PhaseLaw.AXIS_VELOCITY, 77):
        assert not other.with_profile(kind=changed(profile.kind, arc, kind)).audit().ok
    assert ("order", None) in broken(
        other.with_profile(u0=changed(profile.u0, arc, lambda u: u + 1e-6)).audit()
    )
    slower = changed(problem.feed, 10, 1.0)
    assert broken(other.with_problem(feed=slower).audit()) == {("feed", None)}
    worst = other.audit().check("chord").worst
    assert broken(other.with_problem(chord_tolerance=worst * 0.999).audit()) == {("chord", None)}
    junction = changed(problem.junction_speed, 5, 0.0)
    assert broken(other.with_problem(junction_speed=junction).audit()) == {("junction", None)}


def test_a_setpoint_off_its_place_is_found(other: Any) -> None:
    points = other.points
    row = 40 + int(np.argmax(np.linalg.norm(points.velocity[40:], axis=1) > 20.0))
    along = points.velocity[row] / np.linalg.norm(points.velocity[row])
    for shift in (1e-3 * along, -1e-3 * along, np.array([0.0, 0.0, 1e-3])):
        result = other.with_points(position=changed(points.position, row, lambda q, s=shift: q + s)).audit()
        check = result.check("place")
        assert check.worst == pytest.approx(1e-3, rel=0.05)
        assert (check.time, check.line) == (pytest.approx(points.t[row]), points.line[row])


def test_a_piece_off_the_program_or_its_neighbour_is_found(other: Any) -> None:
    curve, piece = other.path.curve, 12
    line = other.path.line[piece]
    inner = changed(
        curve.control_points, slice(curve.offsets[piece] + 1, curve.offsets[piece + 1] - 1), lambda q: q + 0.1
    )
    result = other.with_path(curve=replace(curve, control_points=inner)).audit()
    assert ("deviation", None) in broken(result)
    assert abs(result.check("deviation").line - line) <= 1
    moved = changed(curve.control_points, curve.offsets[piece], lambda q: q + 1e-6)
    result = other.with_path(curve=replace(curve, control_points=moved)).audit()
    assert ("gap", None) in broken(result)
    assert result.check("gap").line == line


def test_numbers_that_are_none_get_into_no_curve(other: Any) -> None:
    # The curve itself refuses such numbers; that the audit does too is tested in solvers/audit.
    curve = other.path.curve
    columns = ("control_points", math.nan), ("control_points", math.inf), ("weights", -1.0), ("width", 0.0)
    for name, value in columns:
        column = getattr(curve, name)
        column = np.ones(len(curve.control_points)) if column is None else column.copy()
        column[20] = value
        with pytest.raises(InputError):
            replace(curve, **{name: column})
    for name in ("control_points", "offsets", "width"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(curve, name)[0] = 1
        with pytest.raises(ValueError, match="WRITEABLE"):
            getattr(curve, name).flags.writeable = True


@pytest.mark.parametrize("seed", range(6))
def test_a_profile_of_rubbish_ends_in_a_verdict(other: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = STRANGE if seed % 2 else STRANGE[:5]
    changes = rubbish(rng, other.profile, (0.02, 0.2, 1.0)[seed % 3], values)
    changes["kind"] = rng.integers(0, 7, len(other.profile)).astype(np.uint8)
    assert not other.with_profile(**changes).audit().ok


def random_curve(rng: np.random.Generator, weights: bool) -> CompositeCurve:
    degree, axes, count = int(rng.integers(1, 6)), int(rng.integers(2, 5)), int(rng.integers(1, 8))
    points = np.cumsum(rng.normal(size=(count + degree, axes)), axis=0)
    inner = np.cumsum(rng.uniform(0.3, 3.0, count))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree, inner[-1])])
    weight = np.exp(rng.uniform(np.log(0.1), np.log(10.0), len(points))) if weights else None
    curve = CompositeCurve.from_nurbs(points, knots, degree, weight)
    # Different widths: the parameter speed jumps where pieces meet.
    return curve.with_width(rng.uniform(0.2, 4.0, len(curve)))


@given(st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([math.inf, 0.01]))
def test_random_splines_pass_and_a_thousandth_faster_fail(seed: int, weights: bool, chord: float) -> None:
    rng = np.random.default_rng(seed)
    curve = random_curve(rng, weights)
    limits = np.exp(rng.uniform(0.0, 3.0, curve.axes)), np.exp(rng.uniform(0.0, 5.0, curve.axes))
    problem = problem_along(
        path_along(curve, feed=np.exp(rng.uniform(0.0, 3.0))), *limits, chord_tolerance=chord
    )
    if curve.degree.max() == 1:
        # Corners: every junction is a stop.
        problem = replace(problem, junction_speed=np.zeros(len(curve) + 1))
    profile, machine = plan(problem), machine_of(problem)
    assert audit(problem, profile, machine).failures == ()
    assert not audit(problem, faster(profile), machine).ok
    scaled = replace(profile, p0=profile.p0 * 1.001, p1=profile.p1 * 1.001)
    assert not audit(problem, scaled, machine).ok


def lap(chord_tolerance: float = math.inf) -> tuple[Problem, SpeedProfile]:
    """A circle of radius 10 mm from rest to rest."""
    problem = problem_along(
        path_along(circle([0.0, 0.0], 10.0)), FREE, 3000.0, chord_tolerance=chord_tolerance
    )
    return problem, plan(problem)


def test_a_circle_has_the_sagitta_of_its_radius() -> None:
    problem, profile = lap()
    machine = machine_of(problem)
    result = audit(problem, profile, machine)
    assert result.ok
    step = 1e-3 * result.check("feed").worst
    sagitta = 10.0 - math.sqrt(100.0 - step * step / 4)
    assert audit(replace(problem, chord_tolerance=sagitta * (1 + 1e-8)), profile, machine).ok
    result = audit(replace(problem, chord_tolerance=sagitta * 0.99999), profile, machine)
    assert broken(result) == {("chord", None)}
    assert result.check("chord").worst == pytest.approx(sagitta, rel=1e-6)


def test_arcs_along_a_line_of_speed_are_measured() -> None:
    points = np.array([[0.0, 0.0], [6.0, 9.0], [-3.0, 9.0], [8.0, -2.0], [12.0, 4.0]])
    curve = CompositeCurve.from_bezier(points, width=15.0)
    problem = problem_along(path_along(curve, feed=400.0), 1e4, 1e5, chord_tolerance=1e-4)
    profile = plan(problem)
    lines = np.flatnonzero(profile.kind == SPEED_LINE)
    assert len(lines) > 3
    machine = machine_of(problem)
    assert audit(problem, profile, machine).failures == ()
    end = profile.p1.copy()
    end[lines[2]] *= 1.001
    assert "jump" in {name for name, _ in broken(audit(problem, replace(profile, p1=end), machine))}
    late = profile.duration.copy()
    late[lines[2]] *= 1.0001
    assert broken(audit(problem, replace(profile, duration=late), machine)) == {("duration", None)}


@pytest.mark.parametrize("form", ["circle", "cubic"])
def test_setpoints_on_curves_are_followed(form: str) -> None:
    if form == "circle":
        problem, profile = lap()
    else:
        points = np.array([[0.0, 0.0], [6.0, 9.0], [-3.0, 9.0], [8.0, -2.0]])
        problem = problem_along(path_along(CompositeCurve.from_bezier(points, width=15.0)), 1e4, 3000.0)
        profile = plan(problem)
    machine, points_ = machine_of(problem), sampled(problem, profile)
    assert audit(problem, profile, machine, None, [points_]).failures == ()
    assert audit(problem, None, machine, None, [points_]).failures == ()
    row = len(points_.t) // 3
    for shift in (
        2e-6 * points_.velocity[row] / np.linalg.norm(points_.velocity[row]),
        np.array([2e-6, 2e-6]),
    ):
        position = points_.position.copy()
        position[row] += shift
        result = audit(problem, profile, machine, None, [replace(points_, position=position)])
        assert ("place", None) in broken(result)
        assert result.check("place").time == pytest.approx(points_.t[row])
    velocity = points_.velocity.copy()
    velocity[row] *= 1.01
    result = audit(problem, profile, machine, None, [replace(points_, velocity=velocity)])
    assert {name for name, _ in broken(result)} == {"recorded_velocity"}


def test_the_travel_is_kept_inside_a_piece_too() -> None:
    problem, profile = lap()
    for reach, ok in ((10.0 + 1e-9, True), (9.999, False)):
        axes = (Axis("X", 1e9, 3000.0, travel=(-11.0, 11.0)), Axis("Y", 1e9, 3000.0, travel=(-reach, reach)))
        assert audit(problem, profile, Machine("own", axes)).ok == ok
    # The greatest Y lies inside a piece: a half circle as one of degree 3.
    half = CompositeCurve.from_bezier([[1, 0], [1, 2], [-1, 2], [-1, 0]], [1, 1 / 3, 1 / 3, 1], 3.0)
    bent = problem_along(path_along(half), 1e4, 1e4)
    axes = (Axis("X", 1e4, 1e4), Axis("Y", 1e4, 1e4, travel=(-0.999, 0.999)))
    result = audit(bent, plan(bent), Machine("own", axes))
    assert broken(result) == {("travel", "Y")}
    assert result.check("travel", "Y").worst == pytest.approx(1.0, abs=1e-12)


def spline_program(curve: CompositeCurve, **changes: Any) -> Program:
    """One spline move over the whole curve."""
    columns: dict[str, Any] = {
        "name": "spline",
        "axes": tuple("XYZ"[: curve.axes]),
        "start": curve.control_points[0].copy(),
        "kind": np.array([MoveKind.SPLINE], np.uint8),
        "target": curve.control_points[-1:].copy(),
        "feed": np.array([50.0]),
        "line": np.array([7], np.int32),
        "control": np.zeros(1, np.uint8),
        "blend_tolerance": np.full(1, math.nan),
        "fit_tolerance": np.full(1, math.nan),
        "stop": np.zeros(1, np.bool_),
        "dwell": np.zeros(1),
        "arc_move": np.zeros(0, np.int64),
        "arc_centre": np.zeros((0, 3)),
        "arc_normal": np.zeros(0, np.uint8),
        "arc_angle": np.zeros(0),
        "spline_move": np.array([0]),
        "spline_pieces": np.array([0, len(curve)]),
        "splines": curve,
    }
    return Program(**{**columns, **changes})


def long_spline(count: int = 200) -> CompositeCurve:
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(count + 3, 3)), axis=0)
    knots = np.concatenate([np.zeros(4), np.arange(1.0, count), np.full(4, float(count))])
    return CompositeCurve.from_nurbs(points, knots, 3)


def test_a_spline_move_is_followed_by_its_own_pieces_or_parts_of_them() -> None:
    spline = long_spline()
    cut = spline.split(np.arange(0, 200, 3), np.full(67, 0.3))
    for curve in (spline, cut):
        path = path_along(curve, move=np.zeros((len(curve), 2), np.int64), tolerance=1e-3)
        problem = problem_along(path, 100.0, 1000.0)
        machine = machine_of(problem)
        result = audit(problem, None, machine, spline_program(spline))
        assert result.failures == ()
        assert result.check("deviation").worst < 1e-9
        # A piece that leaves the program by twice the tolerance.
        control = curve.control_points.copy()
        control[curve.offsets[120] + 1 : curve.offsets[121] - 1] += 2e-3
        strayed = replace(path, curve=replace(curve, control_points=control))
        result = audit(replace(problem, path=strayed), None, machine, spline_program(spline))
        assert broken(result) == {("deviation", None)}
        assert 1e-3 < result.check("deviation").worst < 4e-3
    # The program makes a detour that the path cuts off: only the distance program to path shows it.
    loop = np.array([[[0, 0], [10, 0]], [[10, 0], [10, 5]], [[10, 5], [10, 0]], [[10, 0], [20, 0]]], float)
    ways = CompositeCurve.from_pieces(loop, np.array([10.0, 5.0, 5.0, 10.0]))
    straight = CompositeCurve.from_pieces(loop[[0, 3]], np.array([10.0, 10.0]))
    path = path_along(straight, move=np.zeros((2, 2), np.int64), tolerance=0.01)
    problem = problem_along(path, 100.0, 1000.0)
    result = audit(problem, None, machine_of(problem), spline_program(ways))
    assert broken(result) == {("deviation", None)}
    assert result.check("deviation").worst == pytest.approx(5.0)


def test_a_circle_is_followed_by_exact_pieces() -> None:
    program = spline_program(
        circle([0.0, 0.0], 10.0),
        axes=("X", "Y"),
        kind=np.array([MoveKind.ARC], np.uint8),
        arc_move=np.array([0]),
        arc_centre=np.zeros((1, 3)),
        arc_normal=np.array([2], np.uint8),
        arc_angle=np.array([2 * math.pi]),
        spline_move=np.zeros(0, np.int64),
        spline_pieces=np.zeros(1, np.int64),
        splines=None,
    )
    curve = circle([0.0, 0.0], 10.0)
    path = path_along(curve, move=np.zeros((4, 2), np.int64), tolerance=1e-6)
    problem = problem_along(path, 100.0, 1000.0)
    result = audit(problem, None, machine_of(problem), program)
    assert result.failures == ()
    assert result.check("deviation").worst < 1e-12
    assert curve.weights is not None
    weights = curve.weights.copy()
    weights[1] *= 1.001
    bulged = replace(path, curve=replace(curve, weights=weights))
    result = audit(replace(problem, path=bulged), None, machine_of(problem), program)
    assert broken(result) == {("deviation", None)}


def along_a_line(*pieces: tuple[float, ...]) -> CompositeCurve:
    """Bézier pieces on a line of slope 4/3; a control point is given by its distance along the line."""
    direction = np.array([0.6, 0.8])
    return CompositeCurve.joined(
        [CompositeCurve.from_bezier(np.outer(x, direction), width=10.0) for x in pieces]
    )


def test_an_infinite_p_is_refused() -> None:
    problem = problem_along(path_along(along_a_line((0, 10), (10, 20)), feed=50.0), [500.0, 400.0], 1000.0)
    profile, machine = plan(problem), machine_of(problem)
    assert audit(problem, profile, machine).ok
    for name in ("p0", "p1"):
        column = getattr(profile, name).copy()
        column[0] = math.inf
        assert ("numbers", None) in broken(audit(problem, replace(profile, **{name: column}), machine))

"""The jerk-limited plan against copp's third-order program, the best open solver of the same problem.

copp (Wang et al.) solves a second-order cone program on fixed stations. It linearises the limits of jerk
about a given speed profile: first its own profile without limits of jerk (reachability analysis), then the
result of the previous program. The limits hold at the stations only; third differences of setpoints every
millisecond show the jerk between them.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial
from time import process_time

import copp_py as copp
import numpy as np
from numpy.typing import NDArray

from benchmarks.jerk_excess import derivatives_by_length, jerk_excess
from benchmarks.named import FREE, butterfly, cubic_by_chord, lemniscate, trefoil
from benchmarks.results import Cell, Result
from benchmarks.timing import best_of
from feedplan import Axis, Machine
from feedplan._solvers import plan_jerk_limited
from feedplan.constraints.problem import Problem, build_problem
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.path import Path
from feedplan.planners import jerk_limited, planner
from feedplan.planners._jerk import jerk_limits

Array = NDArray[np.float64]
VELOCITY, ACCELERATION, JERK = 250.0, 3000.0, 50_000.0
# Number of copp's stations, about uniform in length (with 4001 its second program for the butterfly fails).
# Programs are repeated until one reduces the time by less than GAIN, at most MOST_PROGRAMS times.
STATIONS, GAIN, MOST_PROGRAMS = 4201, 1e-4, 10
PERIOD = 1e-3
# The default accuracy of a plan.
ACCURACY = 1e-4


def six_joints() -> CompositeCurve:
    """A C2 cubic spline of six joints through 12 random points in a cube of 100 mm (seed 6)."""
    return cubic_by_chord(np.random.default_rng(6).uniform(0.0, 100.0, (12, 6)), "natural")


CURVES: dict[str, Callable[[], CompositeCurve]] = {
    "lemniscate": lemniscate,
    "trefoil": trefoil,
    "butterfly": butterfly,
    "six joints": six_joints,
}


def run(quick: bool = False) -> Result:
    """Time, excess of jerk and computing time of feedplan and copp on every curve."""
    stations = 401 if quick else STATIONS
    rows: list[dict[str, Cell]] = []
    for name, make in itertools.islice(CURVES.items(), 1 if quick else None):
        problem = _problem(make())
        proven = partial(planner("jerk-limited"), problem)
        settings = (jerk_limits(problem), jerk_limited.RESOLUTION, jerk_limited.GAP * ACCURACY)
        alone = partial(plan_jerk_limited, problem, *settings, False)
        profile, with_bound, ours = proven(), best_of(proven, 5), best_of(alone, 5)
        excess = jerk_excess(problem, profile).jerk
        row = partial(_row, name, profile.time, ours.processor)
        rows.append(row("feedplan", profile.time, excess, ours.processor))
        rows.append(row("the same with its bound", profile.time, excess, with_bound.processor))
        begin = process_time()
        time, excess, programs = _by_copp(problem, stations)
        rows.append(row(f"copp, {programs} programs", time, excess, process_time() - begin))
    return Result(
        f"Jerk-limited plans against copp {copp.version()}",
        tuple(rows),
        (
            f"{VELOCITY:g} mm/s, {ACCELERATION:g} mm/s², {JERK:g} mm/s³ of each axis, rest to rest.",
            f"copp: {stations} stations, lengths in units of the path's, from its reachability profile.",
            f"Programs until one gains less than {GAIN:g} of the time.",
            "excess of jerk: ours by exact derivatives, copp's by third differences of setpoints every 1 ms.",
            "computing: processor time of all threads, ours the best of five.",
            "ratios to the plan alone, without its lower bound: copp proves none.",
        ),
    )


def _problem(curve: CompositeCurve) -> Problem:
    names = "XYZABC"[: curve.axes]
    axes = tuple(Axis(name, VELOCITY, ACCELERATION, max_jerk=JERK) for name in names)
    machine = Machine("against-copp", axes, chord_tolerance=float("inf"))
    return build_problem(Path.from_curve(curve, feed=FREE), machine)


def _by_copp(problem: Problem, stations: int) -> tuple[float, float, int]:
    """copp's time [s], the relative excess of its third differences over the limit of jerk, and the number of
    programs that it solved."""
    piece, u, s = _stations(problem, stations)
    total = s[-1]
    first, second, third = derivatives_by_length(problem, piece, u)
    position = problem.curve.evaluate(piece, u)[0]
    s = s / total
    axes = position.shape[1]
    robot = copp.Robot(axes, capacity=len(s))
    robot.append_s(s)
    # Lengths are divided by the whole length: q' stays the same, each higher derivative gets one more factor.
    robot.set_q(position / total, first, second * total, 0, dddq=third * total**2)
    for add, limit in (
        (robot.add_velocity_limits, VELOCITY),
        (robot.add_acceleration_limits, ACCELERATION),
        (robot.add_jerk_limits, JERK),
    ):
        most = np.full(axes, limit / total)
        add(most, -most, start_idx_s=0, length=len(s))
    reach = copp.solver.topp2_ra
    speed_sq = reach.solve(reach.Problem(robot.constraints, (0, len(s) - 1), (0.0, 0.0)), reach.Options())
    cone = copp.solver.topp3_socp
    time, before, programs, accelerations = np.inf, np.inf, 0, None
    while programs < MOST_PROGRAMS and not time > (1.0 - GAIN) * before:
        program = cone.Problem(robot.constraints, speed_sq, b_linearization=accelerations)
        profile = cone.solve(program)
        speed_sq, accelerations, before, programs = profile.a, profile.b, time, programs + 1
        time, arrivals = copp.interpolation.s_to_t_topp3(s, profile)
    at = np.asarray(
        copp.interpolation.t_to_s_topp3_uniform(s, profile, arrivals, PERIOD, include_final=False)
    )
    moved = problem.path.evaluate(np.minimum(at * total, problem.path.length))
    jerks = np.abs(np.diff(moved, 3, axis=0)) / PERIOD**3
    return float(time), float(jerks.max()) / JERK - 1.0, programs


def _stations(problem: Problem, count: int) -> tuple[NDArray[np.int64], Array, Array]:
    """Stations about equally far apart: their pieces, parameters, and lengths from the start [mm]."""
    table, pieces = problem.path.lengths, np.arange(len(problem.path))
    ends = np.append(table.length(pieces, np.zeros(len(pieces))), table.total)
    share = np.maximum(np.round((count - 1) * np.diff(ends) / table.total).astype(int), 2)
    within = [np.linspace(*span, n, endpoint=False) for *span, n in zip(ends, ends[1:], share, strict=False)]
    s = np.append(np.concatenate(within), table.total)
    piece = np.append(np.repeat(pieces, share), pieces[-1])
    found, u = table.locate(s)
    # A station where two pieces meet belongs to the piece that begins there.
    return piece, np.where(found == piece, u, 0.0), s


def _row(
    curve: str, best: float, unit: float, solver: str, time: float, excess: float, computing: float
) -> dict[str, Cell]:
    """One row of the table; its ratios are to the time `best` [s] and the computing time `unit` [s]."""
    return {
        "curve": curve,
        "solver": solver,
        "time [s]": f"{time:.5f}",
        "time over ours": f"{time / best:.4f}",
        "excess of jerk": excess,
        "computing [s]": computing,
        "computing over ours": computing / unit,
    }

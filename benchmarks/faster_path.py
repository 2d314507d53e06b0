"""Time saved by paths that are fitted to the planned speed, on polylines of ten kinds, and their cost."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.results import Cell, Result
from feedplan.machine.machine import Axis, Machine
from feedplan.planners import MethodName
from feedplan.planning import Plan, plan
from feedplan.program.gcode import read_gcode
from feedplan.program.program import Program

# Velocity [mm/s], acceleration [mm/s²] and jerk [mm/s³] of both axes; on the fast machine jerk governs.
LIMITS = {"slow": (100.0, 500.0, 5e4), "fast": (250.0, 3000.0, 5e4)}
TOLERANCES = (0.01, 0.05, 0.1)
PERIOD = 0.0005

Array = NDArray[np.float64]


def corner(turn: float) -> Array:
    """Two lines of 10 mm; the direction changes by `turn` [deg]."""
    angle = np.radians(turn)
    return 10.0 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0 + np.cos(angle), np.sin(angle)]])


def zigzag() -> Array:
    """Ten passes of 10 mm, 1 mm apart."""
    x = 10.0 * np.array([0.0, 1.0, 1.0, 0.0])
    return np.array([[x[i % 4], i // 2] for i in range(21)], float)


def square() -> Array:
    return 100.0 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])


def facets() -> Array:
    """A circle of chords of 0.3 mm; the circle is 0.01 mm from the middle of each chord."""
    radius = 0.3**2 / 0.08 + 0.005
    count = round(2.0 * np.pi * radius / 0.3)
    angle = np.arange(count + 1) * 2.0 * np.pi / count
    return radius * np.column_stack((np.sin(angle), 1.0 - np.cos(angle)))


def loops() -> Array:
    """Trochoidal milling: circles of 2 mm that advance by 0.8 mm a turn, in chords of 18°."""
    angle = np.radians(18.0) * np.arange(101)
    return np.column_stack((2.0 * np.sin(angle) + 0.8 * angle / (2.0 * np.pi), 2.0 - 2.0 * np.cos(angle)))


def scan() -> Array:
    """A finishing pass over a mesh: uneven chords, heights of a smooth form with noise of 5 µm."""
    random = np.random.default_rng(3)
    x = np.concatenate(([0.0], np.cumsum(random.uniform(0.15, 0.6, 60))))
    form = 1.5 * np.sin(2.0 * np.pi * x / 12.0) + 0.3 * np.sin(2.0 * np.pi * x / 3.1)
    return np.column_stack((x, form + 0.005 * random.standard_normal(len(x))))


CASES: dict[str, Callable[[], Array]] = {
    **{f"corner of {turn}°": lambda turn=turn: corner(turn) for turn in (45, 90, 135, 170)},
    "zigzag": zigzag,
    "square": square,
    "facets of a circle": facets,
    "trochoid": loops,
    "noisy scan line": scan,
}


def machine(limits: str) -> Machine:
    """Two equal axes."""
    v, a, j = LIMITS[limits]
    return Machine(limits, tuple(Axis(name, v, a, max_jerk=j) for name in "XY"), period=PERIOD)


def program(points: Array) -> Program:
    """The lines between the points, at a feed that limits nothing."""
    lines = "\n".join(f"G1 X{x:.6f} Y{y:.6f}" for x, y in points[1:])
    text = f"G21 G90 G64\nG1 X{points[0, 0]:.6f} Y{points[0, 1]:.6f} F6000000\n{lines}\nM2\n"
    return read_gcode(text.encode(), machine("fast"), "lines.ngc")


def run(quick: bool = False) -> Result:
    """Plans all cases along the fitted path and, in one to three rounds, along paths fitted to the speed."""
    some = ("corner of 90°", "noisy scan line") if quick else tuple(CASES)
    tolerances = (0.05,) if quick else TOLERANCES
    methods: tuple[MethodName, ...] = ("jerk-limited", "bang-bang")
    rows = [
        _row(case, limits, tolerance, method)
        for method in methods
        for case in some
        for limits in LIMITS
        for tolerance in tolerances
    ]
    return Result(
        "Times along the path as fitted and along one fitted to the speed, with up to three rounds [s]",
        tuple(rows),
        (
            "gain: by `fastest` of one round, in percent. promised: by the step after the third round.",
            "cost: processor time of fit and plan with 1, 2 and 3 rounds over that of `as-fitted`.",
        ),
    )


def _row(case: str, limits: str, tolerance: float, method: MethodName) -> dict[str, Cell]:
    points = program(CASES[case]())
    known = machine(limits)

    def made(**options: object) -> tuple[Plan, float]:
        begin = time.process_time()
        found = plan(points, known, method, tolerance=tolerance, **options)  # type: ignore[arg-type]
        return found, time.process_time() - begin

    made(path="fastest", path_rounds=2)  # loads all packages before anything is timed
    first, cost = made()
    rounds = [made(path="fastest", path_rounds=count) for count in (1, 2, 3)]
    once, twice, thrice = (found for found, _ in rounds)
    promised = thrice.gain.promised if thrice.gain else ()
    return {
        "method": method,
        "case": case,
        "limits": limits,
        "tolerance": tolerance,
        "as-fitted": round(first.time, 5),
        "fastest": round(once.time, 5),
        "gain [%]": round(100.0 * (1.0 - once.time / first.time), 2),
        "2 rounds": round(twice.time, 5),
        "3 rounds": round(thrice.time, 5),
        "promised": round(sum(promised[-1:]), 5),
        "cost": ", ".join(f"{time / cost:.1f}" for _, time in rounds),
        "audit": "ok" if all(found.audit().ok for found, _ in rounds) else "failed",
    }

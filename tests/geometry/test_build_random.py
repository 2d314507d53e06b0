"""Random programs: for all moves, modes, feeds and tolerances, the path keeps its promises."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from feedplan.geometry.build import build_path
from feedplan.machine.machine import Machine
from feedplan.program.program import MoveKind
from tests.campaign import examples

MILL = Machine.load("mill")


@st.composite
def polylines(draw: st.DrawFn) -> tuple[np.ndarray[Any, Any], dict[str, Any]]:
    """Points with steps from a nanometre to a centimetre, smooth or not, some rounded; and their columns."""
    count = draw(st.integers(1, 40))
    seed = draw(st.integers(0, 2**32 - 1))
    random = np.random.default_rng(seed)
    kind = draw(st.sampled_from(["jumpy", "smooth", "mixed"]))
    length = 10.0 ** random.uniform(*draw(st.sampled_from([(-3, -2), (-1, 0), (-6, 1)])), size=(count, 1))
    turn = {"jumpy": math.pi, "smooth": 0.2, "mixed": random.choice([0.05, 2.0], size=count)}[kind]
    heading = np.cumsum(random.normal(size=count) * turn)
    climb = random.normal(size=count) * draw(st.sampled_from([0.0, 0.3]))
    step = length * np.stack([np.cos(heading), np.sin(heading), climb], axis=1)
    points = np.vstack([np.zeros(3), np.cumsum(step, axis=0)])
    if draw(st.booleans()):
        points = np.round(points, 3)
        points = points[np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))]
    count = len(points) - 1
    columns: dict[str, Any] = {}
    if draw(st.booleans()):
        columns["feed"] = random.choice([5.0, 20.0, 100.0], size=count)
    if draw(st.booleans()):
        columns["control"] = random.choice([0, 1, 2, 2, 2, 2], size=count)
    if draw(st.booleans()):
        columns["kind"] = random.choice([MoveKind.RAPID, *[MoveKind.LINE] * 5], size=count)
    if draw(st.booleans()):
        columns["blend_tolerance"] = random.choice([math.nan, 0.0, 1e-3, 0.1], size=count)
        columns["fit_tolerance"] = random.choice([math.nan, 0.0, 1e-3], size=count)
    return points, columns


@settings(max_examples=examples(60))
@given(polylines(), st.sampled_from([None, None, 0.0, 1e-4, 0.05, 2.0]))
def test_random_polylines_keep_every_promise(
    make_program: Any, check: Any, polyline: tuple[Any, dict[str, Any]], tolerance: float | None
) -> None:
    points, columns = polyline
    if len(points) < 2:
        return
    program = make_program(points, **columns)
    path = build_path(program, MILL, tolerance)
    check(program, path)


@settings(max_examples=examples(25))
@given(st.integers(0, 2**32 - 1), st.sampled_from([None, 1e-3, 0.2]))
def test_random_mixtures_of_lines_and_arcs_keep_every_promise(
    make_program: Any, check: Any, seed: int, tolerance: float | None
) -> None:
    random = np.random.default_rng(seed)
    points, arcs = [np.zeros(3)], {}
    heading = 0.0
    for move in range(12):
        # Half of the joints are tangent, up to the rounding of coordinates as posts write them.
        heading += random.choice([0.0, random.normal()])
        direction = np.array([math.cos(heading), math.sin(heading), 0.0])
        if random.random() < 0.5:
            radius, angle = 10.0 ** random.uniform(-1, 1.5), random.normal() * 2.5
            side = math.copysign(1.0, angle) * np.array([-direction[1], direction[0], 0.0])
            centre = points[-1] + radius * side
            cos, sin = math.cos(angle), math.sin(angle)
            x, y, _ = points[-1] - centre
            turned = np.array([cos * x - sin * y, sin * x + cos * y, random.choice([0.0, 1.0])])
            end = centre + turned
            end = np.round(end, 3)
            from_start, from_end = points[-1] - centre, end - centre
            true = math.atan2(from_end[1], from_end[0]) - math.atan2(from_start[1], from_start[0])
            angle += (true - angle + math.pi) % (2 * math.pi) - math.pi
            arcs[move] = (centre, 2, angle)
            heading += angle
        else:
            end = np.round(points[-1] + 10.0 ** random.uniform(-1, 1.5) * direction, 3)
        points.append(end)
    program = make_program(points, arcs=arcs, control=random.choice([1, 2, 2], size=12))
    check(program, build_path(program, MILL, tolerance))


def test_the_path_does_not_depend_on_the_number_of_threads(make_program: Any) -> None:
    import subprocess
    import sys

    # Three runs with thousands of pieces, with gentle and sharp turns.
    script = """
import hashlib, numpy as np
from feedplan.geometry.build import build_path
from feedplan.machine.machine import Machine
from feedplan.program.read import read_program
random = np.random.default_rng(3)
n = 20000
heading = np.cumsum(random.normal(size=n) * random.choice([0.02, 2.0], size=n))
target = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], axis=1) * 0.3, axis=0)
lines = [
    f"G1 X{x:.6f} Y{y:.6f} F{feed}" + ("\\nG4 P0.1" if i % 7001 == 7000 else "")
    for i, ((x, y), feed) in enumerate(zip(target, random.choice([600, 1200], size=n)))
]
machine = Machine.load("mill")
program = read_program("G21 G90 G64 P0.01\\n" + "\\n".join(lines) + "\\nM2\\n", machine)
path = build_path(program, machine)
columns = [path.curve.control_points, path.curve.offsets, path.curve.width, path.runs, path.line]
content = b"".join(np.ascontiguousarray(column).tobytes() for column in columns)
print(len(path), hashlib.sha256(content).hexdigest())
"""
    results = {
        subprocess.run(
            [sys.executable, "-c", script],
            env={"RAYON_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in ("1", "2", "5")
    }
    assert len(results) == 1

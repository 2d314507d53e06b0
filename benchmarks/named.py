"""Problems with a name: published curves, random splines, and the programs of the examples."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from functools import partial
from math import comb
from pathlib import Path as FilePath
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from benchmarks.problems import MACHINE, random_spline
from feedplan import Axis, Machine, Path
from feedplan.curves.composite import CompositeCurve
from feedplan.geometry.build import build_path
from feedplan.program.program import Program
from feedplan.program.read import read_program

Array = NDArray[np.float64]
HERE = FilePath(__file__).parent
EXAMPLES = HERE.parent / "examples"
CURVES = Machine(name="curves", axes=tuple(Axis(name, 250.0, 3000.0) for name in "XYZ"))
FAN = Machine(name="fan", axes=tuple(Axis(name, 100.0, 1000.0) for name in "XYZ"))
# A feed that no axis of these machines reaches.
FREE = 1e9
# Example: its machine and its number of blocks.
PROGRAMS = {"vase": ("vase", 5000), "lettering": ("router", 2000), "head": ("mill", 5000)}

Named = tuple[Program | Path, Machine]


def butterfly_nurbs() -> tuple[Array, Array, int, Array]:
    """Control points, knots (as most publications print them, with the known times), degree, weights."""
    data = _published("butterfly")
    knots = np.round(np.array(data["knots"], dtype=float), 4)
    weights = np.array(data["weights"], dtype=float)
    return np.array(data["control_points"], dtype=float), knots, int(data["degree"]), weights


def butterfly() -> CompositeCurve:
    """The butterfly in Bézier pieces."""
    return CompositeCurve.from_nurbs(*butterfly_nurbs())


def fan() -> CompositeCurve:
    """Closed C2 cubic spline through the fan's points, the parameter being the chord length."""
    points = np.array(_published("fan")["points"], dtype=float)
    return cubic_by_chord(points, "periodic")


def cubic_by_chord(points: Array, ends: str) -> CompositeCurve:
    """The C2 cubic spline through points (n, axes) by chord length; `ends` as for scipy's `bc_type`."""
    chord = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    return CompositeCurve.from_bspline(make_interp_spline(chord, points, bc_type=ends))


def lemniscate() -> CompositeCurve:
    """The curve 50 (cos θ, sin θ cos θ) [mm], once round from its crossing."""
    a = 50.0
    return harmonic([np.array([a, 0.0]), np.zeros(2)], [np.zeros(2), np.array([0.0, a / 2])], np.pi / 2)


def trefoil() -> CompositeCurve:
    """The curve 20 (sin θ + 2 sin 2θ, cos θ − 2 cos 2θ, −sin 3θ) [mm], once round."""
    b = 20.0
    cosines = [np.array([0.0, b, 0.0]), np.array([0.0, -2 * b, 0.0]), np.zeros(3)]
    sines = [np.array([b, 0.0, 0.0]), np.array([2 * b, 0.0, 0.0]), np.array([0.0, 0.0, -b])]
    return harmonic(cosines, sines, 0.3)


def harmonic(cosines: list[Array], sines: list[Array], start: float) -> CompositeCurve:
    """The curve Σ cosines[k] cos kθ + sines[k] sin kθ once round from `start`, as rational quarter turns.

    With x = tan(φ/2), cos φ = (1 − x²)/(1 + x²) and sin φ = 2x/(1 + x²): degree 2m for m harmonics.
    """
    m = len(cosines)
    square = np.polynomial.Polynomial([1.0, 0.0, 1.0])
    unit = np.polynomial.Polynomial([1.0, 2.0j, -1.0])
    degree = 2 * m
    pieces = []
    for quarter in range(4):
        turn = start + quarter * np.pi / 2
        rows = []
        for axis in range(len(cosines[0])):
            total = np.zeros(degree + 1, dtype=complex)
            for k in range(1, m + 1):
                wave = (unit**k * square ** (m - k)).coef * np.exp(1j * k * turn)
                total[: len(wave)] += (cosines[k - 1][axis] - 1j * sines[k - 1][axis]) * wave
            rows.append(total.real)
        rows.append((square**m).coef)
        # From powers of x to Bernstein form on [0, 1].
        to_bernstein = np.array(
            [[comb(i, j) / comb(degree, j) for j in range(degree + 1)] for i in range(degree + 1)]
        )
        homogeneous = to_bernstein @ np.array(rows).T
        weights = homogeneous[:, -1]
        pieces.append(CompositeCurve.from_bezier(homogeneous[:, :-1] / weights[:, None], weights))
    return CompositeCurve.joined(pieces, 1e-9)


def example(name: str) -> ModuleType:
    """The module of an example."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def part(name: str, blocks: int, model: str | None = None) -> tuple[Program, Machine]:
    """An example's program of about `blocks` blocks, and its own machine or the bundled `model`."""
    machine = Machine.load(model or PROGRAMS[name][0])
    return read_program(example(name).program(blocks), machine, name=f"{name}.ngc"), machine


def _curve(make: Callable[[], CompositeCurve], machine: Machine) -> Named:
    return Path.from_curve(make(), feed=FREE), machine


def _spline(pieces: int) -> Named:
    return random_spline(pieces), MACHINE


# Every problem by its name, smallest first.
NAMED: dict[str, Callable[[], Named]] = {
    "lemniscate": partial(_curve, lemniscate, CURVES),
    "trefoil": partial(_curve, trefoil, CURVES),
    "butterfly": partial(_curve, butterfly, CURVES),
    "fan": partial(_curve, fan, FAN),
    **{f"spline-{count}": partial(_spline, count) for count in (10, 100, 1000, 10_000, 100_000)},
    **{name: partial(part, name, blocks) for name, (_, blocks) in PROGRAMS.items()},
}


def path_of(source: Program | Path, machine: Machine) -> Path:
    """The path that is planned for a program or a path."""
    return source if isinstance(source, Path) else build_path(source, machine)


def _published(name: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((HERE / "curves" / f"{name}.json").read_text(encoding="utf-8"))
    return content

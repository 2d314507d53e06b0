"""The least time with limits of jerk on the grid of a profile, by two other solvers.

w = v² is a C¹ cubic of the length in each interval; ramps w ∝ s^(4/3) lead from rest and to rest; limits hold
at four points of each interval.

- IPOPT solves this problem directly.
- Clarabel solves a sequence of quadratic programs. The jerk constraint |L w| ≤ J w^(−1/2) has a convex right
  side; it is replaced by its tangent, which lies below, so that every plan keeps the limit.
- "pseudo-jerk" is the plan of controllers and of earlier works, made in one stage: w on the right side of the
  jerk constraint is the optimum without limits of jerk.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

from benchmarks.jerk_excess import derivatives_by_length, lengths
from feedplan.constraints.problem import Problem
from feedplan.profile import PhaseLaw, SpeedProfile

Array = NDArray[np.float64]
# Matrices for the scaled unknowns, each with the upper limits of its rows.
Rows = list[tuple[Any, Array]]
PLACES = np.array([0.0, 1 / 3, 2 / 3, 1.0])
NODES, WEIGHTS = leggauss(4)
# The initial w, as a share of the given plan's w.
START = 0.5
# Greatest number of quadratic programs, and the relative gain of time below which they end.
PROGRAMS, GAIN = 60, 1e-8


@dataclass(frozen=True)
class Grid:
    """A grid of n intervals: lengths `h` (n,), derivatives of the axes by length `q` (3, 4 n, axes) at four
    points of each, limits, lengths of both ramps, and a plan `x` (2 n + 2,): w and w' at the stations."""

    h: Array
    q: Array
    speed_sq: Array
    acceleration: Array
    jerk: Array
    ramps: tuple[float, float]
    x: Array

    @cached_property
    def reference(self) -> Array:
        """The unit of each unknown (2 n + 2,)."""
        w = self.x[::2]
        step = np.maximum(np.append(self.h, 0.0), np.append(0.0, self.h))
        return np.stack([w, w / step], axis=1).ravel()

    def rows(self, t: Array, order: int) -> sp.csr_matrix:
        """The matrix from scaled unknowns to w, w' or w'' (`order`) at t in [0, 1] of every interval."""
        hermite = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], dtype=float)
        basis = polyval(t, polyder(hermite.T, order)).T
        n, m = len(self.h), len(t)
        scale = np.stack([1 + 0 * self.h, self.h, 1 + 0 * self.h, self.h], axis=1)
        values = basis[None] * scale[:, None, :] / self.h[:, None, None] ** order
        columns = np.broadcast_to((2 * np.arange(n))[:, None, None] + np.arange(4), (n, m, 4))
        row = np.broadcast_to(np.arange(n * m).reshape(n, m, 1), (n, m, 4))
        matrix = sp.csr_matrix((values.ravel(), (row.ravel(), columns.ravel())), (n * m, 2 * n + 2))
        return sp.csr_matrix(matrix @ sp.diags(self.reference))

    @cached_property
    def motion(self) -> tuple[Any, list[Any], list[Any]]:
        """Rows of w, and of each axis's acceleration and L w, all divided by their limits."""
        w, w1, w2 = (self.rows(PLACES, order) for order in range(3))
        diagonal = sp.diags
        accelerations, jerks = [], []
        for axis in range(self.q.shape[2]):
            q1, q2, q3 = self.q[:, :, axis]
            a, j = self.acceleration[axis], self.jerk[axis]
            accelerations.append(diagonal(q2 / a) @ w + diagonal(q1 / (2 * a)) @ w1)
            jerks.append(diagonal(q3 / j) @ w + diagonal(1.5 * q2 / j) @ w1 + diagonal(0.5 * q1 / j) @ w2)
        return diagonal(1 / self.speed_sq) @ w, accelerations, jerks

    @cached_property
    def ends(self) -> Any:
        """Rows that are 0 if both ramps join the grid with continuous acceleration."""
        last = len(self.x) - 2
        rows = sp.lil_matrix((2, len(self.x)))
        rows[0, 0], rows[0, 1] = -4 / (3 * self.ramps[0]), 1
        rows[1, last], rows[1, last + 1] = 4 / (3 * self.ramps[1]), 1
        rows = sp.csr_matrix(rows) @ sp.diags(self.reference)
        return sp.diags(1 / np.asarray(abs(rows).max(axis=1).todense()).ravel()) @ rows

    @cached_property
    def pace(self) -> tuple[Any, Array]:
        """Rows of w and weights of the time integral: the time is Σ weights/√w [s]."""
        rows = self.rows((NODES + 1) / 2, 0)
        weights = (self.h[:, None] / 2 * WEIGHTS).ravel()
        ends = sp.csr_matrix((len(self.x), len(self.x)))
        ends = sp.diags(self.reference).tocsr()[[0, len(self.x) - 2]]
        return sp.vstack([rows, ends]).tocsr(), np.append(weights, 3 * np.array(self.ramps))

    def time(self, z: Array) -> float:
        """The time of the plan with these scaled unknowns [s]."""
        rows, weights = self.pace
        return float(np.sum(weights / np.sqrt(rows @ z)))


def grid_of(problem: Problem, profile: SpeedProfile) -> Grid:
    """The grid of a profile from rest to rest in which each ramp is one phase."""
    cubic = np.flatnonzero(profile.kind == PhaseLaw.SPEED_CUBIC)
    assert len(cubic) == len(profile) - 2
    piece, u0, u1 = profile.piece, profile.u0, profile.u1
    u = u0[:, None] + (u1 - u0)[:, None] * PLACES
    arc = lengths(problem, piece, u0, u)[:, -1]
    places = np.clip(u[cubic].ravel(), 1e-12, None)
    pieces = np.repeat(piece[cubic], 4)
    # At the ends of an interval the derivatives are those of its own piece.
    q = np.stack(derivatives_by_length(problem, pieces, places))
    square = (problem.curve.evaluate(pieces, places, 1)[1] ** 2).sum(axis=1).reshape(-1, 4)
    with np.errstate(divide="ignore"):
        speed_sq = np.minimum(((problem.max_velocity / q[0]) ** 2).min(axis=1), problem.feed[pieces] ** 2)
    w = np.append(profile.p0[cubic] * square[:, 0], profile.p1[cubic[-1]] * square[-1, 3])
    slope = 2 * np.append(profile.a0[cubic], profile.a1[cubic[-1]])
    return Grid(
        arc[cubic],
        q,
        speed_sq,
        problem.max_acceleration,
        problem.max_jerk,
        (float(arc[0]), float(arc[-1])),
        np.stack([w, slope], axis=1).ravel(),
    )


def by_ipopt(grid: Grid) -> float:
    """The least time on the grid by IPOPT [s]."""
    import casadi

    def of(matrix: Any) -> Any:
        m = matrix.tocsc()
        pattern = casadi.Sparsity(*m.shape, m.indptr.tolist(), m.indices.tolist())
        return casadi.DM(pattern, m.data)

    z = casadi.MX.sym("z", len(grid.x))
    speed, accelerations, jerks = grid.motion
    root = casadi.sqrt(of(grid.rows(PLACES, 0)) @ z)
    rows = [of(speed) @ z, *(of(row) @ z for row in accelerations), *((of(row) @ z) * root for row in jerks)]
    rows.append(of(grid.ends) @ z)
    pace, weights = grid.pace
    upper = np.ones(sum(row.shape[0] for row in rows))
    lower = -upper
    lower[: speed.shape[0]] = 1e-9
    upper[-2:] = lower[-2:] = 0.0
    program = {
        "x": z,
        "f": casadi.dot(casadi.DM(weights), 1 / casadi.sqrt(of(pace) @ z)),
        "g": casadi.vertcat(*rows),
    }
    options = {"ipopt.print_level": 0, "print_time": 0, "ipopt.tol": 1e-7, "ipopt.sb": "yes"}
    solver = casadi.nlpsol("third_order", "ipopt", program, options)
    start = START * grid.x / grid.reference
    most = np.full(len(start), np.inf)
    most[[0, -2]] = 1.0
    least = np.where(np.arange(len(start)) % 2 == 0, 1e-6, -np.inf)
    result = solver(x0=start, lbg=lower, ubg=upper, lbx=least, ubx=most)
    assert solver.stats()["success"], solver.stats()["return_status"]
    return float(result["f"])


def by_clarabel(grid: Grid) -> float:
    """The time on the grid by quadratic programs with tangents of the jerk constraint [s]."""
    jerks, w = grid.motion[2], grid.rows(PLACES, 0)

    def tangents(z: Array) -> Rows:
        at = w @ z
        # w^(−1/2) is convex, so it lies above its tangent.
        tangent = sp.diags(0.5 * at**-1.5) @ w
        return [(sign * row + tangent, 1.5 / np.sqrt(at)) for row in jerks for sign in (1, -1)]

    return grid.time(_descent(grid, tangents))


def pseudo_jerk(grid: Grid) -> float:
    """The time [s] of the one-stage plan: |L w| √w̄ ≤ J, w ≤ w̄, with w̄ the optimum without jerk limits."""
    jerks, w = grid.motion[2], grid.rows(PLACES, 0)
    top = w @ _descent(grid, lambda _: [])
    rows = [(sign * row, top**-0.5) for row in jerks for sign in (1, -1)]
    return grid.time(_descent(grid, lambda _: [*rows, (w, top)]))


def _descent(grid: Grid, jerk_rows: Callable[[Array], Rows]) -> Array:
    """Scaled unknowns of least time, by quadratic programs until one gains less than `GAIN`. `jerk_rows`
    makes the rows of each program from the unknowns of the previous one."""
    import clarabel

    speed, accelerations, _ = grid.motion
    w = grid.rows(PLACES, 0)
    pace, weights = grid.pace
    z = START * grid.x / grid.reference
    first = sp.identity(len(z), format="csr")[[0, len(z) - 2]]
    fixed = [speed, *accelerations, *(-row for row in accelerations), first]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    for _ in range(PROGRAMS):
        own = jerk_rows(z)
        matrix = sp.vstack([grid.ends, *fixed, *(row for row, _ in own), -w]).tocsr()
        limits = [np.ones(row.shape[0]) for row in fixed]
        right = np.concatenate([np.zeros(2), *limits, *(bound for _, bound in own), -1e-3 * (w @ z)])
        size = np.maximum(np.asarray(abs(matrix).max(axis=1).todense()).ravel(), 1e-12)
        matrix, right = sp.diags(1 / size) @ matrix, right / size
        value = pace @ z
        slope = pace.T @ (-0.5 * weights * value**-1.5)
        curvature = (pace.T @ sp.diags(0.75 * weights * value**-2.5) @ pace).tocsc()
        cones = [clarabel.ZeroConeT(2), clarabel.NonnegativeConeT(len(right) - 2)]
        solver = clarabel.DefaultSolver(
            sp.triu(curvature).tocsc(), slope - curvature @ z, matrix.tocsc(), right, cones, settings
        )
        found = np.array(solver.solve().x)
        before, step = grid.time(z), 1.0
        while step > 1e-6 and not grid.time(z + step * (found - z)) <= before:
            step /= 2
        z = z + step * (found - z)
        if before - grid.time(z) < GAIN * before:
            break
    return z

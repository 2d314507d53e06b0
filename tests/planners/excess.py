"""Excess of a profile over its limits, by derivatives of the exact motion at places inside its phases.

The laws of the phases are evaluated here independently, from their definitions. The audit uses differences
and allows for their rounding, so it detects an excess of 1e-6. These tests require 1e-9 of profiles in closed
form (next to cusps in rational numbers), and would find an error that the audit or the sampler shares with
the planner.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray

from feedplan.constraints.problem import Problem
from feedplan.profile import PhaseLaw, SpeedProfile

Array = NDArray[np.float64]
# Rounding error of a tangent, as a share of the longest tangent on its arc.
ROUNDING = 1e-15
# A function of piece (m,), u (m,) and order that returns derivatives (order + 1, m, axes).
Motion = Callable[[NDArray[np.uint32], Array, int], Array]


def worst_excess(problem: Problem, profile: SpeedProfile, samples: int = 10) -> tuple[float, float]:
    """Greatest relative excess of any limit inside the arcs, and the smallest use, over all places, of the
    limit that is used most there.

    The laws of the arcs determine p along `problem.curve`; the limits are checked on the exact joints.
    """
    planned: Motion = problem.curve.evaluate
    tool: Motion = problem.path.curve.evaluate if problem.tip_curve is None else problem.tip_curve.evaluate
    # Arcs so short that the rounding of u matters are left out.
    long = (profile.u1 - profile.u0) > 1e-6 * problem.path.width[profile.piece]
    piece, kind, value = profile.piece[long], profile.kind[long, None], profile.value[long, None]
    axis = np.where(profile.axis[long] == 255, 0, profile.axis[long])
    u0, u1, p0, p1 = (column[long] for column in (profile.u0, profile.u1, profile.p0, profile.p1))
    rows = np.arange(len(piece))

    def at(motion: Motion, u: Array) -> tuple[Array, Array]:
        """C' and C'' at parameters u (rows, …)."""
        flat = motion(np.repeat(piece, u[0].size), u.ravel(), 2)
        return flat[1].reshape(*u.shape, -1), flat[2].reshape(*u.shape, -1)

    u = u0[:, None] + (u1 - u0)[:, None] * (np.arange(samples) + 0.5) / samples
    q1, q2 = at(problem.derivatives, u)
    t1, t2 = at(tool, u)
    j1, j2 = at(planned, u)
    g, c = j1[rows, :, axis], j2[rows, :, axis]
    # v² of the arc's axis at the slower end; its displacement from there by Gauss quadrature.
    ends = at(planned, np.stack([u0, u1], axis=1))[0][rows, :, axis]
    with np.errstate(invalid="ignore"):
        v_sq = np.stack([p0, p1], axis=1) * ends**2
    slow = np.argmin(np.where(np.isfinite(v_sq), v_sq, np.inf), axis=1)
    anchor = np.stack([u0, u1], axis=1)[rows, slow]
    nodes, weights = np.polynomial.legendre.leggauss(12)
    between = anchor[:, None, None] + (u - anchor[:, None])[..., None] * (nodes + 1) / 2
    way = (u - anchor[:, None]) / 2 * (at(planned, between)[0][rows, :, :, axis] @ weights)
    speed_sq = (t1**2).sum(axis=2)
    limits = problem.feed[piece]
    kinds = [kind == PhaseLaw.AXIS_ACCELERATION, kind == PhaseLaw.FEED, kind == PhaseLaw.AXIS_VELOCITY]
    with np.errstate(divide="ignore", invalid="ignore"):
        p = np.select(
            kinds,
            [(v_sq[rows, slow][:, None] + 2 * value * way) / g**2, value / speed_sq, value / g**2],
            p0[:, None],
        )
        s = np.select(kinds, [(value - c * p) / g, -p * (t1 * t2).sum(axis=2) / speed_sq, -p * c / g], 0.0)
    # Next to a cusp the displacement of the axis may be all rounding, with either sign.
    p = np.maximum(p, 0.0)
    # Next to a place where the axis turns round, s is a small difference divided by nearly 0: `grain` is its
    # rounding error.
    with np.errstate(divide="ignore", invalid="ignore"):
        grain = ROUNDING * np.abs(j1).max(axis=(1, 2))[:, None] * np.abs(c * p) / g**2
    grain = np.where(kinds[0], grain, 0.0)
    acceleration = np.abs(q1 * s[..., None] + q2 * p[..., None]) - np.abs(q1) * grain[..., None]
    used = np.concatenate(
        [
            acceleration / problem.max_acceleration,
            np.abs(q1) * np.sqrt(p)[..., None] / problem.max_velocity,
            (np.sqrt(speed_sq * p) / limits[:, None])[..., None],
        ],
        axis=2,
    ).max(axis=2)
    return float(used.max()) - 1, float(used.min())


def worst_excess_exactly(problem: Problem, profile: SpeedProfile) -> float:
    """The same excess as `worst_excess`, for the axes' limits on polynomial pieces, in rational numbers.

    Next to a cusp the derivatives of the piece in floats may be all rounding.
    """
    curve, worst = problem.curve, Fraction(0)
    for arc in np.flatnonzero(profile.u1 - profile.u0 > 1e-6 * problem.path.width[profile.piece]):
        piece = profile.piece[arc]
        width = Fraction(float(curve.width[piece]))
        own = curve.control_points[curve.offsets[piece] : curve.offsets[piece + 1]]
        points = [list(map(Fraction, point)) for point in own.tolist()]
        rates = _derivative(points, width)
        bends = _derivative(rates, width) if len(rates) > 1 else [[Fraction(0)] * len(rates[0])]
        kind, axis = profile.kind[arc], int(profile.axis[arc])
        value, u0, u1 = (Fraction(float(column[arc])) for column in (profile.value, profile.u0, profile.u1))
        for part in (0.001, 0.01, 0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95, 0.99, 0.999):
            u = u0 + (u1 - u0) * Fraction(part)
            g, c = _value(rates, u / width), _value(bends, u / width)
            if kind == PhaseLaw.FEED:
                p = value / sum(x * x for x in g)
                s = -p * sum(x * y for x, y in zip(g, c, strict=True)) / sum(x * x for x in g)
            elif kind == PhaseLaw.AXIS_VELOCITY:
                p = value / g[axis] ** 2
                s = -p * c[axis] / g[axis]
            else:
                # v² of the axis at the slower end; p is infinite in a cusp that is passed without a stop.
                ends = [(float(profile.p0[arc]), u0), (float(profile.p1[arc]), u1)]
                v_sq, slow = min(
                    (Fraction(p) * _value(rates, end / width)[axis] ** 2, end)
                    for p, end in ends
                    if p < np.inf
                )
                way = _value(points, u / width)[axis] - _value(points, slow / width)[axis]
                p = (v_sq + 2 * value * way) / g[axis] ** 2
                s = (value - c[axis] * p) / g[axis]
            limits = zip(g, c, problem.max_acceleration.tolist(), problem.max_velocity.tolist(), strict=True)
            for x, y, acceleration, velocity in limits:
                worst = max(
                    worst, abs(x * s + y * p) / Fraction(acceleration), x * x * p / Fraction(velocity) ** 2
                )
    return float(worst - 1)


def _value(points: list[list[Fraction]], t: Fraction) -> list[Fraction]:
    """The polynomials with these Bernstein coefficients at t, one per axis."""
    n = len(points) - 1
    basis = [comb(n, i) * t**i * (1 - t) ** (n - i) for i in range(n + 1)]
    return [sum(b * x for b, x in zip(basis, axis, strict=True)) for axis in zip(*points, strict=True)]


def _derivative(points: list[list[Fraction]], width: Fraction) -> list[list[Fraction]]:
    """Bernstein coefficients of the derivative by u = t width."""
    n = len(points) - 1
    return [
        [n * (y - x) / width for x, y in zip(before, after, strict=True)]
        for before, after in pairwise(points)
    ]

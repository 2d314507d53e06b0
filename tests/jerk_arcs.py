"""Profiles with limited jerk made by hand: sections of constant jerk, or v² as a cubic of the length."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

from feedplan.curves.composite import CompositeCurve
from feedplan.curves.length import CurveLength
from feedplan.profile import NO_AXIS, PhaseLaw, SpeedProfile
from tests.along import profile_of

Array = NDArray[np.float64]


def rest_to_rest(length: float, jerk: float, share: float = 1.0) -> list[tuple[float, float]]:
    """Durations [s] and jerks [mm/s³]: rise and fall over `share` of the length, constant speed between."""
    # The rise and the fall each cover half of the share in 2 h, at half of the speed reached: 2 h · J h² / 2.
    h = (0.5 * share * length / jerk) ** (1 / 3)
    speed = jerk * h**2
    return [(h, jerk), (h, -jerk), ((1.0 - share) * length / speed, 0.0), (h, -jerk), (h, jerk)]


def constant_jerk(
    curve: CompositeCurve, sections: Iterable[tuple[float, float]], start: tuple[float, float] = (0.0, 0.0)
) -> SpeedProfile:
    """The sections as phases along a curve, from a speed and an acceleration, cut where pieces meet."""
    table = CurveLength(curve)
    ends = table.length(np.arange(len(curve)), curve.width)
    rows = []
    piece, s, (v, a) = 0, 0.0, start
    u, some = 0.0, [row for row in sections if row[0] > 0.0]
    for number, (duration, jerk) in enumerate(some):
        left = duration
        while left > 0.0:
            time = left
            if piece + 1 < len(curve):
                roots = np.roots(np.trim_zeros([jerk / 6, a / 2, v, s - ends[piece]], "f"))
                times = [r.real for r in roots if abs(r.imag) < 1e-9 and 0.0 < r.real < left]
                time = min(times, default=left)
            crosses = time < left
            s1 = s + time * (v + time * (a / 2 + time * jerk / 6))
            v1, a1 = v + time * (a + time * jerk / 2), a + time * jerk
            finished = number + 1 == len(some) and not crosses
            if finished:
                v1, a1 = (0.0, 0.0) if abs(v1) < 1e-9 else (v1, a1)
            whole = crosses or finished
            u1 = float(curve.width[piece]) if whole else float(table.locate([s1], 1e-14)[1][0])
            p0, p1 = v**2 / square(curve, piece, u), v1**2 / square(curve, piece, u1)
            rows.append((piece, PhaseLaw.PATH_JERK, NO_AXIS, jerk, u, u1, p0, p1, time, a, a1))
            s, v, a, u = s1, v1, a1, u1
            left -= time
            if crosses:
                piece, u, s = piece + 1, 0.0, float(ends[piece])
    return profile_of(*rows)


def cubic_speed(
    curve: CompositeCurve, speed_sq: Callable[[float], float], slope: Callable[[float], float], arcs: int
) -> SpeedProfile:
    """Phases, `arcs` per piece, with the given v² and its slope by the length at their ends."""
    table = CurveLength(curve)
    rows = []
    for piece in range(len(curve)):
        cuts = np.linspace(0.0, float(curve.width[piece]), arcs + 1)
        lengths = table.length(np.full(arcs + 1, piece), cuts)
        for u0, u1, s0, s1 in zip(cuts[:-1], cuts[1:], lengths[:-1], lengths[1:], strict=True):
            w, dw = [speed_sq(s) for s in (s0, s1)], [slope(s) for s in (s0, s1)]
            p = [w[i] / square(curve, piece, u) for i, u in enumerate((u0, u1))]
            time = quad(lambda s, *row: 1.0 / math.sqrt(hermite(s, *row)), 0.0, s1 - s0,
                        args=(s1 - s0, *w, *dw), epsabs=1e-15, epsrel=1e-13)[0]  # fmt: skip
            kind = PhaseLaw.SPEED_CUBIC
            rows.append((piece, kind, NO_AXIS, 0.0, u0, u1, p[0], p[1], time, 0.5 * dw[0], 0.5 * dw[1]))
    return profile_of(*rows)


def hermite(s: float, way: float, w0: float, w1: float, dw0: float, dw1: float) -> float:
    """The cubic on [0, way] with these values and slopes at its ends, at s."""
    x = s / way
    y = 1.0 - x
    return w0 * y * y * (1 + 2 * x) + w1 * x * x * (1 + 2 * y) + way * x * y * (dw0 * y - dw1 * x)


def square(curve: CompositeCurve, piece: int, u: float) -> float:
    """|C'|²."""
    tangent = curve.evaluate(np.array([piece]), np.array([u]), 1)[1]
    return float((tangent**2).sum())

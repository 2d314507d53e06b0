"""Random straight curves of any degree, and the least times for straight motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from feedplan.geometry.path import Path
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StraightCase:
    """A straight path on a machine; lengths `ways` between its turns [mm], and the limits along it."""

    path: Path
    machine: Machine
    ways: Array
    velocity: float
    acceleration: float
    jerk: float

    @property
    def time(self) -> float:
        """The least time without a limit of jerk [s]: by a closed form for each way from rest to rest."""
        return float(sum(trapezoid(way, self.velocity, self.acceleration) for way in self.ways))

    @property
    def smooth_time(self) -> float:
        """The least time with the limit of jerk [s]."""
        limits = self.velocity, self.acceleration, self.jerk
        return float(sum(seven_sections(way, *limits) for way in self.ways))


def straight_case(seed: int) -> StraightCase:
    """A Bézier curve or a B-spline of degree 1 to 9 on a line in one to three axes.

    Half of them have weights from 0.1 to 10, half of them turn back, and spans may be as short as 1e-6 of the
    whole.
    """
    rng = np.random.default_rng(seed)
    degree, axes = int(rng.integers(1, 10)), int(rng.integers(1, 4))
    spans = 1 if rng.random() < 0.5 else int(rng.integers(2, 6))
    parts = np.where(rng.random(spans) < 0.3, 10 ** rng.uniform(-6, -2, spans), rng.uniform(0.2, 1, spans))
    inner = np.cumsum(parts)[:-1] / parts.sum()
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    count = degree + spans
    size = 10 ** rng.uniform(-1, 2.5)
    places = rng.uniform(0, size, count)
    if rng.random() < 0.5:
        places.sort()
    weights = np.exp(rng.uniform(-1, 1, count) * np.log(10)) if rng.random() < 0.5 else None
    direction = rng.normal(size=axes)
    direction /= np.linalg.norm(direction)
    origin = rng.uniform(-size, size, axes) if rng.random() < 0.5 else np.zeros(axes)
    own = rng.uniform(0.5, 2, (axes, 3)) * 10 ** np.array([rng.uniform(*r) for r in ((0, 3), (2, 4), (3, 6))])
    feed = 10 ** rng.uniform(0, 3) if rng.random() < 0.5 else np.inf
    machine = Machine("lines", tuple(Axis("XYZ"[k], *own[k, :2], max_jerk=own[k, 2]) for k in range(axes)))
    control = origin + np.outer(places, direction)
    with np.errstate(divide="ignore"):
        limits = (own / np.abs(direction)[:, None]).min(axis=0)
    return StraightCase(
        Path.from_nurbs(control, knots, degree, weights, feed=feed),
        machine,
        ways(places, knots, degree, weights),
        float(min(limits[0], feed)),
        *map(float, limits[1:]),
    )


def ways(places: Array, knots: Array, degree: int, weights: Array | None) -> Array:
    """The distances that a rational spline on one axis covers between its turns.

    Candidates for turns are the knots and the roots of the derivative's numerator on each span, which is
    written as a Chebyshev series.
    """
    weights = np.ones_like(places) if weights is None else weights
    numerator, weight = BSpline(knots, places * weights, degree), BSpline(knots, weights, degree)
    at = [knots[0]]
    for low, high in zip(*(np.unique(knots)[part] for part in (slice(-1), slice(1, None))), strict=True):
        nodes = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(
            np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)
        )
        x = (2 * nodes - low - high) / (high - low)
        top, bottom = (
            np.polynomial.Chebyshev.fit(x, f(nodes), degree, domain=[-1, 1]) for f in (numerator, weight)
        )
        rate = top.deriv() * bottom - top * bottom.deriv()
        roots = rate.roots() if degree > 1 or (weights != weights[0]).any() else np.empty(0)
        real = np.sort(roots.real[(np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) < 1)])
        at.extend([*(0.5 * (low + high) + 0.5 * (high - low) * real), high])
    u = np.array(at)
    reached = np.append((numerator(u[:-1]) / weight(u[:-1])), places[-1])
    # Candidates where the direction does not change, such as double roots, are no turns.
    steps = np.diff(reached)
    steps = steps[np.abs(steps) > 1e-13 * np.abs(places).max()]
    turned = np.flatnonzero(np.diff(np.sign(steps)) != 0) + 1
    return np.array([abs(part.sum()) for part in np.split(steps, turned)])


def trapezoid(way: float, velocity: float, acceleration: float) -> float:
    """The least time from rest to rest with limits of velocity and acceleration [s]."""
    if way * acceleration <= velocity**2:
        return float(2 * np.sqrt(way / acceleration))
    return way / velocity + velocity / acceleration


def seven_sections(way: float, velocity: float, acceleration: float, jerk: float) -> float:
    """The least time from rest to rest with a limit of jerk too [s]."""

    def rise(v: float) -> float:
        """The time from rest to speed v [s], with acceleration 0 at both ends."""
        return (
            2 * np.sqrt(v / jerk) if v * jerk <= acceleration**2 else v / acceleration + acceleration / jerk
        )

    if velocity * rise(velocity) <= way:
        return float(way / velocity + rise(velocity))
    peak = (0.5 * way * np.sqrt(jerk)) ** (2 / 3)
    if peak * jerk > acceleration**2:
        # v²/A + v A/J = way
        ramp = acceleration**2 / jerk
        peak = 0.5 * (np.sqrt(ramp**2 + 4 * way * acceleration) - ramp)
    return float(2 * rise(peak))

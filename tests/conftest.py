"""A plan that a person can check by hand, for the tests of files and of figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from feedplan.audit import Audit, LimitCheck
from feedplan.constraints.problem import Problem
from feedplan.curves.composite import CompositeCurve
from feedplan.events import TimedEvents
from feedplan.geometry.path import Path
from feedplan.knots import Knots
from feedplan.machine.machine import Machine
from feedplan.profile import PhaseLaw, SpeedProfile
from feedplan.report.account import Account, account
from feedplan.setpoints import SetpointChunk
from tests.campaign import EXAMPLES, examples

# Tests are independent of the computer's speed and of chance; a campaign draws more and new cases.
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("campaign", deadline=None, database=None, max_examples=examples(100))
settings.load_profile("campaign" if EXAMPLES else "same")
# Otherwise Hypothesis also draws constants of the loaded modules, which depend on the tests run before.
providers.is_local_module_file = lambda file: False

SIDE, FEED, ACCELERATION = 20.0, 50.0, 500.0
RAMP = PhaseLaw.AXIS_ACCELERATION


@dataclass
class SquarePlan:
    """A square of 20 mm at 50 mm/s and 500 mm/s²: each side takes 0.1 s up, 0.3 s at feed, 0.1 s down."""

    machine: Machine
    problem: Problem
    profile: SpeedProfile
    chunk: SetpointChunk
    verdict: Audit
    program: None = None
    compute: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def path(self) -> Path:
        return self.problem.path

    @property
    def account(self) -> Account:
        return account(self.problem, self.profile, None, False)

    def make_account(self, progress: object = None) -> Account:
        return self.account

    def setpoints(self, progress: object = None) -> Any:
        return _Stream(self.chunk)

    audited = True

    def pass_setpoints(self, sinks: Any, progress: object = None) -> Audit:
        for chunk in self.setpoints().chunks(300):
            for sink in sinks:
                sink(chunk)
        return self.verdict

    def knots(self, step: float) -> Knots:
        return Knots(self.problem, self.profile, step)

    @property
    def events(self) -> TimedEvents:
        return TimedEvents.none()

    def audit(self, progress: object = None) -> Audit:
        return self.verdict

    def summary(self) -> dict[str, Any]:
        return {
            "time": 2.0,
            "lower_bound": 2.0,
            "gap": 0.0,
            "estimated_gap": None,
            "today": None,
            "gain": None,
            "method": "bang-bang",
            "machine": "router",
            "program": "square <1>.ngc",
            "units": {"length": "mm", "angle": "deg", "time": "s"},
            **self.account.to_json(),
            "setpoints": {"count": len(self.chunk.t)},
            "pieces": 4,
            "runs": 4,
            "stops": 5,
            "fit": {"points": 0, "splines": 0, "polynomials": 0, "deviation": 0.0, "mean_offset": None},
            "compute": {"read": 1e-3, "plan": 2e-3},
            "audit": {"ok": self.verdict.ok, "jerk": np.float64(np.inf)},
            "warnings": list(self.warnings),
        }


class _Stream:
    def __init__(self, chunk: SetpointChunk) -> None:
        self._chunk = chunk
        self.axes = chunk.axes
        self.period = 0.001
        self.count = len(chunk.t)
        self.events = TimedEvents.none()

    def chunks(self, size: int) -> Iterator[SetpointChunk]:
        for first in range(0, self.count, size):
            yield part_of(self._chunk, first, first + size)

    def around(self, t: float) -> SetpointChunk:
        first = int(t / self.period)
        return part_of(self._chunk, first, first + 2)


def part_of(chunk: SetpointChunk, first: int, last: int) -> SetpointChunk:
    names = ("t", "position", "velocity", "acceleration", "jerk", "line", "piece", "u")
    return SetpointChunk(**{name: getattr(chunk, name)[first:last] for name in names}, axes=chunk.axes)


@pytest.fixture
def square() -> SquarePlan:
    return _square(LimitCheck("acceleration", "X", 500.0, 500.0, 1.0, 0.05, 3, True))


@pytest.fixture
def broken_square() -> SquarePlan:
    return _square(LimitCheck("acceleration", "X", 750.0, 500.0, 1.5, 0.05, 3, True))


def _square(check: LimitCheck) -> SquarePlan:
    corners = np.array([[0.0, 0.0, 0.0], [SIDE, 0, 0], [SIDE, SIDE, 0], [0, SIDE, 0], [0, 0, 0]])
    control = np.stack([corners[:-1], (corners[:-1] + corners[1:]) / 2, corners[1:]], axis=1)
    four = np.arange(4)
    path = Path(
        axes=("X", "Y", "Z"),
        curve=CompositeCurve.from_pieces(control, np.full(4, SIDE)),
        feed=np.full(4, FEED),
        move=np.stack([four, four], axis=1),
        line=np.arange(3, 7, dtype=np.int32),
        runs=np.arange(5),
        dwell=np.zeros(4),
        tolerance=np.full(4, 0.01),
    )
    problem = Problem(
        path=path,
        max_velocity=np.array([100.0, 100.0, 50.0]),
        max_acceleration=np.array([ACCELERATION, ACCELERATION, 300.0]),
        max_jerk=np.array([50_000.0, 50_000.0, np.inf]),
        feed=path.feed,
        junction_speed=np.zeros(5),
        chord_tolerance=0.02,
        period=0.001,
    )
    sign = np.array([1.0, 1.0, -1.0, -1.0])
    ramp = FEED**2 / (2 * ACCELERATION)
    value = np.stack([sign * ACCELERATION, np.full(4, FEED**2), -sign * ACCELERATION], axis=1)
    axis = np.array([[0, 255, 0], [1, 255, 1]] * 2)
    profile = SpeedProfile(
        piece=np.repeat(four, 3).astype(np.uint32),
        kind=np.tile([RAMP, PhaseLaw.FEED, RAMP], 4).astype(np.uint8),
        axis=axis.ravel().astype(np.uint8),
        value=value.ravel(),
        u0=np.tile([0.0, ramp, SIDE - ramp], 4),
        u1=np.tile([ramp, SIDE - ramp, SIDE], 4),
        p0=np.tile([0.0, FEED**2, FEED**2], 4),
        p1=np.tile([FEED**2, FEED**2, 0.0], 4),
        duration=np.tile([0.1, 0.3, 0.1], 4),
        runs=np.arange(0, 13, 3),
    )
    machine = Machine.load("router")
    jerk = LimitCheck("jerk", "X", 1e6, 5e4, 20.0, 0.1, 3, False)
    return SquarePlan(machine, problem, profile, _chunk(corners), Audit((check, jerk), 2001))


def _chunk(corners: Any) -> SetpointChunk:
    t = np.linspace(0.0, 2.0, 2001)
    side = np.minimum((t / 0.5).astype(int), 3)
    now = t - 0.5 * side
    s = np.interp(now, [0.1, 0.4], [2.5, 17.5])
    s = np.where(now < 0.1, 250.0 * now**2, np.where(now > 0.4, SIDE - 250.0 * (0.5 - now) ** 2, s))
    speed = np.minimum.reduce([500.0 * now, np.full(len(t), FEED), 500.0 * (0.5 - now)])
    rate = np.where(now < 0.1, 500.0, np.where(now > 0.4, -500.0, 0.0))
    along = (corners[1:] - corners[:-1])[side] / SIDE
    return SetpointChunk(
        t=t,
        position=corners[side] + s[:, None] * along,
        velocity=speed[:, None] * along,
        acceleration=rate[:, None] * along,
        jerk=np.zeros((len(t), 3)),
        line=(3 + side).astype(np.int32),
        axes=("X", "Y", "Z"),
        piece=side.astype(np.uint32),
        u=np.clip(s, 0.0, SIDE),
    )

"""Paths that turn back: the tool rests for no time, and its acceleration does not vanish."""

from __future__ import annotations

import numpy as np
import pytest

import feedplan
from feedplan.machine.machine import Axis, Machine
from tests.campaign import seeds
from tests.planners.differences import exceeded

V, A, J = 250.0, 3000.0, 5e4
PERIOD = 0.0005
FAST = Machine("fast", (Axis("X", V, A, max_jerk=J), Axis("Y", V, A, max_jerk=J)), period=PERIOD)


def planned(moves: str, machine: Machine = FAST, method: str = "jerk-limited") -> feedplan.Plan:
    made = feedplan.plan(f"G21 G90 G94 G64 P0.01\n{moves}\nM2\n", machine, method=method)
    assert made.audit().ok, made.audit()
    assert exceeded(made.setpoints().all(), machine, machine.period, jerk=True) == []
    return made


def there_and_back(length: float, times: int, feed: float = 1e5) -> str:
    return "\n".join(f"G1 X{x:.9f} F{feed:.0f}" for x in [length, 0.0] * times)


def test_long_strokes_turn_back_at_the_greatest_acceleration() -> None:
    # From rest with acceleration 0 to V: V/A + A/J, at V/2 on average. If the acceleration begins at A, it
    # takes A/(2 J) less time and A³/(24 J²) less distance. `stop` and `turn` are the losses against a
    # constant speed V.
    stop = 0.5 * (V / A + A / J)
    turn = V / A + A / (2 * J) - (V * stop - A**3 / (24 * J**2)) / V
    made = planned(there_and_back(100.0, 4))
    assert made.time == pytest.approx(8 * 100.0 / V + 2 * stop + 14 * turn, abs=1e-9)


def test_short_strokes_swing_with_full_jerk() -> None:
    # From acceleration a to −a at jerk −J: 2 a/J and 2 a³/(3 J²). The first and the last stroke have
    # acceleration 0 at one end.
    length, strokes = 2.0, 40
    a = (1.5 * length * J**2) ** (1 / 3)
    first = (length * J**2 / (1 / 3 + 0.125**0.5)) ** (1 / 3)
    made = planned(there_and_back(length, strokes // 2))
    least = (strokes - 2) * 2 * a / J + 2 * (1 + 2**0.5) * first / J
    assert least * (1 - 1e-9) <= made.time <= least * (1 + 1e-5)
    assert made.lower_bound == pytest.approx(made.time, rel=3e-4)


def test_the_acceleration_at_a_turn_is_that_of_both_sides() -> None:
    made = planned(there_and_back(10.0, 1))
    turn = float(made.profile.duration[made.profile.piece == 0].sum())
    step = 1e-6
    before, at, after = (made.at(turn + t) for t in (-step, 0.0, step))
    assert abs(at.velocity[0]) < 1e-9
    assert before.acceleration[0] == pytest.approx(after.acceleration[0], abs=3 * J * step)
    assert before.acceleration[0] < -2000.0
    assert before.velocity[0] > 0.0 > after.velocity[0]


@pytest.mark.parametrize("scale", [0.01, 0.3, 10.0, 100.0])
@pytest.mark.parametrize("seed", range(seeds(3)))
def test_random_strokes_keep_all_limits_and_are_never_slower_than_with_stops(seed: int, scale: float) -> None:
    rng = np.random.default_rng([seed, int(100 * scale)])
    limits = 10.0 ** rng.uniform(-0.5, 0.5, (2, 3)) * [V, A, J]
    axes = tuple(Axis(name, v, a, max_jerk=j) for name, (v, a, j) in zip("XY", limits.tolist(), strict=True))
    machine = Machine("random", axes, period=PERIOD)
    direction = rng.standard_normal(2)
    moves, place = [], 0.0
    for i in range(10):
        way = scale * 10.0 ** rng.uniform(-1.0, 0.0)
        place += way if i % 2 else -way
        feed = 60 * V * 10.0 ** rng.uniform(-1.5, 0.5)
        # Some strokes have two feeds, and some turns are corners of less than 180°.
        if rng.random() < 0.3:
            middle = place - (0.3 * way if i % 2 else -0.3 * way)
            moves.append(f"G1 X{middle * direction[0]:.12f} Y{middle * direction[1]:.12f} F{2 * feed:.4f}")
        if rng.random() < 0.2:
            direction = rng.standard_normal(2)
        moves.append(f"G1 X{place * direction[0]:.12f} Y{place * direction[1]:.12f} F{feed:.4f}")
    made = planned("\n".join(moves), machine)
    stopped = planned("\n".join(f"{move}\nG4 P0.000000001" for move in moves), machine)
    assert made.time <= stopped.time * (1 + 1e-6)
    assert made.lower_bound <= made.time


def test_a_pause_at_the_turn_lets_the_acceleration_vanish() -> None:
    paused = planned("G1 X10 F15000\nG4 P0.1\nG1 X0")
    assert paused.time - 0.1 > 1.1 * planned("G1 X10 F15000\nG1 X0").time


def test_arcs_there_and_back_take_one_acceleration_at_each_turn() -> None:
    # A line and a half circle there, and both back: at no turn is a side a line with a single feed.
    lap = "G1 X4 Y4 F9000\nG2 X10 Y4 I3 J0\nG3 X4 Y4 I-3 J0\nG1 X0 Y0 F15000"
    paused = planned(lap.replace("\nG3", "\nG4 P0.000000001\nG3"))
    made = planned(lap)
    turn = int(np.flatnonzero(made.profile.p1 == 0.0)[0])
    accelerations = made.profile.a1[turn], made.profile.a0[turn + 1]
    assert accelerations[0] == -accelerations[1] < -1000.0
    assert made.time < 0.96 * paused.time
    assert 0.98 * made.time < made.lower_bound <= made.time

"""toppra's quick start, solved exactly: seven joints through five random waypoints.

The spline, the limits and the seed are those of toppra's documentation. toppra plans on a grid, and its time
falls towards the optimum as the grid gets finer; feedplan plans on the spline itself and proves by a lower
bound that no plan is faster. For both the script prints the time of the motion, the computing time, and the
greatest use of a limit: feedplan's as its audit measures it, toppra's on a fine grid of its own trajectory.
toppra has packages for Linux on x86-64 only; elsewhere the script prints feedplan's line alone.

    python examples/4_toppra_quick_start.py --output out/toppra
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

import feedplan

Problem = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
JOINTS = [f"j{k}" for k in range(1, 8)]


def quick_start() -> Problem:
    """Parameters (5,) and positions (5, 7) [rad] of the waypoints, and the greatest velocities (7,) [rad/s]
    and accelerations (7,) [rad/s²] of the joints."""
    random = np.random.RandomState(9)
    points = random.randn(5, 7)
    return np.linspace(0, 1, 5), points, 10 + random.rand(7) * 20, 10 + random.rand(7) * 2


def best_of_three(call: Callable[[], Any]) -> tuple[Any, float]:
    """The result of a call, and the least of three computing times [s]."""
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        result = call()
        seconds.append(time.perf_counter() - begin)
    return result, min(seconds)


def by_toppra(problem: Problem, cells: int) -> tuple[float, float, float]:
    """Time [s], computing time [s] and greatest use of a limit by toppra, on a grid of `cells` intervals."""
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("CRITICAL")
    parameters, points, velocity, acceleration = problem
    path = toppra.SplineInterpolator(parameters, points)
    limits = [
        constraint.JointVelocityConstraint(velocity),
        constraint.JointAccelerationConstraint(acceleration),
    ]
    grid = np.linspace(0.0, 1.0, cells + 1)

    def solved() -> Any:
        solver = algorithm.TOPPRA(limits, path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
        return solver.compute_trajectory()

    trajectory, computing = best_of_three(solved)
    t = np.linspace(0.0, trajectory.duration, 100_001)
    use = max(np.abs(trajectory(t, 1) / velocity).max(), np.abs(trajectory(t, 2) / acceleration).max())
    return trajectory.duration, computing, use


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--output", default="out/toppra", help="directory")
    output = parser.parse_args().output

    problem = quick_start()
    parameters, points, velocity, acceleration = problem
    axes = [
        feedplan.Axis(name, float(v), float(a), unit="rad")
        for name, v, a in zip(JOINTS, velocity, acceleration, strict=True)
    ]
    machine = feedplan.Machine("arm", axes)
    path = feedplan.Path.from_bspline(make_interp_spline(parameters, points), axes=JOINTS)
    plan, computing = best_of_three(lambda: feedplan.plan(path, machine))
    audit = plan.audit()
    use = max(check.ratio for check in audit.checks if check.name in ("velocity", "acceleration"))

    print("                    time [s]  computing [ms]  greatest use of a limit")
    print(f"feedplan           {plan.time:9.6f}  {1e3 * computing:14.2f}  {use:23.4%}")
    try:
        for cells in (100, 1000, 10_000):
            duration, seconds, use = by_toppra(problem, cells)
            print(f"toppra, {cells:5} cells {duration:9.6f}  {1e3 * seconds:14.2f}  {use:23.4%}")
    except ImportError:
        print("toppra is not installed: `pip install toppra` on Linux")
    print(f"No plan of this path is faster than {plan.lower_bound:.6f} s (gap {plan.gap:.1e}).")
    print("feedplan's audit:", "every limit holds." if audit.ok else "a limit is broken.")

    feedplan.write_plan(plan, output)
    print(f"The setpoints of the joints are in {output}.")


if __name__ == "__main__":
    main()

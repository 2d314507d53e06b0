"""The certificate: a time that no feasible profile of a problem can beat."""

from __future__ import annotations

import numpy as np

from feedplan.constraints.problem import Problem


def lower_bound(problem: Problem) -> float:
    """A proven lower bound [s] on the time in motion along the problem's path, dwells not counted.

    No piece is passed faster than its chord at its feed, nor faster than each axis at its greatest velocity.
    """
    points = problem.path.curve.by_piece
    step = np.abs(points[:, 2] - points[:, 0])
    at_feed = np.linalg.norm(step, axis=1) / problem.feed
    at_velocity = (step / problem.max_velocity).max(axis=1, initial=0.0)
    return float(np.maximum(at_feed, at_velocity).sum())

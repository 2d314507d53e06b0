"""Audits a table of knots: each part between two knots at rest by its own, constant time step."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from feedplan.arrays import Floats
from feedplan.audit import Audit, audit_setpoints
from feedplan.audit.verdict import join, worst_of
from feedplan.audit.worst import Findings, Worst
from feedplan.errors import InputError
from feedplan.machine.machine import Machine
from feedplan.progress import Listener, tell
from feedplan.setpoints import SetpointChunk


def audit_knots(
    points: SetpointChunk,
    machine: Machine,
    *,
    resolution: float = 0.0,
    jerk: bool = False,
    corners: bool = False,
    progress: Listener | None = None,
) -> Audit:
    """Measures knots against the limits of a machine; arguments as for `audit_setpoints`.

    Between two knots at rest all time steps are equal, and this step is the `period` of that part. Measured
    are mean velocities, accelerations and jerks over one, two and three steps, and whether velocities match
    the positions. The acceleration of the cubics that a drive interpolates between knots is reported, not
    judged. Raises InputError as `audit_setpoints` does.
    """
    t, axes = points.t, points.axes
    limits = [machine.axis(name).acceleration_range for name in axes if name in machine.axis_names]
    units = tuple(machine.axis(name).unit for name in axes if name in machine.axis_names)
    audits = []
    for start, stop in _parts(points.velocity):
        tell(progress, start / len(t))
        period = float(t[stop] - t[start]) / (stop - start)
        if not 0.0 < period < np.inf:
            raise InputError(
                f"the times {t[start]:g} and {t[stop]:g} s of knots do not follow each other: plan again"
            )
        audits.append(
            audit_setpoints(
                points.part(slice(start, stop + 1), axes),
                machine,
                period=period,
                resolution=resolution,
                jerk=jerk,
                corners=corners,
            )
        )
    tell(progress, 1.0)
    between = _between(points, np.array(limits))
    return worst_of([*audits, join([between], axes, jerk, units, "")], axes)


def _between(points: SetpointChunk, limits: Floats) -> Findings:
    """The greatest acceleration on the cubic of each step; a cubic reaches it at an end of the step."""
    worst = Worst()
    t, velocity, line = points.t, points.velocity, points.line
    step = np.diff(t)[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean, before, after = np.diff(points.position, axis=0) / step, velocity[:-1], velocity[1:]
        ends = (
            (6.0 * mean - 4.0 * before - 2.0 * after) / step,
            (2.0 * before + 4.0 * after - 6.0 * mean) / step,
        )
    for acceleration, times, lines in zip(ends, (t[:-1], t[1:]), (line[:-1], line[1:]), strict=True):
        for axis in range(acceleration.shape[1]):
            own = acceleration[:, axis]
            limit = np.where(own < 0.0, -limits[axis, 0], limits[axis, 1])
            worst.offer("cubic_acceleration", np.abs(own), limit, times, lines, axis)
    return worst.findings()


def _parts(velocity: Floats) -> Iterator[tuple[int, int]]:
    """First and last knot of each part between knots at rest."""
    rests = np.flatnonzero(~(velocity != 0.0).any(axis=1))
    ends = np.unique(np.concatenate(([0], rests, [len(velocity) - 1])))
    return zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)

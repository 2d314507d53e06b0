"""Failures of the audit of a plan, and of its setpoints if they are few enough."""

from __future__ import annotations

from feedplan.audit import audit
from feedplan.constraints.problem import Problem
from feedplan.machine.machine import Machine
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.setpoints import Setpoints

# Setpoints are computed for plans up to this time [s]; a plan that is stopped at once may take minutes.
LONGEST = 60.0


def audited(
    problem: Problem,
    profile: SpeedProfile,
    machine: Machine,
    program: Program | None = None,
    jerk: bool = True,
) -> tuple[str, ...]:
    """A sentence for each limit that the audit finds exceeded."""
    short = profile.time <= LONGEST
    points = Setpoints(problem, profile, machine.period, "sarfraz") if short else None
    return audit(problem, profile, machine, program, points, jerk=jerk).failures

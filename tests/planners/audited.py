"""What the audit says of a plan and of its setpoints, if they can be made in a moment."""

from __future__ import annotations

from feedplan.audit import audit
from feedplan.constraints.problem import Problem
from feedplan.machine.machine import Machine
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.setpoints import Setpoints

# A plan stopped at once may take minutes: setpoints are made of those that take no longer [s].
LONGEST = 60.0


def audited(
    problem: Problem,
    profile: SpeedProfile,
    machine: Machine,
    program: Program | None = None,
    jerk: bool = True,
) -> tuple[str, ...]:
    """A sentence for each limit that is broken."""
    short = profile.time <= LONGEST
    points = Setpoints(problem, profile, machine.period, "sarfraz") if short else None
    return audit(problem, profile, machine, program, points, jerk=jerk).failures

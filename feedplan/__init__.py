"""feedplan: time-optimal speed along a part program's exact path, with proof and audit."""

from feedplan.audit import Audit, LimitCheck
from feedplan.errors import (
    FeedplanError,
    InfeasibleError,
    InputError,
    MachineError,
    MissingPackageError,
    ProgramError,
    SolverError,
)
from feedplan.geometry.path import Path
from feedplan.machine.machine import Axis, Machine
from feedplan.plan import Plan, plan
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.setpoints import SetpointChunk, Setpoints

__all__ = [
    "Audit",
    "Axis",
    "FeedplanError",
    "InfeasibleError",
    "InputError",
    "LimitCheck",
    "Machine",
    "MachineError",
    "MissingPackageError",
    "Path",
    "Plan",
    "Program",
    "ProgramError",
    "SetpointChunk",
    "Setpoints",
    "SolverError",
    "SpeedProfile",
    "plan",
]

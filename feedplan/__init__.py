"""feedplan: time-optimal speed along a part program's exact path, with proof and audit."""

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
from feedplan.program.program import Program

__all__ = [
    "Axis",
    "FeedplanError",
    "InfeasibleError",
    "InputError",
    "Machine",
    "MachineError",
    "MissingPackageError",
    "Path",
    "Program",
    "ProgramError",
    "SolverError",
]

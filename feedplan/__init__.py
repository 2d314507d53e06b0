"""feedplan: time-optimal speed along a part program's exact path, with proof and audit.

    plan = feedplan.plan("part.ngc", "mill")
    plan.time, plan.lower_bound, plan.audit().ok
    feedplan.write_plan(plan, "part")

`plan` plans a program on a machine, `compare` plans it by several methods, `check` audits setpoints in files;
`Client` does the same on a service. Units are millimetres, degrees and seconds. Wrong input raises a
`FeedplanError`, one sentence with the remedy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from feedplan._solvers import __version__ as __version__
from feedplan.audit import Audit, LimitCheck
from feedplan.checking import check
from feedplan.comparison import Row, compare
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
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.machine.machine import bundled_machines as machines
from feedplan.plan_folder import write_plan
from feedplan.planners import methods
from feedplan.planning import Plan, plan
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.program.read import read_program
from feedplan.setpoints import SetpointChunk, Setpoints
from feedplan.trajectory import State, Trajectory

if TYPE_CHECKING:
    from feedplan.client.client import Client
    from feedplan.machine.importers import import_machine
    from feedplan.planned_feeds.rewrite import PlannedProgram, planned_program, write_program

__all__ = [
    "Audit",
    "Axis",
    "Client",
    "FeedplanError",
    "InfeasibleError",
    "InputError",
    "LimitCheck",
    "Machine",
    "MachineError",
    "MissingPackageError",
    "Path",
    "Plan",
    "PlannedProgram",
    "Program",
    "ProgramError",
    "Row",
    "SetpointChunk",
    "Setpoints",
    "SolverError",
    "SpeedProfile",
    "State",
    "Trajectory",
    "check",
    "compare",
    "import_machine",
    "machines",
    "methods",
    "plan",
    "planned_program",
    "read_program",
    "write_plan",
    "write_program",
]


# Names that a plan does without, with their modules, which are imported when a name is first used.
_LATER = {
    "Client": "feedplan.client.client",
    "import_machine": "feedplan.machine.importers",
    "PlannedProgram": "feedplan.planned_feeds.rewrite",
    "planned_program": "feedplan.planned_feeds.rewrite",
    "write_program": "feedplan.planned_feeds.rewrite",
}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LATER[name]), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]

"""feedplan: time-optimal speed along a part program's exact path, with proof and audit.

    plan = feedplan.plan("part.ngc", "mill")
    plan.time, plan.lower_bound, plan.audit().ok
    feedplan.write_plan(plan, "part")

`plan` plans a program on a machine, `compare` plans it by several methods, `check` audits setpoints in files;
`Client` does the same on a service. Units are millimetres, degrees and seconds. Wrong input raises a
`FeedplanError`, whose message is one sentence with the remedy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from feedplan._solvers import __version__ as __version__
    from feedplan.audit import Audit, LimitCheck
    from feedplan.checking import check
    from feedplan.client.client import Client
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
    from feedplan.machine.importers import import_machine
    from feedplan.machine.machine import Machine
    from feedplan.machine.machine import bundled_machines as machines
    from feedplan.plan_folder import write_plan
    from feedplan.planned_feeds.rewrite import PlannedProgram, planned_program, write_program
    from feedplan.planners import methods
    from feedplan.planning import Plan, plan
    from feedplan.profile import SpeedProfile
    from feedplan.program.program import Program
    from feedplan.program.read import read_program
    from feedplan.setpoints import SetpointChunk, Setpoints
    from feedplan.trajectory import State, Trajectory

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


# The modules of the public names, and the names there if they differ. A module is imported when one of its
# names is first used: so `import feedplan` is fast, and Ctrl-C during the imports of a command ends with a
# sentence.
_PLACES = {
    "__version__": "feedplan._solvers",
    "Audit": "feedplan.audit",
    "Axis": "feedplan.machine.axis",
    "Client": "feedplan.client.client",
    "FeedplanError": "feedplan.errors",
    "InfeasibleError": "feedplan.errors",
    "InputError": "feedplan.errors",
    "LimitCheck": "feedplan.audit",
    "Machine": "feedplan.machine.machine",
    "MachineError": "feedplan.errors",
    "MissingPackageError": "feedplan.errors",
    "Path": "feedplan.geometry.path",
    "Plan": "feedplan.planning",
    "PlannedProgram": "feedplan.planned_feeds.rewrite",
    "Program": "feedplan.program.program",
    "ProgramError": "feedplan.errors",
    "Row": "feedplan.comparison",
    "SetpointChunk": "feedplan.setpoints",
    "Setpoints": "feedplan.setpoints",
    "SolverError": "feedplan.errors",
    "SpeedProfile": "feedplan.profile",
    "State": "feedplan.trajectory",
    "Trajectory": "feedplan.trajectory",
    "check": "feedplan.checking",
    "compare": "feedplan.comparison",
    "import_machine": "feedplan.machine.importers",
    "machines": "feedplan.machine.machine:bundled_machines",
    "methods": "feedplan.planners",
    "plan": "feedplan.planning",
    "planned_program": "feedplan.planned_feeds.rewrite",
    "read_program": "feedplan.program.read",
    "write_plan": "feedplan.plan_folder",
    "write_program": "feedplan.planned_feeds.rewrite",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, own = _PLACES[name].partition(":")
    found = globals()[name] = getattr(import_module(module), own or name)
    return found


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]

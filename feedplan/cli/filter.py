"""`feedplan filter`: a program filter of LinuxCNC's [FILTER] section, whose output is the program with
planned feeds.

In the INI file: `[FILTER] PROGRAM_EXTENSION = .ngc G-code` and `ngc = feedplan filter --machine FILE`.
LinuxCNC runs this command with the program's path. It shows `FILTER_PROGRESS=n` (0 to 100) as a bar, and the
other text on standard error if the exit code is not 0.
"""

from __future__ import annotations

import functools
import math
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import IO

import click

from feedplan import planners
from feedplan.cli import terminal
from feedplan.cli.options import METHOD, PROGRAM, TOLERANCE
from feedplan.cli.reading_options import machine_for, reading_options
from feedplan.errors import InfeasibleError, InputError
from feedplan.machine.machine import Machine
from feedplan.program.program import Program
from feedplan.program.read import Reading
from feedplan.program.source import Source

# For each stage: total progress at its start [%], and its share of the total [%].
_STAGES = {"read": (0, 10), "fit": (10, 20), "plan": (30, 40), "audit": (70, 20)}


def filter_progress(write: Callable[[str], object]) -> Callable[[str, float], None]:
    """A progress function that writes the total progress over all stages in the form that LinuxCNC reads,
    each whole per cent once."""
    told = -1

    def tell(stage: str, done: float) -> None:
        nonlocal told
        start, share = _STAGES.get(stage, (90, 10))
        now = int(start + share * min(max(done, 0.0), 1.0))
        if now > told:
            told = now
            write(f"FILTER_PROGRESS={now}\n")

    return tell


@click.command(name="filter")
@PROGRAM
@click.option("--machine", "-m", metavar="NAME|FILE", help="As for plan.  [default: LinuxCNC's INI file]")
@reading_options
@METHOD
@TOLERANCE
def filter_(
    program: str | IO[bytes],
    machine: str | None,
    method: planners.MethodName,
    tolerance: float | None,
    reading: Reading,
) -> None:
    """Write PROGRAM with planned feeds to standard output, as a program filter of LinuxCNC."""
    from feedplan.machine.importers import import_machine
    from feedplan.planned_feeds.rewrite import planned_program
    from feedplan.planning import plan

    tell = filter_progress(functools.partial(print, end="", file=sys.stderr, flush=True))
    known: Machine
    source: Source | Program
    # LinuxCNC sets this variable for the filters that it starts.
    own = os.environ.get("INI_FILE_NAME")
    if machine is not None:
        known, source, reading = machine_for(machine, program, reading)
    elif own:
        known, source = _without_travel(import_machine(own)), program
    else:
        raise InputError("LinuxCNC has named no INI file (INI_FILE_NAME): give the machine with --machine")
    result = plan(source, known, method=method, tolerance=tolerance, reading=reading, progress=tell)
    audit = result.audit(tell)
    if not audit.ok:
        raise InfeasibleError(terminal.failure_sentence(audit))
    content = planned_program(result, dialect="linuxcnc").content
    terminal.warn(result.warnings)
    tell("write", 1.0)
    sys.stdout.buffer.write(content)


def _without_travel(machine: Machine) -> Machine:
    """This machine with infinite travel, because only LinuxCNC knows the work offsets."""
    free = tuple(replace(axis, travel=(-math.inf, math.inf)) for axis in machine.axes)
    return replace(machine, axes=free)

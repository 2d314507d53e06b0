"""Finds the smallest bundled machine that fits a program."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from feedplan.errors import ProgramError
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.program.program import Program

# The name with which users request the smallest machine.
AUTO = "auto"

# This machine is tried first among those with the same number of axes.
_FIRST = "mill"


def names_of_machines_with(letter: str) -> str:
    """The bundled machines that have an axis, as a part of a sentence; empty if none has it."""
    names = [machine.name for machine in _by_size() if letter in machine.program_letters]
    return f" ({', '.join(names)})" if names else ""


def smallest_machine(read: Callable[[Machine], Program]) -> tuple[Machine, Program]:
    """The bundled machine with the fewest axes that fits a program, and the program.

    A machine fits if the program can be read for it and stays within its travels. If no travels suffice, the
    result is the first machine for which the program can be read. `read` reads the program for a machine; if
    it fails for all machines, its error for the largest one is raised.
    """
    found: tuple[Machine, Program] | None = None
    *smaller, largest = _by_size()
    for machine in smaller:
        with suppress(ProgramError):
            program = read(machine)
            if _reaches(machine, program):
                return machine, program
            found = found or (machine, program)
    return found or (largest, read(largest))


def _reaches(machine: Machine, program: Program) -> bool:
    """Whether the ends of all moves lie within the travels; true in other modes than JOINTS."""
    if program.coordinate_mode is not None and program.coordinate_mode.any():
        return True
    travels = np.array([machine.axis(name).travel for name in program.axes])
    return bool((program.target >= travels[:, 0]).all() and (program.target <= travels[:, 1]).all())


def _by_size() -> list[Machine]:
    """The bundled machines whose words are joints, by the number of their axes."""
    machines = (Machine.load(name) for name in bundled_machines())
    plain = [machine for machine in machines if machine.words_are_joints]
    return sorted(plain, key=lambda machine: (len(machine.axes), machine.name != _FIRST, machine.name))

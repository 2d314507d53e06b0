"""Which bundled machine a program fits."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from feedplan.errors import ProgramError
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.program.program import Program

# The machine that the smallest one is asked for by.
AUTO = "auto"

# Of machines with the same axes this one comes first.
_FIRST = "mill"


def names_of_machines_with(letter: str) -> str:
    """The bundled machines whose programs may name an axis, as a part of a sentence; empty for none."""
    names = [machine.name for machine in _by_size() if letter in machine.program_letters]
    return f" ({', '.join(names)})" if names else ""


def smallest_machine(read: Callable[[Machine], Program]) -> tuple[Machine, Program]:
    """The bundled machine with the fewest axes that a program can be read for and whose travels hold its
    places, and the program; where none holds them, the first that it can be read for.

    `read` reads the program for a machine. Raises what it raises for the largest machine where none will do.
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
    """Whether the ends of all moves lie within the travels; true where words are no joints."""
    if program.coordinate_mode is not None and program.coordinate_mode.any():
        return True
    travels = np.array([machine.axis(name).travel for name in program.axes])
    return bool((program.target >= travels[:, 0]).all() and (program.target <= travels[:, 1]).all())


def _by_size() -> list[Machine]:
    """The bundled machines whose words are joints, by the number of their axes."""
    machines = (Machine.load(name) for name in bundled_machines())
    plain = [machine for machine in machines if machine.words_are_joints]
    return sorted(plain, key=lambda machine: (len(machine.axes), machine.name != _FIRST, machine.name))

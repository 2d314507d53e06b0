"""Options of the command line that name the controller of today and its parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from feedplan.cli.options import as_one, by_name
from feedplan.errors import MachineError
from feedplan.machine.controller import MODELS, Controller
from feedplan.machine.machine import Machine

# Returns the controller of the command line for a machine; None without a controller.
Choice = Callable[[Machine], Controller | None]


def chosen(machine: Machine, name: str | None, parameters: dict[str, Any]) -> Controller | None:
    """The controller of that name with these parameters, which are added to those of the machine's controller
    if that has the same name.

    Raises MachineError for parameters without a controller.
    """
    own = machine.controller
    if name is None and own is None:
        if parameters:
            raise MachineError("--controller-option needs a controller: give --controller NAME as well")
        return None
    if own is not None and name in (None, own.name):
        return Controller(own.name, {**own.parameters, **parameters})
    return Controller(str(name), parameters)


def _pair(text: str) -> tuple[str, float | list[float]]:
    """Name and value of `NAME=VALUE`, where the value is a number or several with commas between them."""
    name, _, value = text.partition("=")
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        remedy = "give NAME=VALUE, such as junction_deviation=0.02"
        raise click.UsageError(f"--controller-option {text} is no number by name: {remedy}") from None
    return name.strip(), numbers[0] if len(numbers) == 1 else numbers


def _choice(controller: str | None, controller_options: tuple[str, ...]) -> Choice:
    given = by_name(map(_pair, controller_options), "--controller-option")
    return lambda machine: chosen(machine, controller, given)


# The command gets these options as one argument, `controller`, a `Choice`.
controller_options = as_one(
    "controller",
    _choice,
    (
        click.option(
            "--controller",
            type=click.Choice(tuple(MODELS)),
            help="Also compute the time that this controller needs by its own look-ahead.  [default: the "
            "machine file's, if any]",
        ),
        click.option(
            "--controller-option",
            "controller_options",
            multiple=True,
            metavar="NAME=VALUE",
            help="A parameter of the controller, such as junction_deviation=0.02; may be given several "
            "times.",
        ),
    ),
)
